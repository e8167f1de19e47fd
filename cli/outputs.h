// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/run_options.h"

#include <filesystem>
#include <string>
#include <vector>

namespace subvol::cli {

/// One -o: what to write, and where.
struct Output {
  bool cage = false;            ///< `cage:FILE`: the control mesh instead of the finest mesh
  std::filesystem::path path;
  std::string extension;        ///< lower case, with its dot
  bool is_volume() const;       ///< a format that holds cells
};

/// Formats that can be written, for help and messages.
std::string output_formats();

/// Reads the -o options and checks, before any work, that each, the report and the checkpoint could be written.
///
/// UsageError: an unknown extension, a file named twice, `cage:` where there is none, an existing file without --force.
/// IoError: a folder that is not there or cannot be written to.
std::vector<Output> checked_outputs(const RunOptions& options, bool allow_cage);

/// Checks that one file can be written. UsageError: a folder, an existing file without `force`. IoError: no place to write.
void require_free(const std::filesystem::path& file, bool force);

/// The file names, as the report lists them.
Json output_names(const RunOptions& options);

}  // namespace subvol::cli
