// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/pads.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/surface/surface_topology.h"

#include <cstdint>
#include <span>
#include <vector>

namespace subvol::internal {

/// The boundary of a patched mesh, vertex by vertex.
struct PatchFans {
  /// One face at a vertex and the edge before it, counter-clockwise seen from outside.
  struct Place {
    Index face;    ///< place in `boundary_faces()`
    Index edge;    ///< of the surface
    Index corner;  ///< of the surface: that of the face at the vertex
  };

  MeshTopology topology;
  BoundarySurface boundary;
  std::vector<Index> path_of_edge;  ///< index into `PatchedMesh::paths` for each surface edge; kNoIndex: none

  /// InputError: a boundary that is not a manifold, a path that leaves it, patches for another number of faces.
  explicit PatchFans(const PatchedMesh& patched);

  const SurfaceTopology& surface() const { return boundary.topology; }
  /// Writes the faces around a surface vertex to `fan`, starting anywhere.
  void fan_at(Index surface_vertex, std::vector<Place>& fan) const;
  /// Returns the two faces at a surface edge.
  std::array<Index, 2> faces_at(Index edge) const;
  /// Returns the volume vertex at the other end of the edge of a corner.
  Index other_end(Index corner) const { return boundary.vertices[surface().corner_vertices[surface().next(corner)]]; }
};

/// Returns why a set of patches, given by a mark for each, cannot be padded, at the vertex of the smallest number.
/// PadProblem::inverted is not looked for.
std::optional<PadRefusal> topological_refusal(const PatchFans& fans, const PatchedMesh& patched,
                                              std::span<const std::uint8_t> is_padded);

/// State of a set of patches at one vertex.
struct FanState {
  bool any = false;     ///< some face is padded
  int changes = 0;      ///< number of edges between a padded and an unpadded face
  int free_paths = 0;   ///< number of edges of paths between unpadded faces
  bool shared = false;  ///< some unpadded face is shared
  std::optional<PadProblem> problem() const;
};
FanState fan_state(const PatchFans& fans, const PatchedMesh& patched, std::span<const PatchFans::Place> fan,
                   std::span<const std::uint8_t> is_padded);

}  // namespace subvol::internal
