// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/run_options.h"

#include <omp.h>

#include <charconv>
#include <sstream>

namespace subvol::cli {
namespace {

// Numbers and booleans as such, all else as text.
Json typed(const std::string& text) {
  const Json value = Json::parse(text, nullptr, false);
  return value.is_number() || value.is_boolean() ? value : Json(text);
}

}  // namespace

void add_output_options(CLI::App& verb, RunOptions& options, const std::string& output_help) {
  verb.add_option("-o,--output", options.outputs, output_help)->type_name("FILE")->allow_extra_args(false);
  verb.add_flag("--force", options.force, "Replace outputs that exist");
  verb.add_flag("--quiet", options.quiet, "Say nothing but errors");
  verb.add_option("--threads", options.threads, "Number of threads (default: all cores)")
      ->check(CLI::Range(1, 1024))
      ->type_name("N");
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

void apply_threads(const RunOptions& options) {
  if (options.threads > 0) omp_set_num_threads(options.threads);
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

Json options_in_force(const CLI::App& verb) {
  Json all = Json::object();
  for (const CLI::Option* option : verb.get_options()) {
    const std::string name = option->get_single_name();
    if (name == "help" || name == "output" || option->get_positional()) continue;
    const auto& given = option->results();
    if (!given.empty()) {
      all[name] = typed(given.back());
    } else if (option->get_expected_min() == 0) {
      all[name] = false;
    } else if (!option->get_default_str().empty()) {
      all[name] = typed(option->get_default_str());
    }
  }
  return all;
}

}  // namespace subvol::cli
