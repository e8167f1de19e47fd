// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/nodal_sides.h"

#include "subvol/base/error.h"
#include "subvol/base/sort_unique.h"

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <string>

namespace subvol::internal {

int common_order(const NodalMesh& mesh, const char* format, int most) {
  const int order = mesh.orders.front();
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    if (mesh.orders[c] != order)
      throw InputError(std::string(format) + ": cells of several orders, expected one for all");
  if (order > most)
    throw InputError(std::string(format) + ": cells of order " + std::to_string(order) + ", expected order 1 to " +
                     std::to_string(most));
  return order;
}

std::size_t num_corners(CellKind kind) { return static_cast<std::size_t>(cell_topology(kind).num_vertices); }

std::size_t num_edge_nodes(CellKind kind, int order) {
  return num_corners(kind) + (order == 2 ? static_cast<std::size_t>(cell_topology(kind).num_edges) : 0);
}

int reference_of(const NodalMesh& mesh, std::size_t c) { return mesh.references.empty() ? 0 : mesh.references[c]; }

std::vector<bool> edge_nodes(const NodalMesh& mesh, int order) {
  std::vector<bool> used(mesh.positions.size(), order == 1);
  for (std::size_t c = 0; order > 1 && c < mesh.num_cells(); ++c)
    for (const Index node : mesh.cell(c).first(num_edge_nodes(mesh.kinds[c], order)))
      used[static_cast<std::size_t>(node)] = true;
  return used;
}

bool has_edge_nodes_only(const NodalMesh& mesh) {
  constexpr double kEdgeNodeRounding = 64 * std::numeric_limits<double>::epsilon();
  double reach = 0;
  for (const Vec3& x : mesh.positions) reach = std::max(reach, x.cwiseAbs().maxCoeff());
  NodalMesh completed;
  completed.positions = mesh.positions;
  NodalCells cells(completed);
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    if (mesh.orders[c] != 2) continue;
    const std::size_t given = num_edge_nodes(mesh.kinds[c], 2);
    cells.add(mesh.kinds[c], 2, NodeOrdering::vtk, mesh.cell(c).first(given));
    const auto others = completed.cell(completed.num_cells() - 1);
    for (std::size_t i = given; i < others.size(); ++i) {
      const Vec3 &x = mesh.positions[static_cast<std::size_t>(mesh.cell(c)[i])],
                 &y = completed.positions[static_cast<std::size_t>(others[i])];
      if ((x - y).cwiseAbs().maxCoeff() > kEdgeNodeRounding * reach) return false;
    }
  }
  return true;
}

std::vector<std::vector<int>> inp_faces(CellKind kind) {
  if (kind == CellKind::tet) return {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};
  if (kind == CellKind::prism) return {{0, 1, 2}, {3, 5, 4}, {0, 3, 4, 1}, {1, 4, 5, 2}, {2, 5, 3, 0}};
  if (kind == CellKind::pyramid) return {{0, 1, 2, 3}, {0, 4, 1}, {1, 4, 2}, {2, 4, 3}, {3, 4, 0}};
  return {{0, 1, 2, 3}, {4, 7, 6, 5}, {0, 4, 5, 1}, {1, 5, 6, 2}, {2, 6, 7, 3}, {3, 7, 4, 0}};
}

std::vector<std::vector<int>> exodus_faces(CellKind kind) {
  if (kind == CellKind::tet) return {{0, 1, 3}, {1, 2, 3}, {0, 3, 2}, {0, 2, 1}};
  if (kind == CellKind::prism) return {{0, 1, 4, 3}, {1, 2, 5, 4}, {0, 3, 5, 2}, {0, 2, 1}, {3, 4, 5}};
  if (kind == CellKind::pyramid) return {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}, {0, 3, 2, 1}};
  return {{0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {0, 4, 7, 3}, {0, 3, 2, 1}, {4, 5, 6, 7}};
}

std::array<std::vector<std::vector<int>>, kNumCellKinds> faces_by_kind(SideTable table) {
  std::array<std::vector<std::vector<int>>, kNumCellKinds> faces;
  for (int kind = 0; kind < kNumCellKinds; ++kind)
    faces[static_cast<std::size_t>(kind)] = table(static_cast<CellKind>(kind));
  return faces;
}

