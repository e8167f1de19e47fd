// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/quality/quality.h"
#include "fit/stages/fit_report.h"
#include "shell/shell_check.h"
#include "shell/shell_layers.h"

#include <functional>
#include <vector>

namespace subvol {

enum class ShellSide { outward, inward, both };

struct ShellOptions {
  double thickness = 0;                  ///< of each side, in the surface's unit, > 0; or `vertex_thickness`
  std::vector<double> vertex_thickness;  ///< the same for each vertex, > 0; empty: `thickness` everywhere
  ShellSide side = ShellSide::outward;   ///< outward: where the faces' normals point
  int layers = 1;                        ///< on each side, >= 1
  double growth = 1;                     ///< thickness of a layer against that of the one nearer the surface, > 0
  bool optimize = true;                  ///< false: straight columns, no solve
  /// Lets the surface's own vertices slide along it where that serves the cells; those of its border and tags stay.
  bool free_surface = false;
  FeatureTags tags;                      ///< of the surface; repeated on the outer sheets
  int max_iterations = 0;                ///< per solve; 0: the default
  double time_limit_seconds = 0;         ///< 0: none
  std::function<bool(const FitProgress&)> progress;  ///< returns false to cancel; empty: none
  std::function<bool()> cancelled;  ///< asked within steps too, from the calling thread; true cancels; empty: none
};

/// A shell and what is true of it. Thicknesses are per strand (`shell_layers.h`), in the surface's unit; those of a
/// side without layers are 0.
struct ShellResult {
  ShellLayers layers;
  VolumeMesh mesh;                 ///< layer by layer; references number the layers from the innermost, from 1
  std::vector<double> asked;
  std::vector<double> limited;     ///< what there is room for: what the cells' references have
  std::vector<double> achieved;    ///< distance of a column's end from its surface vertex
  std::vector<double> clearance;   ///< distance of a column's end from the whole surface given
  double surface_distance_max = 0; ///< of the surface's vertices, where they were free, from where it was
  QualityReport quality;           ///< against `shell_reference(layers, limited)`
  ShellFailures failures;          ///< of all sheets; faces as in `sheet_polygons` of all sheets
  FitReport report;
};

/// Grows layers of hexes and prisms on a surface (paper: section 4.4).
///
/// Columns start straight, along directions that see all faces around their vertex, as far as cells stay certified and
/// sheets apart. Then
///
///   E(x) = mean over cells and their corners of e(F),  F = dx/du A^-1
///
/// is minimised, e being Hencky's energy (`distortion.h`) and A the polygon a cell stands on, as thick as its layer
/// (`shell_reference`); the surface's own vertices stay, or, where they are free, are drawn to it by
/// `ClosestPointEnergy` (on real surfaces they leave it by a tenth of the thickness at most, `surface_distance_max`).
/// Energies of single cells do not keep sheets apart: where faces meet afterwards the thickness asked for is lowered,
/// with a bounded slope, and the solve repeated; what still meets in the end goes back towards the straight columns.
///
/// returns  a shell whose cells are certified and whose sheets do not meet, for every surface that is not refused, but
///          for rounding when the caller's coordinates are much larger than the surface; `failures` has the last word.
///          Nothing but the report where the caller cancelled before there was a shell.
/// InputError: options out of range; what `make_layers` refuses; a surface that meets itself; vertices from which not
/// all faces around are seen from their front, or on which not even a very thin layer fits. Messages name the first of
/// them. Same bits for any number of threads.
ShellResult make_shell(const PolygonMesh& surface, const ShellOptions& options);

}  // namespace subvol
