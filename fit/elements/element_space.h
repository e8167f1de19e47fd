// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/shape_functions.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/mesh/volume_mesh.h"

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace subvol {

/// An order for every edge, face and cell, 1 .. kMaxOrder.
///
/// Orders must follow a rule: a face has no higher order than any of its edges, a cell no higher order than any of its
/// faces. The interior only continues what happens on its boundary, so detail is paid for on the boundary alone.
struct EntityOrders {
  std::vector<int> edges, faces, cells;

  static EntityOrders uniform(const MeshTopology& topology, int order);
  /// Raises edges to the orders of their faces and faces to those of their cells until the rule holds.
  void raise_borders(const MeshTopology& topology);
  /// Lowers faces to the orders of their edges and cells to those of their faces until the rule holds.
  void lower_interiors(const MeshTopology& topology);

  bool operator==(const EntityOrders&) const = default;
};

/// Nodes of a high-order mesh: which nodes exist, how they are numbered, and how each cell refers to them.
///
///   x(u) = sum_a sign_a N_a(u) coefficient[node_a]       over a cell's functions N_a                 Paper: Eq. 5
///
/// Vertices come first: they keep the numbers of the mesh, and their coefficients are positions. The modes of edges,
/// faces and cells follow, and their coefficients are displacements. Each mode exists once, in a frame that global
/// vertex numbers determine:
///
///   edge      from the smaller vertex to the larger
///   quad      origin at the smallest vertex, i toward the smaller of its two neighbors, j toward the other
///   triangle  a < b < c by number: the mode E_ab,i V_c,j
///   cell      the kind's own
///
/// Neighboring cells of any kind and orientation therefore agree on what they share, up to rounding.
///
/// Cells with the same functions have the same *pattern*: the list of their modes, ascending. A hex whose entities all
/// have order p has one pattern, with all (p + 1)^3 modes in tensor order, i fastest; prisms of one order have at most
/// 9 patterns, tets 12.
///
/// Immutable; copies share what they can. The positions of the mesh are not kept.
class ElementSpace {
 public:
  /// mesh: as MeshTopology requires it. InputError: an order outside 1 .. kMaxOrder; a pyramid of an order above 1.
  ElementSpace(const VolumeMesh& mesh, Basis basis, int order);
  /// InputError: sizes that differ from the mesh's, an order out of range, or orders that break the rule;
  /// a pyramid with an edge of an order above 1.
  ElementSpace(const VolumeMesh& mesh, Basis basis, const EntityOrders& orders);
  /// Returns a space of the same cells with other orders; `node_numbers_in` maps the nodes. InputError as above.
  ElementSpace with_orders(const EntityOrders& orders) const;

  Basis basis() const { return basis_; }
  const EntityOrders& orders() const { return orders_; }
  const MeshTopology& topology() const { return cells_->topology; }
  std::size_t num_cells() const { return cells_->kinds.size(); }
  CellKind kind(std::size_t c) const { return cells_->kinds[c]; }
  std::span<const CellKind> kinds() const { return cells_->kinds; }
  std::span<const Index> vertices(std::size_t c) const {
    const auto& offsets = cells_->vertex_offsets;
    return {cells_->vertices.data() + offsets[c], offsets[c + 1] - offsets[c]};
  }

  std::size_t num_vertices() const { return topology().num_vertices(); }
  std::size_t num_nodes() const { return cell_nodes_.back(); }
  /// Return the first node of an edge, face or cell; its modes follow in the order of `for_each_mode`.
  std::size_t edge_nodes(std::size_t e) const { return edge_nodes_[e]; }
  std::size_t face_nodes(std::size_t f) const { return face_nodes_[f]; }
  std::size_t cell_nodes(std::size_t c) const { return cell_nodes_[c]; }
  EntityShape face_shape(std::size_t f) const;
  /// Corners of a face in its own frame. Triangle: a, b, c, then kNoIndex. Quad: the origin, the corner that i runs to,
  /// the opposite corner, the corner that j runs to.
  const std::array<Index, 4>& face_frame(std::size_t f) const { return cells_->face_frames[f]; }

  /// Return all nodes of a cell and their signs, in the order of its pattern's modes.
  std::span<const Index> nodes(std::size_t c) const {
    return {nodes_.data() + offsets_[c], offsets_[c + 1] - offsets_[c]};
  }
  std::span<const std::int8_t> signs(std::size_t c) const {
    return {signs_.data() + offsets_[c], offsets_[c + 1] - offsets_[c]};
  }
  std::span<const LocalMode> modes(std::size_t c) const { return pattern_modes(patterns_[c]); }

  std::size_t num_patterns() const { return pattern_kinds_.size(); }
  std::size_t pattern(std::size_t c) const { return patterns_[c]; }
  CellKind pattern_kind(std::size_t p) const { return pattern_kinds_[p]; }
  std::span<const LocalMode> pattern_modes(std::size_t p) const {
    return {pattern_modes_.data() + pattern_offsets_[p], pattern_offsets_[p + 1] - pattern_offsets_[p]};
  }
  /// Return the largest order among a pattern's edges, faces and cell, and that among all patterns.
  int pattern_order(std::size_t p) const { return pattern_orders_[p]; }
  int max_order() const;

 private:
  /// Data that do not depend on the orders.
  struct Cells {
    explicit Cells(const VolumeMesh& mesh);
    MeshTopology topology;
    std::vector<CellKind> kinds;
    std::vector<std::size_t> vertex_offsets;
    std::vector<Index> vertices;
    std::vector<std::array<Index, 4>> face_frames;
  };
  ElementSpace(std::shared_ptr<const Cells> cells, Basis basis, const EntityOrders& orders);
  void number_nodes();
  void list_cell_modes();

  std::shared_ptr<const Cells> cells_;
  Basis basis_;
  EntityOrders orders_;
  std::vector<std::size_t> edge_nodes_, face_nodes_, cell_nodes_;  // one more entry than entities
  std::vector<std::size_t> offsets_;                               // per cell, into nodes_ and signs_
  std::vector<Index> nodes_;
  std::vector<std::int8_t> signs_;
  std::vector<Index> patterns_;
  std::vector<CellKind> pattern_kinds_;
  std::vector<int> pattern_orders_;
  std::vector<std::size_t> pattern_offsets_{0};
  std::vector<LocalMode> pattern_modes_;
};

/// Returns, for every node of `from`, its number in `to`, a space of the same cells, or kNoIndex if `to` has no such
/// mode.
///
/// A map keeps its shape if its coefficients are moved to these numbers, none is lost, and new modes are zero.
/// InputError: the spaces differ in basis or cells.
std::vector<Index> node_numbers_in(const ElementSpace& to, const ElementSpace& from);

}  // namespace subvol
