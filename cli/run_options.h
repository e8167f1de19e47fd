// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <optional>
#include <string>
#include <vector>

namespace subvol::cli {

/// Ordered as written: reports list things in the order people expect.
using Json = nlohmann::ordered_json;

/// Options that several verbs share.
struct RunOptions {
  std::vector<std::string> outputs;  ///< -o, as given
  std::string report;                ///< empty: none
  bool force = false, quiet = false;
  int threads = 0;                   ///< 0: all cores
  unsigned seed = 0;
  std::string progress;              ///< bar, plain, json, none; empty: by what stderr is
};

/// -o, --force, --quiet, --threads.
void add_output_options(CLI::App& verb, RunOptions& options, const std::string& output_help);
/// --report, --progress, --seed: for what runs long.
void add_long_run_options(CLI::App& verb, RunOptions& options);
/// --threads alone sets OpenMP's number of threads, here and nowhere else.
void apply_threads(const RunOptions& options);
/// Accepts numbers from low to high, and nothing else (NaN passes CLI::Range).
CLI::Validator number_in(double low, double high);
/// The options of a verb that have a value, by long name: given or default.
Json options_in_force(const CLI::App& verb);

}  // namespace subvol::cli
