// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/run_options.h"

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace subvol::cli {

/// What of a result goes to a file: `FILE`, or `PART:FILE`.
enum class Part {
  result,    ///< the finest mesh, or its surface
  cage,      ///< the control mesh
  cutaway,   ///< a scene of the cells inside
  animation  ///< a scene of the surface as the fit went
};

/// One -o: what to write, and where.
struct Output {
  Part part = Part::result;
  std::filesystem::path path;
  std::string extension;        ///< lower case, with its dot
  bool is_new = false;          ///< there was no such file before the work
  bool is_volume() const;       ///< a format that holds cells
  bool is_scene() const;        ///< a format that holds scenes
};

/// Whether curved cells are written to it as polynomials (.vtu, .msh).
bool holds_polynomial_cells(const Output& output);

/// Formats that can be written, for help and messages.
std::string output_formats();

/// Reads the -o options and checks, before any work, that each, the report and the checkpoint could be written.
///
/// parts  that there are besides the result.
/// UsageError: an unknown extension, a file named twice (by links, too), a part that there is not or that needs another
/// format, an existing file without --force, a checkpoint that is a pipe. IoError: a folder that is not there
/// or cannot be written to, a name that is too long.
std::vector<Output> checked_outputs(const RunOptions& options, const std::vector<Part>& parts);

/// Checks that one file can be written. UsageError: a folder, an existing file without `force`. IoError: no place to
/// write.
void require_free(const std::filesystem::path& file, bool force);

/// write(output) for each of those that `which` names, or all. One that cannot be written (IoError, InputError) does
/// not cost the others: it is said to stderr and in what is returned, and taken off the list. Nor is one written over a
/// file that somebody has made since it was found that there is none.
std::vector<std::string> write_each(std::vector<Output>& outputs, const std::function<void(const Output&)>& write,
                                    const std::function<bool(const Output&)>& which = {});
/// IoError that tells of these once more; nothing where there are none.
void require_all_written(const std::vector<std::string>& failures);

/// The warnings of a report: those of the work, and which outputs could not be written.
Json warnings_json(const std::vector<std::string>& warnings, const std::vector<std::string>& failures);

/// The file names, as the report lists them.
Json output_names(const std::vector<Output>& outputs);

}  // namespace subvol::cli
