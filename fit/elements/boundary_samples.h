// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/elements/high_order_mesh.h"
#include "subvol/mesh/feature_tags.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace subvol {

/// The boundary of a high-order mesh as a grid of samples and the triangles between them, S~ of the surface energies.
///
///   quad      intervals^2 quads, each cut into two triangles       triangle   intervals^2 triangles
///
/// Vertices and edges have their samples once: the triangles are as closed as the boundary, and oriented like it.
struct BoundarySamples {
  std::vector<CellPoint> points;  ///< where the samples are, each in one of the cells that have it
  SparseMap positions;            ///< nodes -> samples
  std::vector<std::array<Index, 3>> triangles;
  std::vector<Index> triangle_faces;             ///< the boundary face of each, as MeshTopology numbers it
  std::vector<std::uint8_t> at_edges;            ///< of each: whether a corner is on an edge of its face
  std::vector<std::array<Index, 2>> crease_edges;///< `intervals` for each crease, in their order, from v0 to v1
};

/// intervals  between samples along every edge, >= 1; points_for_order(p) - 1 or more for order p.
/// creases    boundary edges of the mesh (`VolumeMesh::tags`).
/// InputError: intervals < 1, a crease that is no edge of the boundary.
BoundarySamples make_boundary_samples(const ElementSpace& space, int intervals,
                                      std::span<const CreaseEdge> creases = {});

/// The same of any faces of the mesh, inside or on its boundary. Triangles run as `MeshTopology::face` does.
///
/// edges  of these faces, as MeshTopology numbers them: `intervals` `crease_edges` for each, from its smaller vertex.
/// InputError: intervals < 1, a number out of range, an edge of none of the faces.
BoundarySamples make_face_samples(const ElementSpace& space, std::span<const Index> faces, int intervals,
                                  std::span<const Index> edges = {});

}  // namespace subvol
