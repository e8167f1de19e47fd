// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// The files on the disk are what counts: a result is read back and checked as its file holds it, and verdicts and
// reports refer to that.

#include "cli/runs/outputs.h"
#include "subvol/fit/elements/high_order_mesh.h"
#include "subvol/fit/mesh_check.h"
#include "subvol/fit/stages/fit_report.h"
#include "subvol/mesh/volume_mesh.h"

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace subvol::cli {

/// The cells that were written: those of the first .mesh that can be read back, else of the first .vtk. They have the
/// file's numbers: a .mesh has one section for each kind. None if there is no such file: other formats were compared
/// with the cells when they were written.
///
/// outputs  the files that were written; only those of `part` are considered. InputError: as `read_volume_mesh`.
std::optional<VolumeMesh> written_cells(std::span<const Output> outputs, Part part = Part::result);
/// The curved cells that were written: those of the first .vtu.
std::optional<HighOrderMesh> written_curved_cells(std::span<const Output> outputs);

/// Warnings about linear cells that were written in place of curved ones, given their check: they follow the curved
/// cells only as far as they are small. None if they are valid.
std::vector<std::string> linear_cells_warnings(const MeshCheck& check);

/// The polynomial cells of a .vtu or .msh, if they differ from the curved cells (`file_cells`): other programs compute
/// with these.
struct PolynomialCells {
  std::string file;
  /// Distance from the curved cells, in percent of the diagonal of the vertices' box: an upper bound, which may be
  /// hundreds of times too large, and the largest one at points on a grid.
  double distance_percent = 0, sampled_percent = 0;
  bool is_close = false;  ///< true if that is within --map-tolerance
  MeshCheck check;
};
/// Checks such cells of all outputs, with check(polynomials) for each.
std::vector<PolynomialCells> check_polynomial_cells(std::span<const Output> outputs, const HighOrderMesh& mesh,
                                                    double map_tolerance_percent,
                                                    const std::function<MeshCheck(const HighOrderMesh&)>& check);
/// Warnings about cells that are not close to the map or not valid.
std::vector<std::string> polynomial_cells_warnings(const PolynomialCells& cells);
Json polynomial_cells_json(std::span<const PolynomialCells> all);
/// kDone; kFailed if some are not valid; kNotConverged if some are not close.
int polynomial_cells_status(std::span<const PolynomialCells> all);

/// Writes a newly made mesh, with write(output) for each output, and reports on stderr and in the report what
/// `check_mesh` finds in what was written.
///
/// details  first entries of the report. warnings: appear in both places.
/// returns  kDone, or kFailed if the mesh is not valid.
/// InputError, before anything is written: as `require_extent`. IoError, at the end: an output could not be written.
int write_checked(const RunOptions& run, std::vector<Output> outputs, const VolumeMesh& mesh,
                  const std::function<void(const Output&)>& write, const std::vector<std::string>& warnings,
                  const Json& details);

/// Requested distances, in percent of the target's diagonal. None: any distance will do.
struct DistancesAsked {
  std::optional<double> mean_percent{}, max_percent{};
};
/// Compares a fit that reports convergence with its file: if a distance there is larger than requested, the fit missed
/// the tolerance, and the explanation says by how much.
void hold_to(const DistancesAsked& asked, const MeshCheck& found, FitReport& report);
/// Does the same for one distance. which: its name, such as "the mean". most_percent: none means no requirement.
void hold_to(std::optional<double> most_percent, const char* which, double percent, FitReport& report);

/// Does the same for the least scaled Jacobian, which must be at least `least`; empty means no requirement.
void hold_to_quality(std::optional<double> least, const MeshCheck& found, FitReport& report);

/// Says how many cells have a scaled Jacobian below the quality aimed at, and where the worst one is. Empty if the
/// quality is reached (to 0.01), or is 0.
std::vector<std::string> warnings_of_quality(double aim, const MeshCheck& found);

}  // namespace subvol::cli
