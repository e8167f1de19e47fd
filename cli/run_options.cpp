// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/run_options.h"

#include "cli/exit_status.h"
#include "subvol/text_scanner.h"

#include <omp.h>
#include <sys/resource.h>

#include <algorithm>
#include <charconv>
#include <sstream>

namespace subvol::cli {
namespace {

// Numbers and booleans as such, all else as text.
Json typed(const std::string& text) {
  const Json value = Json::parse(text, nullptr, false);
  return value.is_number() || value.is_boolean() ? value : Json(text);
}

Json typed(const std::vector<std::string>& texts) {
  Json all = Json::array();
  for (const std::string& text : texts) all.push_back(typed(text));
  return all;
}

constexpr std::size_t kLeastMemoryLimit = std::size_t{64} << 20, kMostMemoryLimit = std::size_t{1} << 50;

}  // namespace

void add_resource_options(CLI::App& verb, RunOptions& options) {
  verb.add_option("--threads", options.threads, "Number of threads (default: all cores)")
      ->check(CLI::Range(1, 1024))
      ->type_name("N");
  verb.add_option("--memory-limit", options.memory_limit,
                  "Take no more memory: bytes, or 800M, 4G. A fit ends before a level that would, with the best\n"
                  "result so far")
      ->transform(CLI::AsSizeValue(false))
      ->check(CLI::Range(kLeastMemoryLimit, kMostMemoryLimit))
      ->type_name("SIZE");
}

void add_output_options(CLI::App& verb, RunOptions& options, const std::string& output_help) {
  verb.add_option("-o,--output", options.outputs, output_help)->type_name("FILE")->allow_extra_args(false);
  verb.add_flag("--force", options.force, "Replace outputs that exist");
  verb.add_flag("--quiet", options.quiet, "Say nothing but errors");
  add_resource_options(verb, options);
}

CLI::Option* add_references_option(CLI::App& verb, RunOptions& options) {
  return verb
      .add_option("--references", options.references,
                  "Cell data of a .vtk that become the cells' references (default: those with a name of materials or\n"
                  "regions, or else the first of whole numbers that are no ghosts or cell numbers)")
      ->type_name("NAME");
}

void add_long_run_options(CLI::App& verb, RunOptions& options) {
  verb.add_option("--report", options.report, "Write what was done and what is true of the result")
      ->type_name("FILE.json");
  verb.add_option("--progress", options.progress,
                  "How to tell it: bar (default on a terminal) or plain on stderr, json on stdout, none")
      ->check(CLI::IsMember({"bar", "plain", "json", "none"}))
      ->type_name("KIND");
  verb.add_option("--seed", options.seed, "Kept in the report; nothing here draws random numbers")->type_name("N");
}

void require_fitting_options(const CLI::App& verb, bool points) {
  const auto given = [&](const char* name) {
    const CLI::Option* option = verb.get_option_no_throw(name);
    return option ? option->results() : std::vector<std::string>{};
  };
  if (!points) {
    if (!given("--point-weights").empty())
      throw UsageError("--point-weights: the target is a surface; its triangles count by their areas");
    return;
  }
  if (!given("--crease-angle").empty())
    throw UsageError("--crease-angle: the target holds points, between which no edges can be seen");
  if (const auto kind = given("--correspondence"); !kind.empty() && kind.back() == "voronoi")
    throw UsageError("--correspondence voronoi: the target holds points, which have no area to be cut into cells");
}

void apply_resources(const RunOptions& options) {
  if (options.threads > 0) omp_set_num_threads(options.threads);
  if (options.memory_limit == 0) return;
  rlimit limit{};
  getrlimit(RLIMIT_DATA, &limit);
  limit.rlim_cur = std::min<rlim_t>(options.memory_limit, limit.rlim_max);
  setrlimit(RLIMIT_DATA, &limit);
}

CLI::Validator number_in(double low, double high) {
  std::ostringstream range;
  range << low << " .. " << high;
  const auto check = [low, high, text = range.str()](const std::string& word) -> std::string {
    double value = 0;
    const char* end = word.data() + word.size();
    const auto [rest, error] = std::from_chars(word.data(), end, value);
    if (error == std::errc{} && rest == end && value >= low && value <= high) return {};
    return "must be a number in " + text + ", not " + word;
  };
  return CLI::Validator(check, "");
}

double parse_length(const std::string& option, const std::string& text, double diagonal) {
  const bool percent = text.ends_with('%');
  const std::string number = percent ? text.substr(0, text.size() - 1) : text;
  const std::string error = number_in(1e-300, 1e300)(std::string(number));
  if (!error.empty()) throw UsageError(option + ": must be a positive length, or a percentage as 2%, not " + text);
  return *parse_number(number) * (percent ? diagonal / 100 : 1);
}

std::string as_utf8(const std::string& text) {
  return Json::parse(Json(text).dump(-1, ' ', false, Json::error_handler_t::replace)).get<std::string>();
}

namespace {

/// Whether one was given that this one does not go with.
bool is_excluded(const CLI::Option& option) {
  const auto& others = option.get_excludes();
  return std::any_of(others.begin(), others.end(), [](const CLI::Option* other) { return other->count() > 0; });
}

}  // namespace

Json options_in_force(const CLI::App& verb) {
  Json all = Json::object();
  for (const CLI::Option* option : verb.get_options()) {
    const std::string name = option->get_single_name();
    if (name == "help" || name == "output" || option->get_positional()) continue;
    const auto& given = option->results();
    if (!given.empty()) {
      all[name] = option->get_items_expected_max() > 1 ? typed(given) : typed(given.back());
    } else if (is_excluded(*option)) {
      continue;
    } else if (option->get_expected_min() == 0) {
      all[name] = false;
    } else if (!option->get_default_str().empty()) {
      all[name] = typed(option->get_default_str());
    }
  }
  return all;
}

Json options_of_result(const CLI::App& verb) {
  Json options = options_in_force(verb);
  for (const char* name : {"force", "quiet", "threads", "memory-limit", "time-limit", "report", "progress", "config",
                           "checkpoint", "every", "resume"})
    options.erase(name);
  return options;
}

}  // namespace subvol::cli
