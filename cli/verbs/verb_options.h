// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/checkpointing.h"
#include "cli/runs/run_options.h"
#include "cli/runs/writing.h"

#include <CLI/CLI.hpp>

#include <string>
#include <utility>
#include <vector>

namespace subvol::cli {

// The options that several verbs share, as the parser is told of them.

/// --threads, --memory-limit.
void add_resource_options(CLI::App& verb, RunOptions& options);
/// -o, --force, --quiet, and the above.
void add_output_options(CLI::App& verb, RunOptions& options, const std::string& output_help);
/// --references: for what reads volume meshes.
CLI::Option* add_references_option(CLI::App& verb, RunOptions& options);
/// --report, --progress, --seed: for what runs long.
void add_long_run_options(CLI::App& verb, RunOptions& options);

/// --checkpoint, --every, --resume.
void add_checkpoint_options(CLI::App& verb, RunOptions& options);
/// --chord, --unit, --up, --cut, --no-wireframe, --quantize.
void add_writing_options(CLI::App& verb, WritingOptions& options);

/// --map-tolerance.
CLI::Option* add_map_tolerance(CLI::App& verb, WritingOptions& options);

/// UsageError: an option was given that means nothing for the target that there is, points or a surface.
void require_fitting_options(const CLI::App& verb, bool points);
/// Accepts numbers from low to high, and nothing else (NaN passes CLI::Range).
CLI::Validator number_in(double low, double high);
/// The options of a verb that have a value, by long name: given or default; a list where there are several.
Json options_in_force(const CLI::App& verb);
/// Those of them that bear on what is written: not how a run is told, limited, or kept. What files other than reports
/// say of a run, so that they are the same bytes for any number of threads, and for a run that was resumed.
Json options_of_result(const CLI::App& verb);

/// A run by its version, verb, inputs (name and fingerprint), and those options that bear on the result of the fit.
RunIdentity run_identity(const CLI::App& verb, const std::vector<std::pair<std::string, std::string>>& inputs);

}  // namespace subvol::cli
