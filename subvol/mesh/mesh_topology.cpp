// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/mesh/mesh_topology.h"

#include "subvol/base/error.h"

#include <algorithm>
#include <string>

namespace subvol {

namespace {

/// Linked lists of edges or faces, each kept at the one of its vertices that has the fewest cells. A lookup costs the
/// length of one list, which is short even next to a vertex that all cells share.
class Chains {
 public:
  Chains(const std::vector<Index>& num_cells_at, std::size_t expected)
      : num_cells_at_(num_cells_at), head_(num_cells_at.size(), kNoIndex) {
    next_.reserve(expected);
  }
  /// Returns the one of two vertices that has fewer cells.
  Index with_fewer_cells(Index a, Index b) const { return num_cells_at_[b] < num_cells_at_[a] ? b : a; }
  /// Returns the first item of the list at a vertex; kNoIndex if it is empty.
  Index first(Index vertex) const { return head_[vertex]; }
  /// Returns the item that follows another one in its list; kNoIndex after the last.
  Index after(Index item) const { return next_[item]; }
  /// Puts an item first in the list at a vertex. Items are added in the order of their numbers.
  void add(Index vertex, Index item) {
    next_.push_back(head_[vertex]);
    head_[vertex] = item;
  }

 private:
  const std::vector<Index>& num_cells_at_;
  std::vector<Index> head_, next_;
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

/// Numbers the edges of cells in the order of their first appearance.
class EdgeNumbering {
 public:
  /// edges, cell_counts  receive the edges and the number of cells around each.
  EdgeNumbering(const std::vector<Index>& num_cells_at, std::size_t expected, std::vector<std::array<Index, 2>>& edges,
                std::vector<int>& cell_counts)
      : edges_(edges), cell_counts_(cell_counts), chains_(num_cells_at, expected) {
    edges_.reserve(expected);
    cell_counts_.reserve(expected);
  }
  /// Returns the number of the edge between two vertices of a cell, and counts the cell.
  Index number(Index a, Index b) {
    if (a > b) std::swap(a, b);
    const Index hook = chains_.with_fewer_cells(a, b);
    Index e = chains_.first(hook);
    while (e != kNoIndex && (edges_[e][0] != a || edges_[e][1] != b)) e = chains_.after(e);
    if (e == kNoIndex) {
      e = static_cast<Index>(edges_.size());
      edges_.push_back({a, b});
      cell_counts_.push_back(0);
      chains_.add(hook, e);
    }
    ++cell_counts_[e];
    return e;
  }

 private:
  std::vector<std::array<Index, 2>>& edges_;
  std::vector<int>& cell_counts_;
  Chains chains_;
};

/// Numbers the faces of cells in the order of their first appearance.
class FaceNumbering {
 public:
  /// vertices, cells  receive the corners of the faces and the cells on both sides of each.
  FaceNumbering(const std::vector<Index>& num_cells_at, std::size_t expected,
                std::vector<std::array<Index, 4>>& vertices, std::vector<std::array<Index, 2>>& cells)
      : vertices_(vertices), cells_(cells), chains_(num_cells_at, expected) {
    vertices_.reserve(expected);
    cells_.reserve(expected);
    keys_.reserve(expected);
  }
  /// Returns the number of a cell's face. corners: `size` of them, then kNoIndex. InputError: two cells have it
  /// already.
  Index number(std::array<Index, 4> corners, int size, std::size_t cell) {
    const std::array<Index, 4> key = sorted_corners(corners, size);
    Index hook = key[0];
    for (int j = 1; j < size; ++j) hook = chains_.with_fewer_cells(hook, key[j]);
    Index f = chains_.first(hook);
    while (f != kNoIndex && !same_corners(keys_[f], key)) f = chains_.after(f);
    if (f == kNoIndex) {
      f = static_cast<Index>(cells_.size());
      vertices_.push_back(corners);
      keys_.push_back(key);
      cells_.push_back({static_cast<Index>(cell), kNoIndex});
      chains_.add(hook, f);
    } else {
      if (cells_[f][1] != kNoIndex)
        throw InputError("MeshTopology: cell " + std::to_string(cell) +
                         " has a face that two other cells share already");
      cells_[f][1] = static_cast<Index>(cell);
    }
    return f;
  }

 private:
  std::vector<std::array<Index, 4>>& vertices_;
  std::vector<std::array<Index, 2>>& cells_;
  std::vector<std::array<Index, 4>> keys_;
  Chains chains_;
};

}  // namespace

MeshTopology::MeshTopology(const VolumeMesh& mesh) : num_vertices_(mesh.num_vertices()) {
  number_edges_and_faces(mesh);
  list_edges_of_vertices();
  mark_boundary();
}

void MeshTopology::number_edges_and_faces(const VolumeMesh& mesh) {
  const std::size_t num_cells = mesh.num_cells();
  cell_edge_offsets_.assign(1, 0);
  cell_face_offsets_.assign(1, 0);
  cell_edge_offsets_.reserve(num_cells + 1);
  cell_face_offsets_.reserve(num_cells + 1);
  cell_edges_.reserve(12 * num_cells);  // what hexes need; reserved memory that is not touched costs nothing
  cell_faces_.reserve(6 * num_cells);
  const std::vector<Index> num_cells_at = cells_at_vertices(mesh);
  EdgeNumbering edges(num_cells_at, 4 * num_cells, edges_, edge_cell_counts_);
  FaceNumbering faces(num_cells_at, 4 * num_cells, face_vertices_, face_cells_);
  for (std::size_t c = 0; c < num_cells; ++c) {
    const CellTopology& topology = cell_topology(mesh.kinds[c]);
    const std::span<const Index> cell = mesh.cell(c);
    for (int i = 0; i < topology.num_edges; ++i)
      cell_edges_.push_back(edges.number(cell[topology.edges[i][0]], cell[topology.edges[i][1]]));
    cell_edge_offsets_.push_back(cell_edges_.size());
    for (int i = 0; i < topology.num_faces; ++i) {
      const int size = topology.face_sizes[i];
      std::array<Index, 4> corners = {kNoIndex, kNoIndex, kNoIndex, kNoIndex};
      for (int j = 0; j < size; ++j) corners[j] = cell[topology.faces[i][j]];
      cell_faces_.push_back(faces.number(corners, size, c));
    }
    cell_face_offsets_.push_back(cell_faces_.size());
  }
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
