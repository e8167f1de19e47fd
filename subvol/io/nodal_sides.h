// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// What the writers of cells of any order share.

#include "subvol/io/nodal_mesh.h"

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace subvol::internal {

/// Returns the order of the cells. InputError, naming the format: cells of several orders, or of an order above `most`.
int common_order(const NodalMesh& mesh, const char* format, int most);

/// Number of the corners of a cell, and of its nodes that are corners or, in order 2, middles of edges.
std::size_t num_corners(CellKind kind);
std::size_t num_edge_nodes(CellKind kind, int order);

int reference_of(const NodalMesh& mesh, std::size_t c);

/// The nodes that a file without nodes inside faces and cells has. In order 1 these are all nodes: vertices of no cell
/// keep their place.
std::vector<bool> edge_nodes(const NodalMesh& mesh, int order);

/// Returns true if every cell of order 2 is determined by its corners and middles of edges, up to rounding: its other
/// nodes lie where `NodalCells` would put them.
bool has_edge_nodes_only(const NodalMesh& mesh);

/// Faces of a kind of cell, each by its corners, in the order in which a format numbers them from 1 on.
using SideTable = std::vector<std::vector<int>> (*)(CellKind kind);
std::vector<std::vector<int>> inp_faces(CellKind kind);     ///< S1, S2, .. of Abaqus
std::vector<std::vector<int>> exodus_faces(CellKind kind);  ///< sides of Exodus
/// The faces of all kinds, by CellKind.
std::array<std::vector<std::vector<int>>, kNumCellKinds> faces_by_kind(SideTable table);

/// Returns the nodes of a face of a cell of order 1 or 2: its corners in their order, the middles of its edges, and in
/// order 2 the center of a quad.
std::vector<Index> face_nodes(const NodalMesh& mesh, std::size_t cell, std::span<const int> corners);

/// A face of a cell by its number in a SideTable, from 1 on.
struct Side {
  std::size_t cell;
  int number;
};

/// The faces of one group.
struct GroupSides {
  std::vector<Side> sides;   ///< each of the first cell that has it
  std::vector<Index> nodes;  ///< of all of them, ascending
};

/// Returns the faces of each group that the mesh has.
///
/// with_centers  true: the centers of quads of order 2 are nodes, too.
std::vector<GroupSides> sides_of_groups(const NodalMesh& mesh, SideTable table, bool with_centers);

/// Finds the faces of the boundary (those of one cell) that a set of nodes stands for.
class BoundaryOfNodes {
 public:
  explicit BoundaryOfNodes(const NodalMesh& mesh);

  /// Returns the corners of each face whose corners are all in the set; none if these are all faces of the boundary.
  /// They are valid as long as this object is. nodes: numbers of nodes, each once.
  std::vector<std::span<const Index>> faces_of(std::span<const Index> nodes);

 private:
  std::vector<std::array<Index, 4>> faces_;   ///< by their corners; the fourth of a triangle is kNoIndex
  std::vector<std::vector<Index>> faces_at_;  ///< of each node that is the first corner of some
  std::vector<std::size_t> in_set_;           ///< number of the last call with this node
  std::size_t num_calls_ = 0;
};

}  // namespace subvol::internal
