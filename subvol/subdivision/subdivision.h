// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"
#include "subvol/subdivision/boundary_rules.h"
#include "subvol/subdivision/sparse_map.h"

namespace subvol {

/// One refinement: V_fine = S V_control (paper: Eq. 10).
///
/// Every (cell, corner) becomes one hex: a tet 4, a prism 6, a hex 8; its vertex 0 is the corner and it is oriented as
/// its cell. Child vertices are ordered [control vertices][edges][faces][cells] by `MeshTopology` numbers, child cells
/// by (cell, corner); references are inherited.
///
/// Interior rows average the centroids of the linearly split cells around each child (tricubic B-spline volumes on
/// lattices). Boundary rows depend on the boundary alone and equal OpenSubdiv's to rounding (uniform creasing,
/// sharpness in single precision). Next to creases of two or more cells, interior rows keep the faces that leave the
/// crease apart, so that cells around reflex creases do not invert (see crease_sheets.h); this changes no boundary row.
/// Not guaranteed positive all the same: where the boundary itself folds or flattens cells, see `audit`.
struct SubdivisionLevel {
  SparseMap matrix;  ///< S: num fine vertices x num control vertices; rows sum to 1
  VolumeMesh fine;   ///< the refined mesh: all hexes, positions = S * control positions, tags carried
};

/// Refines once. The mesh must pass `validate` but for `unused_vertex` and `inverted_cell`; else InputError.
///
/// Unused vertices stay where they are. Tags are halved along: child edges of a crease have its sharpness less 1,
/// infinite ones stay infinite, those that reach 0 are dropped. Cost: linear, about 0.2 microseconds per fine cell.
SubdivisionLevel subdivide(const VolumeMesh& control, BoundaryRule rule = BoundaryRule::catmull_clark);

/// S alone. InputError: as `subdivide`.
SparseMap subdivision_matrix(const VolumeMesh& control, BoundaryRule rule = BoundaryRule::catmull_clark);

/// The multi-linear split alone, with the same rows and columns as S: edge, face and cell midpoints; control vertices
/// stay. It keeps valid whatever is valid with multi-linear cells. InputError: as `subdivide`.
SparseMap linear_split(const VolumeMesh& control);

}  // namespace subvol
