// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/export/lagrange_mesh.h"
#include "subvol/mesh/face_groups.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/mesh/volume_mesh.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace subvol::internal {

/// The faces of a mesh that are in groups, each once, with their points in Gmsh's order.
struct GroupedFaces {
  std::vector<Group> groups;
  std::vector<std::uint8_t> sizes;  ///< corners of each face: 3 or 4
  std::vector<int> orders;
  std::vector<Index> cells;                 ///< first cell of each face
  std::vector<std::vector<Index>> of_face;  ///< places in `groups`, ascending
  std::vector<std::size_t> offsets{0};
  std::vector<Index> nodes;

  std::size_t num_faces() const { return sizes.size(); }
  std::span<const Index> face(std::size_t f) const {
    return std::span(nodes).subspan(offsets[f], offsets[f + 1] - offsets[f]);
  }
};

/// Returns the grouped faces that the mesh has, in the order of `MeshTopology`; normals point out of the first cell.
GroupedFaces grouped_faces(const VolumeMesh& mesh);

/// Returns the same faces with the points of Lagrange cells, each of the order of its first cell.
///
/// cells     of `lagrange_mesh` in the order `gmsh`.
/// topology  of the straight-sided mesh.
GroupedFaces grouped_faces(const LagrangeMesh& cells, const MeshTopology& topology, const VolumeFaceGroups& groups);

/// Returns the points of a triangle or quad of an order >= 1 in Gmsh's order: numbers of steps from the first corner
/// toward the second, and toward the last.
std::vector<std::array<int, 2>> gmsh_face_lattice(std::size_t num_corners, int order);

}  // namespace subvol::internal
