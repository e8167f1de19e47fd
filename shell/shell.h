// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/quality/corner_quality.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/fit/stages/fit_report.h"
#include "subvol/fit/stages/solve_control.h"
#include "subvol/shell/border_planes.h"
#include "subvol/shell/shell_check.h"
#include "subvol/shell/shell_layers.h"

#include <vector>

namespace subvol {

/// Largest number of steps of a solve, if the options state none.
inline constexpr int kDefaultShellIterations = 60;

/// Side of the surface on which layers grow.
enum class ShellSide { outward, inward, both };

/// Options of `make_shell`. Its solves take up to kDefaultShellIterations steps if `control` states no limit.
struct ShellOptions {
  double thickness = 0;                  ///< of each side, in the surface's unit, > 0; see also `vertex_thickness`
  std::vector<double> vertex_thickness;  ///< thickness at each vertex, > 0; empty: `thickness` everywhere
  ShellSide side = ShellSide::outward;   ///< outward: in the direction of the faces' normals
  int layers = 1;                        ///< on each side, >= 1
  double growth = 1;     ///< ratio of each layer's thickness to that of the next one nearer the surface, > 0
  bool optimize = true;  ///< false: straight columns without a solve
  /// Lets the surface's own vertices slide along it if that helps the cells; those of its border and tags stay fixed.
  bool free_surface = false;
  FeatureTags tags;  ///< tags of the surface, repeated on the outer sheets
  /// Planes in which columns on the border stay; `without_faces` returns those of patches that were left out. The flat
  /// parts of the rest of the border are found (`flat_border_planes`).
  std::vector<BorderPlane> border_planes;
  /// Numbers of the surface's vertices and faces for messages; empty: their own.
  std::vector<Index> vertex_numbers, face_numbers;
  SolveControl control{};
};

/// A shell and its properties. Thicknesses are per strand (`shell_layers.h`), in the surface's unit; a side without
/// layers has thickness 0.
struct ShellResult {
  ShellLayers layers;
  /// Layer by layer; references number the layers, from 1 for the innermost; face groups are those of `shell_groups`.
  VolumeMesh mesh;
  std::vector<double> asked;      ///< the requested thickness
  std::vector<double> limited;    ///< the thickness that there is room for, used in the cells' references
  std::vector<double> achieved;   ///< distance between a column's end and its surface vertex
  std::vector<double> clearance;  ///< distance between a column's end and the whole given surface
  /// Largest distance of the sheet's vertices from the given surface, if they were free.
  double surface_distance_max = 0;
  QualityReport quality;           ///< relative to `shell_reference(layers, limited)`
  CornerQuality corner_quality;    ///< at the corners of the linear cells, as other programs measure
  double growth = 1;               ///< that of the options
  double border_distance_max = 0;  ///< largest distance of a column's end from the planes in which it stays
  ShellFailures failures;          ///< for all sheets; faces are numbered as in `sheet_polygons` of all sheets
  FitReport report;
};

/// Grows layers of hexes and prisms on a surface (paper: section 4.4).
///
/// Columns start straight, along directions that see the front of all faces around their vertex, as far as cells stay
/// certified and sheets stay apart. Then
///
///   E(x) = mean over cells and their corners of e(F),  F = dx/du A^-1
///
/// is minimized. e is Hencky's energy (`distortion.h`), and A is the polygon that a cell stands on, with the thickness
/// of its layer (`shell_reference`). The surface's own vertices stay fixed or, if they are free, are drawn to the
/// surface by `ClosestPointEnergy`; on real surfaces they leave it by at most a tenth of the thickness
/// (`surface_distance_max`). Energies of single cells do not keep sheets apart: if faces intersect afterwards, the
/// thickness aimed at is lowered there, with a bounded slope, and the solve is repeated. Whatever still intersects in
/// the end is moved back toward the straight columns.
///
/// Where the border of the surface is flat, layers end in its plane: the columns of its vertices stay in the plane
/// through them, unless no direction in the plane sees the front of the faces there well (`layers.planes`).
///
/// returns  for every surface that is not rejected, a shell with certified cells and sheets that do not intersect,
///          except for rounding if the caller's coordinates are much larger than the surface; `failures` is decisive.
///          Only the report if the caller cancels before there is a shell.
/// InputError: options out of range; layers that vanish beside the surface (`require_visible_layers`); whatever
/// `make_layers` rejects; a surface that intersects itself; vertices from which no direction sees the front of all
/// adjacent faces, or on which not even a very thin layer fits. Messages tell how many there are, and the coordinates
/// of the first ten. Same bits for any number of threads.
ShellResult make_shell(const PolygonMesh& surface, const ShellOptions& options);

}  // namespace subvol
