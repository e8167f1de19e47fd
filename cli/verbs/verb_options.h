// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/checkpointing.h"
#include "cli/runs/outputs.h"
#include "cli/runs/run_options.h"
#include "cli/runs/writing.h"
#include "subvol/base/types.h"
#include "subvol/fit/tuning/tuning.h"
#include "subvol/surface/region_surface.h"
#include "subvol/surface/triangle_mesh.h"

#include <CLI/CLI.hpp>

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace subvol::cli {

// Declares to the parser the options that several verbs share.

/// --memory-limit.
void add_memory_limit(CLI::App& verb, std::size_t& bytes, const std::string& help);
/// --threads, --memory-limit.
void add_resource_options(CLI::App& verb, RunOptions& options);
/// -o, --force, --quiet, and the above.
void add_output_options(CLI::App& verb, RunOptions& options, const std::string& output_help);
/// --references, for verbs that read volume meshes.
CLI::Option* add_references_option(CLI::App& verb, RunOptions& options);
/// --report, --progress, --seed, for verbs that run long.
void add_long_run_options(CLI::App& verb, RunOptions& options);

/// --checkpoint, --every, --resume.
void add_checkpoint_options(CLI::App& verb, RunOptions& options);
/// --msh-version.
void add_msh_version_option(CLI::App& verb, WritingOptions& options);
/// --msh-version, --vtu-cells, --chord, --unit, --up, --cut, --no-wireframe, --quantize.
void add_writing_options(CLI::App& verb, WritingOptions& options);

/// Returns a warning for each option that was given although no output has the format that it is for.
std::vector<std::string> unused_output_options(const CLI::App& verb, std::span<const Output> outputs);

/// --regions. Its value is empty unless it is given, so that it is not among the options that files record.
void add_regions_option(CLI::App& verb, std::string& rule);
/// Returns the rule that --regions names; automatic if it is empty.
RegionRule region_rule(const std::string& rule);

/// --wrap (`FillingOptions::wrap_percent`), of a verb that has --regions.
void add_wrap_option(CLI::App& verb, std::optional<double>& percent);

/// --tune NAME=VALUE, which may be given several times.
void add_tune_option(CLI::App& verb, Tuning& tuning);

/// --map-tolerance.
CLI::Option* add_map_tolerance(CLI::App& verb, WritingOptions& options);

/// UsageError: an option was given that has no meaning for the kind of target, points or a surface.
void require_fitting_options(const CLI::App& verb, bool points);
/// Adds a warning if --keep-groups was given, but the target has no borders between groups of faces.
void warn_of_missing_groups(const CLI::App& verb, const TriangleMesh& target, std::vector<std::string>& warnings);
/// Accepts numbers from low to high, and nothing else (CLI::Range accepts NaN).
CLI::Validator number_in(double low, double high);
/// Accepts whole numbers from low to high in decimal digits, and nothing else: no leading zeros, which CLI11 reads as
/// octal numbers.
CLI::Validator whole_number_in(std::int64_t low, std::int64_t high);
/// The largest number of a cell or vertex.
inline constexpr std::int64_t kMostIndex = std::numeric_limits<Index>::max();
/// The options of a verb that have a value, given or default, by long name; a list for several values.
Json options_in_force(const CLI::App& verb);
/// Returns those options that affect the result, without those on how a run is reported, limited, or stored. Files
/// other than reports record these, so that their bytes are the same for any number of threads and for a resumed run.
Json options_of_result(const CLI::App& verb);

/// Identifies a run by its version, verb, inputs (name and fingerprint), and those options that affect the result of
/// the fit.
RunIdentity run_identity(const CLI::App& verb, const std::vector<std::pair<std::string, std::string>>& inputs);

}  // namespace subvol::cli
