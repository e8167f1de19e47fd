// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/run_options.h"
#include "subvol/io/file_formats.h"

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace subvol::cli {

/// Part of a result that goes to a file: `FILE`, `PART:FILE`, or `region:NAME:FILE`.
enum class Part {
  result,     ///< the finest mesh, or its surface
  cage,       ///< the control mesh
  cutaway,    ///< a scene that shows the cells inside
  animation,  ///< the course of the fit: a scene of the surface, or a page in which the mesh can be turned
  boundary,   ///< the faces of the boundary as cells, with their groups
  region      ///< the cells of one region
};

/// One -o: the part to write, and the file.
struct Output {
  Part part = Part::result;
  std::string region{};  ///< name or number of the part's region
  std::filesystem::path path{};
  std::string extension{};  ///< lower case, with its dot
  bool is_new = false;      ///< no such file existed before the work
  /// Returns its format; of a page, one that holds nothing.
  const FileFormat& format() const;
  bool is_volume() const;  ///< true for a format that holds cells
  bool is_scene() const;   ///< true for a format that holds scenes
  bool is_page() const { return extension == ".html"; }
};

/// True if curved cells are written to it as polynomials (.vtu, .msh, .inp, .bdf, .e, .mfem, .xdmf).
bool holds_polynomial_cells(const Output& output);

/// Formats that can be written, for help and messages.
std::string output_formats();

/// Reads the -o options and checks, before any work, that the outputs, the report and the checkpoint can be written.
///
/// parts  available parts besides the result.
/// UsageError: an unknown extension, a file named twice (also by links), a part that is not available or needs another
/// format, an existing file without --force, a checkpoint that is a pipe. IoError: a folder that does not exist or
/// cannot be written to, a name that is too long.
std::vector<Output> checked_outputs(const RunOptions& options, const std::vector<Part>& parts);

/// UsageError: an -o of this text names no part and format that there are.
void require_output_kind(const std::string& text);

/// Checks that one file can be written. UsageError: a folder, an existing file without `force`. IoError: a name that is
/// too long, a folder that cannot be written to.
void require_free(const std::filesystem::path& file, bool force);

/// Calls write(output) for each output that `which` selects, or for all. A failure (IoError, InputError) does not
/// prevent the other outputs: it is printed to stderr and returned, and the output is removed from the list. A file
/// that somebody else has created since the outputs were checked is not overwritten; this counts as a failure.
std::vector<std::string> write_each(std::vector<Output>& outputs, const std::function<void(const Output&)>& write,
                                    const std::function<bool(const Output&)>& which = {});
/// Throws an IoError that summarizes the failures; does nothing if there are none.
void require_all_written(const std::vector<std::string>& failures);

/// The warnings of a report: those of the work, and the outputs that could not be written.
Json warnings_json(const std::vector<std::string>& warnings, const std::vector<std::string>& failures);

/// The file names, for the list in the report.
Json output_names(const std::vector<Output>& outputs);

}  // namespace subvol::cli
