// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/high_order_mesh.h"
#include "subvol/mesh/feature_tags.h"
#include "subvol/mesh/volume_mesh.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace subvol {

/// The boundary of a high-order mesh as a grid of samples and the triangles between them: the S~ of the surface
/// energies.
///
///   quad      intervals^2 quads, each cut into two triangles       triangle   intervals^2 triangles
///
/// Vertices and edges have their samples once, so the triangles are as closed as the boundary, and oriented like it.
struct BoundarySamples {
  std::vector<CellPoint> points;  ///< location of each sample, in one of the cells that contain it
  SparseMap positions;            ///< nodes -> samples
  std::vector<std::array<Index, 3>> triangles;
  std::vector<Index> triangle_faces;               ///< boundary face of each triangle, as MeshTopology numbers it
  std::vector<std::uint8_t> at_edges;              ///< per triangle: 1 if a corner is on an edge of its face
  std::vector<std::array<Index, 2>> crease_edges;  ///< `intervals` per crease, in their order, from v0 to v1
};

/// intervals  number of intervals along every edge, >= 1; should be points_for_order(p) - 1 or more for order p.
/// creases    boundary edges of the mesh (`VolumeMesh::tags`).
/// InputError: intervals < 1, a crease that is not an edge of the boundary.
BoundarySamples make_boundary_samples(const ElementSpace& space, int intervals,
                                      std::span<const CreaseEdge> creases = {});

/// Samples any faces of the mesh, inside or on its boundary. Triangles are oriented as `MeshTopology::face` is.
///
/// edges  edges of these faces, as MeshTopology numbers them: each gives `intervals` `crease_edges`, from its smaller
///        vertex on.
/// InputError: intervals < 1, a number out of range, an edge that belongs to none of the faces.
BoundarySamples make_face_samples(const ElementSpace& space, std::span<const Index> faces, int intervals,
                                  std::span<const Index> edges = {});

/// Samples the boundary and the interfaces between regions (cells of different references). The normals of an
/// interface's triangles point from the smaller to the larger reference. Without interfaces: as
/// `make_boundary_samples`.
///
/// mesh     the mesh that the space was made of, with its references.
/// creases  edges of the boundary or of interfaces. InputError: as above.
BoundarySamples make_sheet_samples(const ElementSpace& space, const VolumeMesh& mesh, int intervals,
                                   std::span<const CreaseEdge> creases = {});

/// Points of edges, and the segments between them: `intervals` per edge, in the order of the edges, from v0 to v1.
struct EdgeSamples {
  SparseMap positions;  ///< nodes -> points
  std::vector<std::array<Index, 2>> segments;
};

/// Samples any edges of the mesh. InputError: intervals < 1, something that is not an edge. Cost: a pass over the
/// cells.
EdgeSamples make_edge_samples(const ElementSpace& space, std::span<const CreaseEdge> edges, int intervals);

}  // namespace subvol
