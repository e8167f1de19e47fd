// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <map>
#include <utility>
#include <vector>

namespace subvol::internal {

/// Makes a mesh of triangles whose corners come one after the other. Equal positions become one vertex, because formats
/// repeat a vertex in every triangle (STL), or wherever its normal differs (glTF).
class TriangleWelder {
 public:
  /// Adds a corner; three make a triangle.
  void add(const Vec3& position) {
    // + 0.0 turns -0.0 into 0.0.
    const std::array<double, 3> key = {position[0] + 0.0, position[1] + 0.0, position[2] + 0.0};
    const auto [it, is_new] = vertices_.try_emplace(key, static_cast<Index>(mesh_.positions.size()));
    if (is_new) mesh_.positions.push_back(position);
    mesh_.face_vertices.push_back(it->second);
    if (mesh_.face_vertices.size() % 3 == 0) mesh_.face_offsets.push_back(mesh_.face_vertices.size());
  }
  /// Puts the triangle that was added last into a group.
  void set_group(Index group) { mesh_.face_groups.of_face.push_back(group); }
  /// Names the groups of the triangles.
  void name_groups(std::vector<Group> groups) { mesh_.face_groups.groups = std::move(groups); }
  void drop_groups() { mesh_.face_groups = {}; }
  bool is_empty() const { return mesh_.face_vertices.empty(); }
  PolygonMesh take() { return std::move(mesh_); }

 private:
  std::map<std::array<double, 3>, Index> vertices_;
  PolygonMesh mesh_;
};

}  // namespace subvol::internal
