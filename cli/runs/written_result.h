// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// What counts is what is on the disk: a result is read back and checked as its file holds it, and verdicts and reports
// are of that.

#include "cli/runs/outputs.h"
#include "fit/elements/high_order_mesh.h"
#include "fit/mesh_check.h"
#include "fit/stages/fit_report.h"
#include "subvol/mesh/volume_mesh.h"

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace subvol::cli {

/// The cells that were written: of the first .mesh that can be read again, else of the first .vtk. They have the file's
/// numbers: a .mesh has a section for each kind. None where there is no such file: what holds the cells in another
/// format was compared with them when it was written.
///
/// outputs  what was written, of which those of `part` are looked at. InputError: as `read_volume_mesh`.
std::optional<VolumeMesh> written_cells(std::span<const Output> outputs, Part part = Part::result);
/// The same of curved cells: of the first .vtu.
std::optional<HighOrderMesh> written_curved_cells(std::span<const Output> outputs);

/// What to tell of linear cells that were written in the place of curved ones, of which `check` is: they follow those
/// only as far as they are small. None where they are valid.
std::vector<std::string> linear_cells_warnings(const MeshCheck& check);

/// The polynomial cells of a .vtu or .msh, where they are not the curved cells themselves (`file_cells`): this is what
/// other programs compute with.
struct PolynomialCells {
  std::string file;
  double distance_percent = 0;  ///< from the curved cells, at most; of the diagonal of the box of the vertices
  bool is_close = false;        ///< whether that is within --map-tolerance
  MeshCheck check;
};
/// Checks such cells of all outputs, check(polynomials) for each.
std::vector<PolynomialCells> check_polynomial_cells(std::span<const Output> outputs, const HighOrderMesh& mesh,
                                                    double map_tolerance_percent,
                                                    const std::function<MeshCheck(const HighOrderMesh&)>& check);
/// Warnings about cells that are not close to the map or not valid.
std::vector<std::string> polynomial_cells_warnings(const PolynomialCells& cells);
Json polynomial_cells_json(std::span<const PolynomialCells> all);
/// kDone; kFailed if some are not valid; kNotConverged if some are not close.
int polynomial_cells_status(std::span<const PolynomialCells> all);

/// Writes a mesh that was made, write(output) for each, and tells on stderr and in the report what `check_mesh` finds
/// in what was written.
///
/// details  what the report is to say before that. warnings: are told in both places.
/// returns  kDone, or kFailed where the mesh is not valid.
/// InputError, before anything is written: as `require_extent`. IoError, in the end: an output could not be written.
int write_checked(const RunOptions& run, std::vector<Output> outputs, const VolumeMesh& mesh,
                  const std::function<void(const Output&)>& write, const std::vector<std::string>& warnings,
                  const Json& details);

/// Distances that were asked for, in per cent of the target's diagonal. None: whatever it is will do.
struct DistancesAsked {
  std::optional<double> mean_percent{}, max_percent{};
};
/// Holds a fit that says it converged to what was found in its file: where that is farther off than was asked for, the
/// tolerance was missed, and the explanation says by how much.
void hold_to(const DistancesAsked& asked, const MeshCheck& found, FitReport& report);
/// The same of one distance. which: what it is called, such as "the mean". most_percent: none holds to nothing.
void hold_to(std::optional<double> most_percent, const char* which, double percent, FitReport& report);

}  // namespace subvol::cli