std::vector<Index> face_nodes(const NodalMesh& mesh, std::size_t cell, std::span<const int> corners) {
  const auto nodes = mesh.cell(cell);
  const auto node = [&](std::size_t place) { return nodes[place]; };
  std::vector<Index> face;
  for (const int i : corners) face.push_back(node(static_cast<std::size_t>(i)));
  if (mesh.orders[cell] == 1) return face;
  const CellKind kind = mesh.kinds[cell];
  const auto lattice = cell_lattice(kind, 2, NodeOrdering::vtk);
  const auto add_middle = [&](int a, int b) {
    for (std::size_t i = num_corners(kind); i < lattice.size(); ++i)
      if (lattice[static_cast<std::size_t>(a)] + lattice[static_cast<std::size_t>(b)] == 2 * lattice[i])
        face.push_back(node(i));
  };
  for (std::size_t k = 0; k < corners.size(); ++k) add_middle(corners[k], corners[(k + 1) % corners.size()]);
  if (corners.size() == 4) add_middle(corners[0], corners[2]);
  return face;
}

std::vector<GroupSides> sides_of_groups(const NodalMesh& mesh, SideTable table, bool with_centers) {
  std::vector<GroupSides> groups(mesh.face_groups.groups.size());
  std::set<FaceKey> wanted;
  for (const GroupedFace& face : mesh.face_groups.faces) wanted.insert(face.face);
  std::map<FaceKey, Side> sides;
  std::vector<Index> corners;
  const auto faces = faces_by_kind(table);
  for (std::size_t c = 0; !wanted.empty() && c < mesh.num_cells(); ++c) {
    int number = 0;
    for (const std::vector<int>& face : faces[static_cast<std::size_t>(mesh.kinds[c])]) {
      ++number;
      corners.clear();
      for (const int i : face) corners.push_back(mesh.cell(c)[static_cast<std::size_t>(i)]);
      if (const FaceKey key = face_key(corners); wanted.contains(key)) sides.try_emplace(key, Side{c, number});
    }
  }
  for (const GroupedFace& face : mesh.face_groups.faces) {
    const auto found = sides.find(face.face);
    if (found == sides.end()) continue;
    const Side& side = found->second;
    GroupSides& group = groups[static_cast<std::size_t>(face.group)];
    group.sides.push_back(side);
    const auto& of_face =
        faces[static_cast<std::size_t>(mesh.kinds[side.cell])][static_cast<std::size_t>(side.number) - 1];
    std::vector<Index> nodes = face_nodes(mesh, side.cell, of_face);
    if (!with_centers && mesh.orders[side.cell] == 2) nodes.resize(2 * of_face.size());
    group.nodes.insert(group.nodes.end(), nodes.begin(), nodes.end());
  }
  for (GroupSides& group : groups) {
    sort_unique(group.nodes);
  }
  return groups;
}

BoundaryOfNodes::BoundaryOfNodes(const NodalMesh& mesh)
    : faces_at_(mesh.positions.size()), in_set_(mesh.positions.size(), 0) {
  const auto tables = faces_by_kind(inp_faces);
  std::vector<std::pair<FaceKey, std::array<Index, 4>>> faces;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    for (const std::vector<int>& local : tables[static_cast<std::size_t>(mesh.kinds[c])]) {
      std::array<Index, 4> corners{kNoIndex, kNoIndex, kNoIndex, kNoIndex};
      for (std::size_t i = 0; i < local.size(); ++i) corners[i] = mesh.cell(c)[static_cast<std::size_t>(local[i])];
      faces.emplace_back(face_key(std::span(corners).first(local.size())), corners);
    }
  std::sort(faces.begin(), faces.end());
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const bool is_twin = (i > 0 && faces[i - 1].first == faces[i].first) ||
                         (i + 1 < faces.size() && faces[i + 1].first == faces[i].first);
    if (is_twin) continue;
    faces_at_[static_cast<std::size_t>(faces[i].second[0])].push_back(static_cast<Index>(faces_.size()));
    faces_.push_back(faces[i].second);
  }
}

std::vector<std::span<const Index>> BoundaryOfNodes::faces_of(std::span<const Index> nodes) {
  ++num_calls_;
  for (const Index v : nodes) in_set_[static_cast<std::size_t>(v)] = num_calls_;
  const auto is_in = [&](Index v) { return v == kNoIndex || in_set_[static_cast<std::size_t>(v)] == num_calls_; };
  std::vector<std::span<const Index>> found;
  for (const Index v : nodes)
    for (const Index f : faces_at_[static_cast<std::size_t>(v)]) {
      const std::array<Index, 4>& face = faces_[static_cast<std::size_t>(f)];
      if (std::ranges::all_of(face, is_in)) found.push_back(std::span(face).first(face[3] == kNoIndex ? 3 : 4));
    }
  if (found.size() == faces_.size()) found.clear();
  return found;
}

}  // namespace subvol::internal
