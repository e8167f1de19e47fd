// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/batch/manifest.h"

#include "cli/batch/table_rows.h"
#include "cli/batch/words.h"
#include "cli/runs/exit_status.h"
#include "cli/runs/run_options.h"
#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <unordered_map>
#include <utility>

#include <glob.h>

namespace subvol::cli {

using namespace internal;
namespace {

namespace fs = std::filesystem;

/// Options that the batch gives itself, or that make no sense in a batch.
constexpr std::array<std::string_view, 6> kReserved{"--output", "--report", "--force", "--quiet", "--config", "--help"};

constexpr const char* kManifestColumnNames = "'id', 'verb', 'input', 'options', 'outputs', or the name of an option";

/// Where a model stands, for messages; made into text only if there is something to say.
struct Place {
  const std::string* source;
  std::size_t line;
  std::string text() const { return line == 0 ? *source : *source + ":" + std::to_string(line); }
};

std::string text_of(const Json& value, const std::string& name) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number()) return value.dump();
  throw InputError("'" + name + "': expected a text or a number, got " + value.dump().substr(0, 40));
}

std::vector<std::string> words_of(const Json& value, const std::string& name) {
  if (!value.is_array()) return split_words(text_of(value, name));
  std::vector<std::string> words;
  for (const Json& word : value) words.push_back(text_of(word, name));
  return words;
}

std::string option_name(const std::string& column) { return column.starts_with("--") ? column : "--" + column; }

/// Adds an option with its value or values; none for null, false and an empty text, the option alone for true.
void add_option(BatchModel& model, const std::string& name, const Json& value) {
  if (value.is_null() || value == false || value == "" || value == "false") return;
  model.options.push_back(option_name(name));
  if (value == true || value == "true") return;
  for (std::string& word : value.is_array() ? words_of(value, name) : std::vector{text_of(value, name)})
    model.options.push_back(std::move(word));
}

void add_options(BatchModel& model, const Json& value) {
  if (value.is_object()) {
    for (const auto& [name, its_value] : value.items()) add_option(model, name, its_value);
    return;
  }
  for (std::string& word : words_of(value, "options")) model.options.push_back(std::move(word));
}

/// Collects models and checks them.
class Collector {
 public:
  Collector(const ModelDefaults& defaults, const VerbLookup& verbs) : defaults_(defaults), verbs_(verbs) {}

  std::uint32_t add_folder(const fs::path& folder) {
    manifest_.folders.push_back(folder.empty() ? fs::path(".") : folder);
    return static_cast<std::uint32_t>(manifest_.folders.size() - 1);
  }

  BatchModel fresh(std::uint32_t folder) const {
    return {
        .id = {}, .verb = defaults_.verb, .input = {}, .options = defaults_.options, .outputs = {}, .folder = folder};
  }

  /// Sets what a column or entry of this name says. An empty text and null count as not given.
  static void set(BatchModel& model, const std::string& name, const Json& value) {
    if (name.starts_with('#') || value.is_null() || value == "") return;
    if (name == "id")
      model.id = text_of(value, name);
    else if (name == "verb")
      model.verb = text_of(value, name);
    else if (name == "input")
      model.input = text_of(value, name);
    else if (name == "outputs")
      model.outputs = words_of(value, name);
    else if (name == "options")
      add_options(model, value);
    else
      add_option(model, name, value);
  }

  void add(BatchModel model, Place place) {
    try {
      complete(model);
    } catch (const InputError& error) {
      throw InputError(place.text() + ": " + error.what());
    }
    manifest_.models.push_back(std::move(model));
    places_.push_back(place);
  }

  BatchManifest finish() {
    require_distinct_ids();
    return std::move(manifest_);
  }

 private:
  void complete(BatchModel& model) {
    if (model.input.empty()) throw InputError("expected an 'input'");
    if (model.id.empty()) model.id = model.input;
    if (as_utf8(model.id) != model.id) throw InputError("'id': expected UTF-8, got " + in_quotes(model.id));
    const BatchVerb& verb = find_verb(model.verb);
    const bool has_outputs = verb.has("--output");
    if (has_outputs && model.outputs.empty()) model.outputs = defaults_.outputs;
    std::erase(model.outputs, "none");
    if (!has_outputs && !model.outputs.empty()) {
      throw InputError("'outputs': " + model.verb + " writes none");
    }
    require_known_options(model, verb);
  }

  const BatchVerb& find_verb(const std::string& name) {
    if (last_verb_ == nullptr || name != last_verb_name_) {
      last_verb_ = verbs_(name);
      last_verb_name_ = name;
    }
    if (last_verb_ == nullptr) throw InputError("'verb': there is no verb " + in_quotes(name) + " for a batch");
    return *last_verb_;
  }

  static void require_known_options(const BatchModel& model, const BatchVerb& verb) {
    for (const std::string& word : model.options) {
      const std::string_view name = std::string_view(word).substr(0, word.find('='));
      const bool is_reserved = std::find(kReserved.begin(), kReserved.end(), name) != kReserved.end();
      if (name == "-o" || is_reserved)
        throw InputError(std::string(name) + ": the batch gives this option itself; 'outputs' names what is written");
      if (name.starts_with("--") && !verb.has(name))
        throw InputError(model.verb + " has no option " + in_quotes(name) + "; a column is " + kManifestColumnNames +
                         ", and is ignored if its name begins with #");
    }
  }

