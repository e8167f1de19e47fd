// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/boundary_rules.h"
#include "subvol/row_assembly.h"
#include "subvol/surface_topology.h"

#include <span>

namespace subvol {

/// Adds weight times the centroid of face f. Columns are columns[v] of surface vertices v (all rows below too).
void add_face_child(const SurfaceTopology& surface, Index f, double weight, std::span<const Index> columns,
                    RowBuilder& row);
/// Adds the child of edge e.
void add_edge_child(const SurfaceTopology& surface, Index e, BoundaryRule rule, std::span<const Index> columns,
                    RowBuilder& row);
/// Adds the child of vertex v.
void add_vertex_child(const SurfaceTopology& surface, Index v, BoundaryRule rule, std::span<const Index> columns,
                      RowBuilder& row);

/// The rule of vertex v with its sharpnesses; crease_ends count edges from surface.vertex_corners[v].
VertexWeights vertex_weights_at(const SurfaceTopology& surface, Index v, BoundaryRule rule);

/// One refinement of a surface: child vertices [vertices][edges][faces], child quads by (face, corner), each
/// starting at its parent's corner. Sharpnesses carried.
struct SurfaceLevel {
  SparseMap matrix;  ///< children x surface vertices
  SurfaceTopology fine;
};

SurfaceLevel refine_surface(const SurfaceTopology& surface, BoundaryRule rule = BoundaryRule::catmull_clark);

}  // namespace subvol
