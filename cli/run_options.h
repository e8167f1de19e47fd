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
  std::size_t memory_limit = 0;      ///< bytes; 0: none
  unsigned seed = 0;
  std::string progress;              ///< bar, plain, json, none; empty: by what stderr is
  std::string checkpoint, resume;    ///< empty: none
  std::string references;            ///< cell data that become the cells' references; empty: those that are meant
  double every_seconds = 60;         ///< between two writes of the checkpoint, at least
};

/// --threads, --memory-limit.
void add_resource_options(CLI::App& verb, RunOptions& options);
/// -o, --force, --quiet, and the above.
void add_output_options(CLI::App& verb, RunOptions& options, const std::string& output_help);
/// --references: for what reads volume meshes.
CLI::Option* add_references_option(CLI::App& verb, RunOptions& options);
/// --report, --progress, --seed: for what runs long.
void add_long_run_options(CLI::App& verb, RunOptions& options);
/// --threads alone sets OpenMP's number of threads, here and nowhere else. --memory-limit becomes the process's own
/// limit on data: what goes beyond it fails to be allocated (`std::bad_alloc`).
void apply_resources(const RunOptions& options);

/// UsageError: an option was given that means nothing for the target that there is, points or a surface.
void require_fitting_options(const CLI::App& verb, bool points);
/// Accepts numbers from low to high, and nothing else (NaN passes CLI::Range).
CLI::Validator number_in(double low, double high);
/// A length in the mesh's unit, or with % of a diagonal. UsageError, naming the option: neither.
double parse_length(const std::string& option, const std::string& text, double diagonal);
/// A text with U+FFFD in place of what is not UTF-8, as names of files need not be.
std::string as_utf8(const std::string& text);
/// The options of a verb that have a value, by long name: given or default; a list where there are several.
Json options_in_force(const CLI::App& verb);
/// Those of them that bear on what is written: not how a run is told, limited, or kept. What files other than reports
/// say of a run, so that they are the same bytes for any number of threads, and for a run that was resumed.
Json options_of_result(const CLI::App& verb);

}  // namespace subvol::cli
