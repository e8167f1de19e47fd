// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/subdivision/boundary_rules.h"
#include "subvol/subdivision/row_assembly.h"
#include "subvol/surface/surface_topology.h"

#include <span>

namespace subvol::internal {

/// Target of the rows of a refinement: surface vertex v is column columns[v], and every weight is multiplied by
/// `scale`.
struct RowTarget {
  BoundaryRule rule;
  std::span<const Index> columns;
  RowBuilder& row;
  double scale = 1;
};

/// Visits the edges around vertex v, counter-clockwise: visit(i, edge, neighbor, face), where the face lies between
/// edges i and i + 1. At an open fan, whose first corner must be `vertex_corners[v]`, the last face is kNoIndex.
template <class Visit>
void visit_ring(const SurfaceTopology& surface, Index v, const Visit& visit) {
  const Index start = surface.vertex_corners[v];
  int i = 0;
  for (Index h = start;;) {
    visit(i++, surface.corner_edges[h], surface.corner_vertices[surface.next(h)], surface.corner_faces[h]);
    const Index after = surface.rotate(h);
    if (after == start) return;
    if (after == kNoIndex) {
      const Index last = surface.prev(h);
      visit(i, surface.corner_edges[last], surface.corner_vertices[last], kNoIndex);
      return;
    }
    h = after;
  }
}

/// Add the row of the child of face f (its centroid), of edge e, or of vertex v. Along the border of an open surface,
/// edges must be infinitely sharp: border vertices and edges move as on a crease.
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
/// Works on open surfaces and pieces (see `surface_piece`), too: sides on the border get no twin, and the corner of a
/// border vertex is the first of its fan.
SurfaceTopology refined_topology(const SurfaceTopology& surface);

/// Returns the points of all children [vertices][edges][faces] by the Catmull-Clark rules, as `refinement_rows` would
/// give them, without building the rows.
///
/// surface  may be an open piece: the children of border vertices and border edges are then meaningless (zero).
/// points   one per surface vertex.
std::vector<Vec3> refined_points(const SurfaceTopology& surface, std::span<const Vec3> points);

/// Some faces of a surface and all that share a vertex with them, as an open surface with its own numbering.
struct SurfacePiece {
  SurfaceTopology topology;     ///< border edges have one corner, whose twin is kNoIndex
  std::vector<Index> vertices;  ///< vertex of the whole surface for each vertex of the piece
};

/// Cuts chosen faces and all that share a vertex with them out of a surface.
///
/// faces  the chosen faces: they come first, in this order, and keep their first corners. None of their vertices may
///        lie on a border.
SurfacePiece surface_piece(const SurfaceTopology& surface, std::span<const Index> faces);

}  // namespace subvol::internal
