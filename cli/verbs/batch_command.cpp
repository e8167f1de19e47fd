// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/batch/batch_page.h"
#include "cli/batch/batch_run.h"
#include "cli/batch/latest_records.h"
#include "cli/batch/manifest.h"
#include "cli/runs/exit_status.h"
#include "cli/runs/interrupt.h"
#include "cli/runs/outputs.h"
#include "cli/runs/report.h"
#include "cli/runs/report_page.h"
#include "cli/runs/report_pictures.h"
#include "cli/runs/standard_output.h"
#include "cli/verbs/commands.h"
#include "cli/verbs/verb_options.h"
#include "subvol/base/atomic_file.h"
#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/base/version.h"

#include <omp.h>

#include <algorithm>
#include <iostream>
#include <map>
#include <memory>
#include <sstream>

namespace subvol::cli {

using namespace internal;
namespace {

namespace fs = std::filesystem;

// --- What the verbs of a batch accept, from the parser --------------------------------------------------------------

/// Finds verbs and their options in the description of the program.
class ParserVerbs {
 public:
  explicit ParserVerbs(const CLI::App& app) : app_(app) {}

  const BatchVerb* find(const std::string& name) {
    const auto known = verbs_.find(name);
    if (known != verbs_.end()) return &known->second;
    BatchVerb verb;
    const CLI::App* at = &app_;
    std::istringstream words(name);
    for (std::string word; words >> word;) {
      const auto below = at->get_subcommands([&](const CLI::App* sub) { return sub->get_name() == word; });
      if (below.empty()) return nullptr;
      at = below.front();
      verb.words.push_back(word);
    }
    if (at == &app_ || !takes_one_input(*at)) return nullptr;
    for (const CLI::Option* option : at->get_options())
      for (const std::string& long_name : option->get_lnames()) verb.options.insert("--" + long_name);
    return &verbs_.emplace(name, std::move(verb)).first->second;
  }

 private:
  /// A batch runs verbs that make or check one thing from one file; it does not run batches.
  static bool takes_one_input(const CLI::App& verb) {
    const auto options = verb.get_options([](const CLI::Option* option) { return option->get_positional(); });
    return options.size() == 1 && options.front()->get_required() && verb.get_name() != "completion";
  }

