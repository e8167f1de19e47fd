// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/grouped_faces.h"

#include <algorithm>
#include <array>
#include <map>
#include <utility>

namespace subvol::internal {

namespace {

using Steps = std::array<int, 2>;

/// Appends a smaller face of the given order whose first corner is `from`: corners, edges, then what is inside.
void append_lattice(std::size_t num_corners, int order, const Steps& from, std::vector<Steps>& points) {
  if (order < 0) return;
  if (order == 0) {
    points.push_back(from);
    return;
  }
  std::vector<Steps> corners{{0, 0}, {order, 0}};
  if (num_corners == 4) corners.push_back({order, order});
  corners.push_back({0, order});
  for (const Steps& corner : corners) points.push_back({from[0] + corner[0], from[1] + corner[1]});
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Steps &a = corners[k], &b = corners[(k + 1) % corners.size()];
    for (int i = 1; i < order; ++i)
      points.push_back({from[0] + a[0] + i * (b[0] - a[0]) / order, from[1] + a[1] + i * (b[1] - a[1]) / order});
  }
  append_lattice(num_corners, order - (num_corners == 3 ? 3 : 2), {from[0] + 1, from[1] + 1}, points);
}

/// Places of the points of a cell in its list, by their coordinates on the grid.
using Places = std::map<std::array<int, 3>, std::size_t>;

Places places_of(CellKind kind, int order) {
  Places places;
  const std::vector<LatticePoint> lattice = cell_lattice(kind, order, NodeOrdering::gmsh);
  for (std::size_t i = 0; i < lattice.size(); ++i) places[{lattice[i][0], lattice[i][1], lattice[i][2]}] = i;
  return places;
}

/// Appends the points of a face of a cell. corners: vertices of the face, which are points of the cell.
void append_points(CellKind kind, int order, std::span<const Index> cell, const Places& places,
                   std::span<const Index> corners, std::vector<Index>& nodes) {
  const std::vector<LatticePoint> canonical = cell_lattice(kind, 1, NodeOrdering::gmsh);
  std::vector<LatticePoint> at;  // canonical corners of the face
  for (const Index v : corners)
    for (const LatticePoint& corner : canonical)
      if (cell[places.at({order * corner[0], order * corner[1], order * corner[2]})] == v) at.push_back(corner);
  for (const Steps& steps : gmsh_face_lattice(corners.size(), order)) {
    const LatticePoint point = order * at[0] + steps[0] * (at[1] - at[0]) + steps[1] * (at.back() - at[0]);
    nodes.push_back(cell[places.at({point[0], point[1], point[2]})]);
  }
}

/// Calls add(face, corners) for each face of the mesh that is in a group, after its groups have been appended.
template <class Add>
GroupedFaces collected(const MeshTopology& topology, const VolumeFaceGroups& groups, const Add& add) {
  GroupedFaces faces;
  faces.groups = groups.groups;
  if (groups.faces.empty()) return faces;
  const auto before = [](const GroupedFace& entry, const FaceKey& key) { return entry.face < key; };
  for (Index f = 0; f < static_cast<Index>(topology.num_faces()); ++f) {
    const auto corners = topology.face(f);
    const FaceKey key = face_key(corners);
    std::vector<Index> found;
    for (auto entry = std::lower_bound(groups.faces.begin(), groups.faces.end(), key, before);
         entry != groups.faces.end() && entry->face == key; ++entry)
      found.push_back(entry->group);
    if (found.empty()) continue;
    faces.of_face.push_back(std::move(found));
    faces.sizes.push_back(static_cast<std::uint8_t>(corners.size()));
    faces.cells.push_back(topology.face_cells(f)[0]);
    add(faces, f, corners);
    faces.offsets.push_back(faces.nodes.size());
  }
  return faces;
}

}  // namespace

std::vector<std::array<int, 2>> gmsh_face_lattice(std::size_t num_corners, int order) {
  std::vector<Steps> points;
  append_lattice(num_corners, order, {0, 0}, points);
  return points;
}

GroupedFaces grouped_faces(const VolumeMesh& mesh) {
  if (mesh.face_groups.faces.empty()) return {.groups = mesh.face_groups.groups};
  const MeshTopology topology(mesh);
  return collected(topology, mesh.face_groups, [](GroupedFaces& faces, Index, std::span<const Index> corners) {
    faces.orders.push_back(1);
    faces.nodes.insert(faces.nodes.end(), corners.begin(), corners.end());
  });
}

GroupedFaces grouped_faces(const LagrangeMesh& cells, const MeshTopology& topology, const VolumeFaceGroups& groups) {
  std::map<std::pair<CellKind, int>, Places> places;
  return collected(topology, groups, [&](GroupedFaces& faces, Index f, std::span<const Index> corners) {
    const auto c = static_cast<std::size_t>(topology.face_cells(f)[0]);
    const std::pair key(cells.kinds[c], cells.orders[c]);
    auto found = places.find(key);
    if (found == places.end()) found = places.emplace(key, places_of(key.first, key.second)).first;
    faces.orders.push_back(key.second);
    append_points(key.first, key.second, cells.cell(c), found->second, corners, faces.nodes);
  });
}

}  // namespace subvol::internal
