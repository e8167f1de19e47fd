// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/subdivision/boundary_rules.h"
#include "subvol/subdivision/row_assembly.h"
#include "subvol/surface/surface_topology.h"

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
///
/// Works on open pieces as well (see `surface_piece`): sides of border faces get no twin.
SurfaceTopology refined_topology(const SurfaceTopology& surface);

/// Points of all children [vertices][edges][faces] by the Catmull-Clark rules: `refinement_rows` applied, but without
/// the rows.
///
/// surface  may be an open piece: children of border vertices and border edges are then meaningless.
/// points   one per surface vertex.
std::vector<Vec3> refined_points(const SurfaceTopology& surface, std::span<const Vec3> points);

/// Some faces of a surface and all that share a vertex with them, as an open surface with its own numbers.
struct SurfacePiece {
  SurfaceTopology topology;      ///< border edges have one corner, whose twin is kNoIndex
  std::vector<Index> vertices;   ///< of the whole surface, for each vertex of the piece
};

/// faces  chosen faces: they come first, in this order, and keep their first corners. None of their vertices may lie on
///        a border.
SurfacePiece surface_piece(const SurfaceTopology& surface, std::span<const Index> faces);

}  // namespace subvol
