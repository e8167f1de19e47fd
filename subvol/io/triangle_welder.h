// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/io/position_welder.h"
#include "subvol/surface/triangle_mesh.h"

#include <utility>
#include <vector>

namespace subvol::internal {

/// Makes a mesh of triangles whose corners come one after the other. Equal positions become one vertex
/// (PositionWelder).
class TriangleWelder {
 public:
  /// Adds a corner; three make a triangle.
  void add(const Vec3& position) {
    mesh_.face_vertices.push_back(welder_.vertex(position));
    if (mesh_.face_vertices.size() % 3 == 0) mesh_.face_offsets.push_back(mesh_.face_vertices.size());
  }
  /// Puts the triangle that was added last into a group.
  void set_group(Index group) { mesh_.face_groups.of_face.push_back(group); }
  /// Names the groups of the triangles.
  void name_groups(std::vector<Group> groups) { mesh_.face_groups.groups = std::move(groups); }
  void drop_groups() { mesh_.face_groups = {}; }
  bool is_empty() const { return mesh_.face_vertices.empty(); }
  PolygonMesh take() {
    mesh_.positions = welder_.take(mesh_.face_vertices);
    return std::move(mesh_);
  }

 private:
  PositionWelder welder_;
  PolygonMesh mesh_;
};

}  // namespace subvol::internal
