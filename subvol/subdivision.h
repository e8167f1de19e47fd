// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/sparse_map.h"
#include "subvol/volume_mesh.h"

namespace subvol {

/// How boundary vertices move when a mesh is refined.
enum class BoundaryRule {
  catmull_clark,  ///< rows equal OpenSubdiv's: the boundary is an artist's subdivision surface (default)
  averaging       ///< the paper's plain multi-linear averaging of the boundary quads
};

/// One refinement: V_fine = S V_control (paper: Eq. 10).
///
/// Every (cell, corner) becomes one hex: a tet 4, a prism 6, a hex 8. Child vertices are ordered
/// [control vertices][edges][faces][cells] by `MeshTopology` numbers.
struct SubdivisionLevel {
  SparseMap matrix;        ///< S: num fine vertices x num control vertices; rows sum to 1
  SparseMap linear_split;  ///< the multi-linear split alone: edge, face and cell midpoints; control vertices stay
  VolumeMesh fine;         ///< the refined mesh: all hexes, positions = S * control positions, tags carried
};

/// Refines once. The mesh must pass `validate` but for `unused_vertex` and `inverted_cell`; else InputError.
SubdivisionLevel subdivide(const VolumeMesh& control, BoundaryRule rule = BoundaryRule::catmull_clark);

}  // namespace subvol
