// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/subdivision/boundary_rules.h"
#include "subvol/subdivision/row_assembly.h"
#include "subvol/surface/surface_topology.h"

#include <span>

namespace subvol {

/// Target of the rows of a refinement: surface vertex v is column columns[v], and every weight is multiplied by
/// `scale`.
struct RowTarget {
  BoundaryRule rule;
  std::span<const Index> columns;
  RowBuilder& row;
  double scale = 1;
};

/// Add the row of the child of face f (its centroid), of edge e, or of vertex v.
void add_face_child(const SurfaceTopology& surface, Index f, const RowTarget& target);
void add_edge_child(const SurfaceTopology& surface, Index e, const RowTarget& target);
void add_vertex_child(const SurfaceTopology& surface, Index v, const RowTarget& target);

/// Returns the weights of vertex v for its sharpnesses; crease_ends count edges from surface.vertex_corners[v].
VertexWeights vertex_weights_at(const SurfaceTopology& surface, Index v, BoundaryRule rule);

/// Returns the rows of all children [vertices][edges][faces].
///
/// columns  column of each surface vertex, ascending, below num_cols.
SparseMap refinement_rows(const SurfaceTopology& surface, BoundaryRule rule, std::span<const Index> columns,
                          std::size_t num_cols);

/// Returns the refined surface: one quad per corner, in order, with the corners (vertex, edge out, face, edge in) and
/// the sharpnesses of `child_sharpness`.
///
/// Works on open pieces, too (see `surface_piece`): sides on the border get no twin.
SurfaceTopology refined_topology(const SurfaceTopology& surface);

/// Returns the points of all children [vertices][edges][faces] by the Catmull-Clark rules, as `refinement_rows` would
/// give them, without building the rows.
///
/// surface  may be an open piece: the children of border vertices and border edges are then meaningless (zero).
/// points   one per surface vertex.
std::vector<Vec3> refined_points(const SurfaceTopology& surface, std::span<const Vec3> points);

/// Some faces of a surface and all that share a vertex with them, as an open surface with its own numbering.
struct SurfacePiece {
  SurfaceTopology topology;      ///< border edges have one corner, whose twin is kNoIndex
  std::vector<Index> vertices;   ///< vertex of the whole surface for each vertex of the piece
};

/// Cuts chosen faces and all that share a vertex with them out of a surface.
///
/// faces  the chosen faces: they come first, in this order, and keep their first corners. None of their vertices may
///        lie on a border.
SurfacePiece surface_piece(const SurfaceTopology& surface, std::span<const Index> faces);

}  // namespace subvol
