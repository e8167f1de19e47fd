// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/templates/template_edit.h"

#include "subvol/mesh/features.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/mesh/mesh_topology.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <vector>

namespace subvol::internal {

bool corners_positive(const VolumeMesh& mesh, std::size_t cell) {
  const CellTopology& topology = cell_topology(mesh.kinds[cell]);
  const auto corners = mesh.cell(cell);
  for (int i = 0; i < topology.num_trivalent; ++i) {
    const Vec3& x = mesh.positions[corners[i]];
    const auto edge = [&](int n) -> Vec3 { return mesh.positions[corners[topology.corner_neighbors[i][n]]] - x; };
    if (!(edge(0).cross(edge(1)).dot(edge(2)) > 0)) return false;
  }
  return true;
}

void normalize_tags(FeatureTags& tags) {
  std::erase_if(tags.creases, [](const CreaseEdge& c) { return c.v0 == c.v1; });
  for (CreaseEdge& c : tags.creases)
    if (c.v0 > c.v1) std::swap(c.v0, c.v1);
  tags = merge_tags(tags, {});
}

void drop_lost_tags(VolumeMesh& mesh) {
  if (mesh.tags.empty()) return;
  const MeshTopology topology(mesh);
  const InterfaceMarks interfaces = mark_interfaces(topology, find_interfaces(mesh, topology));
  std::erase_if(mesh.tags.creases, [&](const CreaseEdge& c) {
    const Index e = topology.find_edge(c.v0, c.v1);
    return e == kNoIndex || (!topology.is_boundary_edge(e) && !interfaces.has_edge(e));
  });
  std::erase_if(mesh.tags.corners, [&](const CornerVertex& c) {
    return !topology.is_boundary_vertex(c.vertex) && !interfaces.has_vertex(c.vertex);
  });
}

VolumeMesh kept_cells(const VolumeMesh& mesh, std::span<const char> kept) {
  VolumeMesh result;
  std::vector<Index> number(mesh.num_vertices(), kNoIndex);
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    if (kept[c])
      for (Index v : mesh.cell(c)) number[v] = 0;
  for (std::size_t v = 0; v < number.size(); ++v)
    if (number[v] != kNoIndex) {
      number[v] = static_cast<Index>(result.positions.size());
      result.positions.push_back(mesh.positions[v]);
    }
  std::vector<Index> corners;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    if (!kept[c]) continue;
    corners.clear();
    for (Index v : mesh.cell(c)) corners.push_back(number[v]);
    result.add_cell(mesh.kinds[c], corners);
    if (!mesh.references.empty()) result.references.push_back(mesh.references[c]);
  }
  for (const CreaseEdge& c : mesh.tags.creases)
    if (number[c.v0] != kNoIndex && number[c.v1] != kNoIndex)
      result.tags.creases.push_back({number[c.v0], number[c.v1], c.sharpness});
  for (const CornerVertex& c : mesh.tags.corners)
    if (number[c.vertex] != kNoIndex) result.tags.corners.push_back({number[c.vertex], c.sharpness});
  drop_lost_tags(result);
  result.regions = mesh.regions;
  if (!mesh.face_groups.empty())
    result.face_groups = groups_of_faces(renumbered(mesh.face_groups, number), MeshTopology(result));
  return result;
}

}  // namespace subvol::internal