  void require_distinct_ids() const {
    std::unordered_map<std::string_view, std::size_t> first;
    first.reserve(manifest_.models.size());
    for (std::size_t i = 0; i < manifest_.models.size(); ++i) {
      const auto [at, is_new] = first.emplace(manifest_.models[i].id, i);
      if (!is_new)
        throw InputError(places_[i].text() + ": the id " + in_quotes(manifest_.models[i].id) +
                         " is also that of the model at " + places_[at->second].text());
    }
  }

  const ModelDefaults& defaults_;
  const VerbLookup& verbs_;
  BatchManifest manifest_;
  std::vector<Place> places_;
  std::string last_verb_name_;
  const BatchVerb* last_verb_ = nullptr;
};

void read_table(const std::string& path, char separator, Collector& all) {
  const std::string text = read_file(path);
  const std::uint32_t folder = all.add_folder(fs::path(path).parent_path());
  TableRows rows(path, text, separator);
  std::vector<std::string> names, fields;
  if (!rows.next(names))
    throw InputError(path + ": expected a first line with the names of columns: " + kManifestColumnNames);
  if (std::find(names.begin(), names.end(), "input") == names.end())
    throw InputError(rows.place() + ": expected a column 'input' among the names of the first line");
  while (rows.next(fields)) {
    if (fields.size() != names.size())
      throw InputError(rows.place() + ": expected " + std::to_string(names.size()) +
                       " fields as in the first line, got " + std::to_string(fields.size()));
    BatchModel model = all.fresh(folder);
    for (std::size_t i = 0; i < names.size(); ++i) {
      try {
        Collector::set(model, names[i], Json(std::move(fields[i])));
      } catch (const InputError& error) {
        throw InputError(rows.place() + ": column '" + names[i] + "': " + error.what());
      }
    }
    all.add(std::move(model), {&path, rows.line()});
  }
}

/// A row as JSON; the entries that have no meaning of their own are options.
BatchModel model_of_json(std::string_view text, std::uint32_t folder, const Collector& all, const Place& place) {
  const Json row = Json::parse(text, nullptr, false);
  if (!row.is_object()) throw InputError(place.text() + ": expected an object in JSON, as {\"input\": \"bone.off\"}");
  BatchModel model = all.fresh(folder);
  try {
    for (const auto& [name, value] : row.items()) Collector::set(model, name, value);
  } catch (const InputError& error) {
    throw InputError(place.text() + ": " + error.what());
  }
  return model;
}

void read_json_lines(const std::string& path, Collector& all) {
  const std::string text = read_file(path);
  require_no_utf16(path, text);
  const std::uint32_t folder = all.add_folder(fs::path(path).parent_path());
  std::size_t line = 1;
  for (std::size_t at = 0; at < text.size(); ++line) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    const std::string_view row = std::string_view(text).substr(at, end - at);
    at = end + 1;
    if (row.find_first_not_of(" \t\r") == std::string_view::npos) continue;
    const Place place{&path, line};
    all.add(model_of_json(row, folder, all, place), place);
  }
}

void add_pattern(const std::string& pattern, std::uint32_t folder, Collector& all) {
  const auto add = [&](std::string name) {
    BatchModel model = all.fresh(folder);
    model.input = std::move(name);
    all.add(std::move(model), {&pattern, 0});
  };
  if (pattern.find_first_of("*?[") == std::string::npos || fs::exists(pattern)) return add(pattern);
  glob_t found{};
  const int status = ::glob(pattern.c_str(), 0, nullptr, &found);
  const std::vector<std::string> names(found.gl_pathv, found.gl_pathv + found.gl_pathc);
  ::globfree(&found);
  if (status != 0 || names.empty()) throw InputError(pattern + ": no file matches this pattern");
  for (const std::string& name : names) add(name);
}

}  // namespace

BatchManifest read_manifest(std::span<const std::string> sources, std::span<const std::string> rows,
                            const ModelDefaults& defaults, const VerbLookup& verbs) {
  Collector all(defaults, verbs);
  const std::uint32_t here = all.add_folder(".");
  for (const std::string& source : sources) {
    const std::string extension = lower_case(fs::path(source).extension().string());
    if (extension == ".csv")
      read_table(source, ',', all);
    else if (extension == ".tsv")
      read_table(source, '\t', all);
    else if (extension == ".jsonl" || extension == ".ndjson")
      read_json_lines(source, all);
    else
      add_pattern(source, here, all);
  }
  static const std::string kRow = "--row";
  for (const std::string& row : rows) {
    const Place place{&kRow, 0};
    all.add(model_of_json(row, here, all, place), place);
  }
  BatchManifest manifest = all.finish();
  if (manifest.models.empty() && sources.empty()) throw UsageError("expected a manifest, inputs, or --row");
  return manifest;
}

}  // namespace subvol::cli
