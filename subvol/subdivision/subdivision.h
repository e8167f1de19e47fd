// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"
#include "subvol/subdivision/boundary_rule.h"
#include "subvol/subdivision/sparse_map.h"

namespace subvol {

/// One refinement: V_fine = S V_control (paper: Eq. 10).
///
/// Every corner of a cell becomes one hex: a tet gives 4, a prism 6, a hex 8. Vertex 0 of the hex is the corner, and
/// the hex is oriented like its cell. Child vertices are ordered [control vertices][edges][faces][cells] by
/// `MeshTopology` numbers, child cells by (cell, corner); references are inherited.
///
/// Interior rows average the centroids of the linearly split cells around each child (tricubic B-spline volumes on
/// lattices). Boundary rows depend on the boundary alone and equal OpenSubdiv's to rounding (uniform creasing,
/// sharpness in single precision). Interfaces between regions (cells of different references) are sheets like the
/// boundary: their rows depend on the interface alone, by the same rules; the feature curves where sheets meet are
/// infinitely sharp creases, and the points where these meet are corners (sheets.h). Next to creases of two or more
/// cells, interior rows decouple the faces that leave the crease, so that cells around reflex creases do not invert
/// (see crease_sheets.h); this changes no boundary row.
/// Cells may still invert if the boundary itself folds or flattens them; see `audit`.
struct SubdivisionLevel {
  SparseMap matrix;  ///< S: num fine vertices x num control vertices; rows sum to 1
  VolumeMesh fine;   ///< the refined mesh: all hexes, positions = S * control positions, tags carried
};

/// Refines once. The mesh must pass `validate` except for `unused_vertex` and `inverted_cell`.
///
/// Unused vertices stay where they are. The two child edges of a crease have its sharpness less 1; infinite ones stay
/// infinite, and those that reach 0 are dropped. InputError: no cells or too many, arrays of inconsistent length,
/// vertex numbers out of range, pyramids, and as `MeshTopology` and `tagged_boundary`. Cost: linear, about 0.2
/// microseconds per fine cell.
SubdivisionLevel subdivide(const VolumeMesh& control, BoundaryRule rule = BoundaryRule::catmull_clark);

/// Returns S alone. InputError: as `subdivide`.
SparseMap subdivision_matrix(const VolumeMesh& control, BoundaryRule rule = BoundaryRule::catmull_clark);

/// Returns the multi-linear split alone, with the same rows and columns as S: children are the midpoints of edges,
/// faces and cells, and control vertices stay. A mesh that is valid with multi-linear cells stays valid. InputError: as
/// `subdivide`.
SparseMap linear_split(const VolumeMesh& control);

}  // namespace subvol
