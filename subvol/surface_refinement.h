// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/boundary_rules.h"
#include "subvol/row_assembly.h"
#include "subvol/surface_topology.h"

#include <span>

namespace subvol {

/// Where the rows of a refinement go: surface vertex v is column columns[v], and every weight is scaled.
struct RowTarget {
  BoundaryRule rule;
  std::span<const Index> columns;
  RowBuilder& row;
  double scale = 1;
};

/// Adds the child of face f (its centroid), of edge e, of vertex v.
void add_face_child(const SurfaceTopology& surface, Index f, const RowTarget& target);
void add_edge_child(const SurfaceTopology& surface, Index e, const RowTarget& target);
void add_vertex_child(const SurfaceTopology& surface, Index v, const RowTarget& target);

/// The rule of vertex v with its sharpnesses; crease_ends count edges from surface.vertex_corners[v].
VertexWeights vertex_weights_at(const SurfaceTopology& surface, Index v, BoundaryRule rule);

/// Rows of all children [vertices][edges][faces] by `columns` of `num_cols` (ascending, one per surface vertex).
SparseMap refinement_rows(const SurfaceTopology& surface, BoundaryRule rule, std::span<const Index> columns,
                          std::size_t num_cols);

/// The refined surface: one quad per corner, in order, (vertex, edge out, face, edge in). Sharpnesses carried.
SurfaceTopology refined_topology(const SurfaceTopology& surface);

}  // namespace subvol