  const CLI::App& app_;
  std::map<std::string, BatchVerb> verbs_;
};

// --- batch ----------------------------------------------------------------------------------------------------------

struct BatchArguments {
  std::vector<std::string> words, rows, outputs;
  std::string words_for_all;  ///< never set: see the option
  std::string verb = "fit", folder, shard, only;
  BatchOptions options;
};

/// Words from the first hyphen on are options for every model: the shell's `--` lets them pass.
ModelDefaults defaults_of(const BatchArguments& arguments, std::vector<std::string>& sources) {
  ModelDefaults defaults;
  defaults.verb = arguments.verb;
  const auto first = std::find_if(arguments.words.begin(), arguments.words.end(),
                                  [](const std::string& word) { return word.starts_with('-'); });
  sources.assign(arguments.words.begin(), first);
  defaults.options.assign(first, arguments.words.end());
  if (!arguments.outputs.empty()) defaults.outputs = arguments.outputs;
  return defaults;
}

/// UsageError: the kinds of outputs are none that `-o` takes.
void require_outputs(const std::vector<BatchModel>& models) {
  const std::vector<std::string>* last = nullptr;
  for (const BatchModel& model : models) {
    if (last != nullptr && model.outputs == *last) continue;
    last = &model.outputs;
    for (const std::string& output : model.outputs) require_output_kind(output_word(output));
  }
}

PlanOptions plan_of(const BatchArguments& arguments) {
  PlanOptions plan = arguments.options.plan;
  if (!arguments.shard.empty()) plan.shard = parse_shard(arguments.shard);
  if (arguments.only.empty()) return plan;
  if (plan.force) throw UsageError("--only and --force exclude each other");
  plan.only_failed = arguments.only == "failed";
  if (plan.only_failed) return plan;
  plan.only = outcome_named(arguments.only);
  if (!plan.only)
    throw UsageError("--only: expected failed, or a class of failure as time_limit, not " + arguments.only);
  return plan;
}

void tell_result(const BatchResult& result) {
  std::cerr << result.num_run << " run, " << result.num_kept << " kept";
  if (result.num_elsewhere > 0) std::cerr << ", " << result.num_elsewhere << " taken by other workers";
  for (std::size_t i = 0; i < kNumOutcomes; ++i)
    if (result.counts[i] > 0) std::cerr << "; " << result.counts[i] << ' ' << name_of(static_cast<Outcome>(i));
  if (const std::size_t left = result.num_models - result.num_recorded(); left > 0)
    std::cerr << "; " << left << " to be run";
  std::cerr << '\n';
}

int run_batch_verb(BatchArguments& arguments, ParserVerbs& parser_verbs) {
  if (arguments.folder.empty()) throw UsageError("-o: expected the folder of the batch");
  if (fs::exists(arguments.folder) && !fs::is_directory(arguments.folder))
    throw UsageError("-o " + arguments.folder + ": is not a folder");
  const VerbLookup verbs = [&](const std::string& name) { return parser_verbs.find(name); };
  std::vector<std::string> sources;
  const ModelDefaults defaults = defaults_of(arguments, sources);
  BatchOptions options = arguments.options;
  options.plan = plan_of(arguments);
  options.folder = arguments.folder;
  if (options.jobs == 0) options.jobs = std::max(1, omp_get_num_procs() / options.threads);
  const BatchManifest manifest = read_manifest(sources, arguments.rows, defaults, verbs);
  require_outputs(manifest.models);
  const BatchResult result = run_batch(manifest, verbs, options);
  if (!options.quiet && !options.dry_run) tell_result(result);
  if (result.is_interrupted) return kInterrupted;
  if (options.dry_run) return kDone;
  if (result.num_failed() > 0) return kFailed;
  const bool all_valid = result.counts[static_cast<std::size_t>(Outcome::valid)] == result.num_models;
  return all_valid ? kDone : kNotConverged;
}

// --- batch report ---------------------------------------------------------------------------------------------------

struct BatchReportArguments {
  std::vector<std::string> folders, before;
  std::string output;
  bool json = false, no_pictures = false, force = false, quiet = false;
};

std::vector<fs::path> paths_of(const std::vector<std::string>& names) { return {names.begin(), names.end()}; }

/// A path as an address of a link.
std::string address_of(const fs::path& path) {
  constexpr std::string_view kPlainAddressCharacters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~/+=";
  constexpr std::string_view kHexadecimalDigits = "0123456789ABCDEF";
  std::string address;
  for (const char c : path.generic_string()) {
    const auto byte = static_cast<unsigned char>(c);
    if (kPlainAddressCharacters.find(c) != std::string_view::npos)
      address += c;
    else
      (address += '%', address += kHexadecimalDigits[byte >> 4], address += kHexadecimalDigits[byte & 15]);
  }
  return address;
}

fs::path folder_of_model(const std::vector<fs::path>& folders, const ModelFigures& model) {
  return folders[model.folder] / "models" / folder_name(model.id);
}

/// The picture of a result by its quality; empty if it cannot be drawn.
std::string picture_of(const fs::path& folder) {
  try {
    const fs::path file = folder / "report.json";
    std::vector<std::string> notes;
    Json report = parse_report(read_file(file), file.string());
    for (Json& output : report["outputs"])  // not a file of the same name in the current folder
      output = (folder / output.get<std::string>()).string();
    const ReportMeshes meshes = load_report_meshes(report, folder, notes);
    std::vector<ReportPicture> pictures = report_pictures(report, meshes, notes);
    // The last one with a scale of colors: of the result, or of its cells inside.
    const auto colored =
        std::find_if(pictures.rbegin(), pictures.rend(), [](const auto& p) { return !p.high.empty(); });
    return colored == pictures.rend() ? std::string() : std::move(colored->png);
  } catch (const InputError&) {
  } catch (const Json::exception&) {
  }
  return {};
}

std::vector<ShownModel> shown_models(const BatchSummary& summary, const std::vector<fs::path>& folders,
                                     bool with_pictures) {
  constexpr std::size_t kNumShown = 10;
  std::vector<ShownModel> shown;
  for (const std::size_t i : worst_models(summary, kNumShown)) {
    if (interrupted()) throw EndedEarly("interrupted; nothing was written", kInterrupted);
    const ModelFigures& model = summary.models[i];
    shown.push_back({i, model.id, with_pictures ? picture_of(folder_of_model(folders, model)) : std::string()});
  }
  return shown;
}

int run_batch_report(const BatchReportArguments& arguments) {
  if (arguments.output.empty() && !arguments.json) throw UsageError("batch report: give -o PAGE.html or --json");
  if (!arguments.output.empty()) {
    if (fs::path(arguments.output).extension() != ".html")
      throw UsageError("-o " + arguments.output + ": the extension must be .html");
    require_free(arguments.output, arguments.force);
  }
  catch_interrupt();
  const std::vector<fs::path> folders = paths_of(arguments.folders);
  const BatchSummary summary = summarize(folders);
  std::optional<BatchSummary> before;
  std::optional<PageComparison> comparison;
  if (!arguments.before.empty()) {
    before = summarize(paths_of(arguments.before));
    comparison.emplace(PageComparison{*before, compare(*before, summary), as_utf8(arguments.before.front())});
  }
  if (arguments.json) {
    Json json{{"subvol", version()}, {"command", "batch report"}};
    json.update(summary_json(summary));
    if (comparison) json["comparison"] = comparison_json(comparison->comparison, summary);
    print(json_text(json));
  }
  if (arguments.output.empty()) return kDone;
  const fs::path page_folder = fs::absolute(arguments.output).parent_path();
  const auto link = [&](const ModelFigures& model) {
    const fs::path folder = folder_of_model(folders, model);
    for (const char* name : {"report.json", "messages.txt"})
      if (fs::exists(folder / name)) return address_of(fs::relative(folder / name, page_folder));
    return std::string();
  };
  const std::string title = as_utf8(fs::absolute(arguments.folders.front()).lexically_normal().filename().string());
  write_file_atomically(arguments.output,
                        batch_page(title, summary, shown_models(summary, folders, !arguments.no_pictures),
                                   comparison ? &*comparison : nullptr, link));
  if (!arguments.quiet) std::cerr << "wrote " << arguments.output << '\n';
  return kDone;
}

// --- batch merge ----------------------------------------------------------------------------------------------------

struct MergeArguments {
  std::vector<std::string> folders;
  std::string output;
  bool reproducible = false, force = false;
};

int run_batch_merge(const MergeArguments& arguments) {
  if (fs::path(arguments.output).extension() != ".jsonl")
    throw UsageError("-o " + arguments.output + ": the extension must be .jsonl");
  require_free(arguments.output, arguments.force);
  const LatestRecords records(paths_of(arguments.folders));
  std::string text;
  records.for_each([&](const LatestRecords::Entry& entry) {
    if (arguments.reproducible)
      text += without_run(entry.line);
    else
      text += entry.line;
    text += '\n';
  });
  write_file_atomically(arguments.output, text);
  return kDone;
}

// --- Options --------------------------------------------------------------------------------------------------------

void add_report(CLI::App& group, Action& action) {
  CLI::App* verb = group.add_subcommand("report", "Show the results of a batch as a page");
  const auto arguments = std::make_shared<BatchReportArguments>();
  verb->add_option("FOLDER", arguments->folders, "Folder of a batch, or of each of its shards")->required();
  verb->add_option("-o,--output", arguments->output, "The page: one file that needs nothing else")
      ->type_name("FILE.html");
  verb->add_option("--compare", arguments->before, "Folder of an earlier batch: list what differs, by id")
      ->type_name("FOLDER")
      ->allow_extra_args(false);
  verb->add_flag("--json", arguments->json, "Print counts, quantiles and differences as JSON");
  verb->add_flag("--no-pictures", arguments->no_pictures, "Leave out the pictures of the worst results");
  verb->add_flag("--force", arguments->force, "Replace an existing page");
  verb->add_flag("--quiet", arguments->quiet, "Print nothing");
  verb->callback([arguments, &action] { action = [arguments] { return run_batch_report(*arguments); }; });
}

void add_batch_merge(CLI::App& group, Action& action) {
  CLI::App* verb = group.add_subcommand("merge", "Write the last record of each model, ordered by id");
  const auto arguments = std::make_shared<MergeArguments>();
  verb->add_option("FOLDER", arguments->folders, "Folder of a batch, or of each of its shards")->required();
  verb->add_option("-o,--output", arguments->output, "The records, one a line")->required()->type_name("FILE.jsonl");
  verb->add_flag("--reproducible", arguments->reproducible,
                 "Leave out what differs between two runs of the same work: times, memory, computer");
  verb->add_flag("--force", arguments->force, "Replace an existing file");
  verb->callback([arguments, &action] { action = [arguments] { return run_batch_merge(*arguments); }; });
}

void add_planning_options(CLI::App& verb, BatchArguments& arguments) {
  verb.add_option("--shard", arguments.shard, "Only part K of N, by a hash of the id: 1/8 to 8/8 are all models")
      ->type_name("K/N");
  verb.add_option("--only", arguments.only,
                  "Only models whose last record is a failure (failed), or one of this class (time_limit, crash ...)")
      ->type_name("CLASS");
  verb.add_flag("--force", arguments.options.plan.force, "Run all models, also those with a record of the same work");
  verb.add_flag("--dry-run", arguments.options.dry_run, "Print the ids of the models that would run, and run none");
}

void add_process_options(CLI::App& verb, BatchOptions& options) {
  verb.add_option("--jobs", options.jobs, "Processes at a time (default: cores / threads)")
      ->check(whole_number_in(1, 4096))
      ->type_name("N");
  verb.add_option("--threads", options.threads, "Threads of each process")
      ->check(whole_number_in(1, 1024))
      ->type_name("N")
      ->capture_default_str();
  verb.add_option("--time-limit", options.time_limit_seconds, "End a model after this time: its class is time_limit")
      ->check(number_in(0.001, 1e9))
      ->type_name("SECONDS");
  verb.add_option("--grace", options.grace_seconds, "Time that a model has to end after the limit, before it is killed")
      ->check(number_in(0, 1e6))
      ->type_name("SECONDS")
      ->capture_default_str();
  add_memory_limit(verb, options.memory_limit, "Memory that the process of a model may take: bytes, or 800M, 4G");
  verb.add_option("--program", options.plan.program,
                  "Run this in place of subvol, with the same words; $SUBVOL_PROGRAM is subvol")
      ->type_name("FILE");
}

constexpr const char* kFooter =
    R"(FOLDER receives records.jsonl, one line for each model as it ends, and models/ID with the outputs, the
report and the messages of each model. Called again, the batch goes on: models with a record of the same
input, options and version are kept. Several batches may work on one folder.

Words behind -- are options for every model. Columns of a .csv or .tsv, and entries of a .jsonl: input,
and if need be id, verb, options, outputs, and any option by its name.

Exit status 0: all models are valid; 1: some have failed; 4: some have not converged, or are still
to be run by another worker.

Examples:
  subvol batch parts/*.stl -o out -- --cells 300 --time-limit 60
  subvol batch models.csv -o out --jobs 8 --time-limit 600 --memory-limit 4G
  subvol batch models.csv -o out --shard 3/8
  subvol batch models.csv -o out --only failed
  subvol batch report out -o out.html --compare last_week)";

}  // namespace

void add_batch_command(CLI::App& app, Action& action) {
  CLI::App* verb = app.add_subcommand("batch", "Run a verb on many models, and go on where it was ended");
  const auto arguments = std::make_shared<BatchArguments>();
  arguments->options.jobs = 0;
  verb->add_option("MODELS", arguments->words, "Manifests (.csv, .tsv, .jsonl), inputs, or patterns of inputs");
  // The parser passes words behind -- on to a verb only if one of its positionals is still without a value. MODELS,
  // which comes first, receives them; this one shows them in the help.
  verb->add_option("OPTIONS", arguments->words_for_all, "Options for every model, behind --");
  verb->add_option("-o,--output", arguments->folder, "Folder of the batch; it may exist")->type_name("FOLDER");
  verb->add_option("--row", arguments->rows, R"(A model as JSON: {"id": "bone", "input": "bone.off", "cells": 300})")
      ->type_name("JSON")
      ->allow_extra_args(false);
  verb->add_option("--verb", arguments->verb, "Verb of models that name none")
      ->type_name("VERB")
      ->capture_default_str();
  verb->add_option("--write", arguments->outputs,
                   "What each model writes: an extension, or PART:EXTENSION; none: nothing (default: mesh)")
      ->type_name("mesh|vtu|glb|...")
      ->allow_extra_args(false);
  add_planning_options(*verb, *arguments);
  add_process_options(*verb, arguments->options);
  verb->add_option("--progress", arguments->options.progress,
                   "How progress is shown: bar (default on a terminal) or plain on stderr, json on stdout, none")
      ->check(CLI::IsMember({"bar", "plain", "json", "none"}))
      ->type_name("KIND");
  verb->add_flag("--print", arguments->options.print_records, "Print the record of each model at the end");
  verb->add_flag("--quiet", arguments->options.quiet, "Print only errors");
  add_report(*verb, action);
  add_batch_merge(*verb, action);
  verb->footer(kFooter);
  const auto verbs = std::make_shared<ParserVerbs>(app);
  verb->callback([arguments, verbs, verb, &action] {
    if (verb->get_subcommands().empty()) action = [arguments, verbs] { return run_batch_verb(*arguments, *verbs); };
  });
}

}  // namespace subvol::cli
