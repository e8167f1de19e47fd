// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/mesh/mesh_topology.h"

#include "subvol/base/error.h"

#include <algorithm>
#include <string>

namespace subvol {

namespace {

/// Linked lists of edges or faces, each kept at the one of its vertices that has the fewest cells. A lookup costs the
/// length of one list, which is short even next to a vertex that all cells share.
struct Chains {
  explicit Chains(std::size_t num_vertices) : head(num_vertices, kNoIndex) {}
  std::vector<Index> head, next;
};

std::vector<Index> cells_at_vertices(const VolumeMesh& mesh) {
  std::vector<Index> counts(mesh.num_vertices(), 0);
  for (const Index v : mesh.cell_vertices) ++counts[v];
  return counts;
}

/// Returns true if the sorted corners are equal; without branches.
bool same_corners(const std::array<Index, 4>& a, const std::array<Index, 4>& b) {
  return ((a[0] ^ b[0]) | (a[1] ^ b[1]) | (a[2] ^ b[2]) | (a[3] ^ b[3])) == 0;
}

/// Returns the corners in ascending order, with kNoIndex last.
std::array<Index, 4> sorted_corners(std::array<Index, 4> corners, int size) {
  const auto order = [&](int i, int j) {
    if (corners[i] > corners[j]) std::swap(corners[i], corners[j]);
  };
  order(0, 1);
  if (size == 4) {
    order(2, 3);
    order(0, 2);
    order(1, 3);
  }
  order(1, 2);
  if (size == 3) order(0, 1);
  return corners;
}

}  // namespace

MeshTopology::MeshTopology(const VolumeMesh& mesh) : num_vertices_(mesh.num_vertices()) {
  const std::size_t num_cells = mesh.num_cells();
  cell_edge_offsets_.assign(1, 0);
  cell_face_offsets_.assign(1, 0);
  cell_edge_offsets_.reserve(num_cells + 1);
  cell_face_offsets_.reserve(num_cells + 1);
  cell_edges_.reserve(12 * num_cells);  // what hexes need; reserved memory that is not touched costs nothing
  cell_faces_.reserve(6 * num_cells);
  edges_.reserve(4 * num_cells);
  edge_cell_counts_.reserve(4 * num_cells);
  face_vertices_.reserve(4 * num_cells);
  face_cells_.reserve(4 * num_cells);

  const std::vector<Index> num_cells_at = cells_at_vertices(mesh);
  const auto with_fewer_cells = [&](Index a, Index b) { return num_cells_at[b] < num_cells_at[a] ? b : a; };
  Chains edge_chains(num_vertices_), face_chains(num_vertices_);
  std::vector<std::array<Index, 4>> face_keys;
  face_keys.reserve(4 * num_cells);
  edge_chains.next.reserve(4 * num_cells);
  face_chains.next.reserve(4 * num_cells);
  for (std::size_t c = 0; c < num_cells; ++c) {
    const CellTopology& topology = cell_topology(mesh.kinds[c]);
    const std::span<const Index> cell = mesh.cell(c);

    for (int i = 0; i < topology.num_edges; ++i) {
      Index a = cell[topology.edges[i][0]], b = cell[topology.edges[i][1]];
      if (a > b) std::swap(a, b);
      const Index hook = with_fewer_cells(a, b);
      Index e = edge_chains.head[hook];
      while (e != kNoIndex && (edges_[e][0] != a || edges_[e][1] != b)) e = edge_chains.next[e];
      if (e == kNoIndex) {
        e = static_cast<Index>(edges_.size());
        edges_.push_back({a, b});
        edge_cell_counts_.push_back(0);
        edge_chains.next.push_back(edge_chains.head[hook]);
        edge_chains.head[hook] = e;
      }
      ++edge_cell_counts_[e];
      cell_edges_.push_back(e);
    }
    cell_edge_offsets_.push_back(cell_edges_.size());

    for (int i = 0; i < topology.num_faces; ++i) {
      const int size = topology.face_sizes[i];
      std::array<Index, 4> corners = {kNoIndex, kNoIndex, kNoIndex, kNoIndex};
      for (int j = 0; j < size; ++j) corners[j] = cell[topology.faces[i][j]];
      const std::array<Index, 4> key = sorted_corners(corners, size);
      Index hook = key[0];
      for (int j = 1; j < size; ++j) hook = with_fewer_cells(hook, key[j]);
      Index f = face_chains.head[hook];
      while (f != kNoIndex && !same_corners(face_keys[f], key)) f = face_chains.next[f];
      if (f == kNoIndex) {
        f = static_cast<Index>(face_cells_.size());
        face_vertices_.push_back(corners);
        face_keys.push_back(key);
        face_cells_.push_back({static_cast<Index>(c), kNoIndex});
        face_chains.next.push_back(face_chains.head[hook]);
        face_chains.head[hook] = f;
      } else {
        if (face_cells_[f][1] != kNoIndex)
          throw InputError("MeshTopology: cell " + std::to_string(c) +
                           " has a face that two other cells share already");
        face_cells_[f][1] = static_cast<Index>(c);
      }
      cell_faces_.push_back(f);
    }
    cell_face_offsets_.push_back(cell_faces_.size());
  }
  list_edges_of_vertices();
  mark_boundary();
}

void MeshTopology::list_edges_of_vertices() {
  vertex_edge_offsets_.assign(num_vertices_ + 1, 0);
  for (const auto& e : edges_) ++vertex_edge_offsets_[e[0] + 1];
  for (std::size_t v = 0; v < num_vertices_; ++v) vertex_edge_offsets_[v + 1] += vertex_edge_offsets_[v];
  vertex_edges_.resize(edges_.size());
  std::vector<std::size_t> next(vertex_edge_offsets_.begin(), vertex_edge_offsets_.end() - 1);
  for (std::size_t e = 0; e < edges_.size(); ++e) vertex_edges_[next[edges_[e][0]]++] = static_cast<Index>(e);
  for (std::size_t v = 0; v < num_vertices_; ++v)
    std::sort(vertex_edges_.begin() + vertex_edge_offsets_[v], vertex_edges_.begin() + vertex_edge_offsets_[v + 1],
              [&](Index a, Index b) { return edges_[a][1] < edges_[b][1]; });
}

void MeshTopology::mark_boundary() {
  boundary_edge_.assign(edges_.size(), 0);
  boundary_vertex_.assign(num_vertices_, 0);
  for (std::size_t f = 0; f < face_cells_.size(); ++f) {
    if (face_cells_[f][1] != kNoIndex) continue;
    boundary_faces_.push_back(static_cast<Index>(f));
    const std::span<const Index> corners = face(static_cast<Index>(f));
    for (std::size_t i = 0; i < corners.size(); ++i) {
      boundary_vertex_[corners[i]] = 1;
      boundary_edge_[find_edge(corners[i], corners[(i + 1) % corners.size()])] = 1;
    }
  }
}

Index MeshTopology::find_edge(Index v0, Index v1) const {
  if (v0 > v1) std::swap(v0, v1);
  const auto first = vertex_edges_.begin() + vertex_edge_offsets_[v0];
  const auto last = vertex_edges_.begin() + vertex_edge_offsets_[v0 + 1];
  const auto it = std::lower_bound(first, last, v1, [&](Index e, Index v) { return edges_[e][1] < v; });
  return it != last && edges_[*it][1] == v1 ? *it : kNoIndex;
}

}  // namespace subvol
