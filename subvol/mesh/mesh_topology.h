// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"

#include <array>
#include <span>
#include <vector>

namespace subvol {

/// Edges, faces and boundary of a volume mesh: derived once, immutable, numbered in order of first appearance
/// (cell by cell, in local order), so equal meshes get equal numbers.
///
/// Expects index-correct cells (no `index_out_of_range`, `repeated_vertex` or `face_of_many_cells` of `validate`; the
/// last is refused with InputError). Positions are not read. Cost: linear, even if all cells share one vertex.
class MeshTopology {
 public:
  explicit MeshTopology(const VolumeMesh& mesh);

  std::size_t num_vertices() const { return num_vertices_; }
  std::size_t num_edges() const { return edges_.size(); }
  std::size_t num_faces() const { return face_cells_.size(); }
  std::size_t num_cells() const { return cell_edge_offsets_.size() - 1; }

  /// Returns the end vertices of an edge, the smaller number first.
  const std::array<Index, 2>& edge(Index e) const { return edges_[e]; }
  /// Returns the corners of a face (3 or 4), seen from its first cell so that the normal points out of that cell.
  std::span<const Index> face(Index f) const {
    return {face_vertices_[f].data(), face_vertices_[f][3] == kNoIndex ? 3u : 4u};
  }
  /// Returns the first and second cell of a face; the second is kNoIndex on the boundary.
  const std::array<Index, 2>& face_cells(Index f) const { return face_cells_[f]; }
  bool is_boundary_face(Index f) const { return face_cells_[f][1] == kNoIndex; }

  /// Return the global edges and faces of a cell in the kind's local order.
  std::span<const Index> cell_edges(std::size_t c) const {
    return {cell_edges_.data() + cell_edge_offsets_[c], cell_edge_offsets_[c + 1] - cell_edge_offsets_[c]};
  }
  std::span<const Index> cell_faces(std::size_t c) const {
    return {cell_faces_.data() + cell_face_offsets_[c], cell_face_offsets_[c + 1] - cell_face_offsets_[c]};
  }

  /// Returns the numbers of the boundary faces, ascending.
  std::span<const Index> boundary_faces() const { return boundary_faces_; }
  /// Return true for edges and vertices of boundary faces.
  bool is_boundary_edge(Index e) const { return boundary_edge_[e] != 0; }
  bool is_boundary_vertex(Index v) const { return boundary_vertex_[v] != 0; }
  /// Returns the number of cells around an edge.
  int num_edge_cells(Index e) const { return edge_cell_counts_[e]; }

  /// Returns the number of the edge between two vertices, or kNoIndex. Cost: logarithmic in the valence.
  Index find_edge(Index v0, Index v1) const;

 private:
  void number_edges_and_faces(const VolumeMesh& mesh);
  void list_edges_of_vertices();
  void mark_boundary();

  std::size_t num_vertices_ = 0;
  std::vector<std::array<Index, 2>> edges_;
  std::vector<std::array<Index, 4>> face_vertices_;
  std::vector<std::array<Index, 2>> face_cells_;
  std::vector<std::size_t> cell_edge_offsets_, cell_face_offsets_;
  std::vector<Index> cell_edges_, cell_faces_;
  std::vector<Index> boundary_faces_;
  std::vector<char> boundary_edge_, boundary_vertex_;
  std::vector<int> edge_cell_counts_;
  std::vector<std::size_t> vertex_edge_offsets_;  // edges by their smaller vertex, sorted by the larger
  std::vector<Index> vertex_edges_;
};

}  // namespace subvol
