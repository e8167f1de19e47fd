// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/fit/elements/basis.h"
#include "subvol/mesh/cell_topology.h"

#include <array>
#include <compare>
#include <cstdint>
#include <span>

namespace subvol {

/// Returns the canonical coordinates of a cell's vertices (`cell_topology.h`).
std::span<const Vec3> canonical_vertices(CellKind kind);

/// One shape function of a cell, as a product of functions of one variable.
///
///   hex     N_i(u) N_j(v) N_k(w)                                     N: `line_functions`          Paper: Eq. 5
///   prism   E_edge,i  V_vertex,j  N_k(w)                             edge, vertex: those of triangle 0 1 2
///   tet     E_edge,i  V_vertex,j  V_3,k                              the last factor only if k > 0
///   pyramid N_vertex                                                 of order 1 only
///
///   E_ab,i = l_a l_b psi_i((1 + l_b - l_a) / 2)                      a factor only if edge >= 0; i >= 1
///   V_c,j  = l_c psi_j(l_c), V_c,0 = l_c                             a factor only if vertex >= 0
///
/// with l the barycentric coordinates and psi the `mode_kernels`. On its own edge, E_ab,i is phi_i(l_b); everywhere,
/// swapping a and b multiplies it by phi_i's parity. So edges carry phi_i and quad faces phi_i phi_j on every kind, and
/// triangle faces E_ab,i V_c,j on both kinds that have them. With Legendre, prism functions are polynomials over the
/// triangle, of degree i + 1 or i + j + 1, and tet functions are polynomials of degree i + j + k + 1.
///
/// Pyramids have their five rational vertex functions: with s = u / (1-w) and t = v / (1-w), (1-w) times the bilinear
/// functions of s and t at the base, and w at the apex.
struct LocalMode {
  std::int8_t edge = -1;    ///< of a prism or tet, in the kind's order (prism: 0 .. 2); or -1
  std::int8_t vertex = -1;  ///< of a prism (0 .. 2), tet or pyramid; or -1
  std::uint8_t k = 0, j = 0, i = 0;

  auto operator<=>(const LocalMode&) const = default;
};

/// A mode of an edge, face or cell as seen from a cell: its sign times that cell's shape function.
struct SignedMode {
  LocalMode mode;
  int sign = 1;
};

/// The entities of a cell that carry modes, by shape.
enum class EntityShape : std::uint8_t { edge, triangle, quad, tet, prism, hex, pyramid };
/// Returns the shape of a cell.
EntityShape entity_shape(CellKind kind);

/// Indices (i, j, k) of an entity's mode, from 1 on; those that the entity does not have are 0. With n = order - 1:
///
///   edge      i <= n                     tet       i + j + k <= n
///   triangle  i + j <= n                 prism     i + j <= n, k <= n
///   quad      i, j <= n                  hex       i, j, k <= n
struct ModeIndex {
  int i, j, k;
};

/// Returns the number of modes of an entity: n, n(n-1)/2, n^2, n(n-1)(n-2)/6, n^2(n-1)/2, n^3, 0 in the order of
/// EntityShape.
int num_modes(EntityShape shape, int order);

/// Calls f(ModeIndex) for every mode, i fastest, then j, then k: the order in which nodes are numbered.
template <class Function>
void for_each_mode(EntityShape shape, int order, const Function& f);

/// Returns the shape function of a local vertex.
LocalMode vertex_mode(CellKind kind, int vertex);
/// Return the mode phi_i of the edge from local vertex a to b, phi_i phi_j of the quad with origin a, i running to b
/// and j to d, and E_ab,i V_c,j of the triangle a b c.
SignedMode edge_mode(CellKind kind, int a, int b, int i);
SignedMode quad_mode(CellKind kind, int a, int b, int d, int i, int j);
SignedMode triangle_mode(CellKind kind, int a, int b, int c, int i, int j);
/// Returns a mode of the cell itself: hex phi_i phi_j phi_k, prism E_01,i V_2,j phi_k, tet E_01,i V_2,j V_3,k.
LocalMode cell_mode(CellKind kind, ModeIndex index);

/// Values and gradients of shape functions at points of one kind of cell. Never allocates; use one object per thread.
class ShapeFunctions {
 public:
  /// max_order: 1 .. kMaxOrder, at least that of any mode to evaluate.
  ShapeFunctions(CellKind kind, Basis basis, int max_order);

  CellKind kind() const { return kind_; }
  /// Sets the point, in canonical coordinates inside the cell. At the apex of a pyramid, the gradients are those along
  /// its axis.
  void set_point(const Vec3& point);
  double value(const LocalMode& mode) const {
    if (kind_ == CellKind::hex) return axes_[0][mode.i].value * axes_[1][mode.j].value * axes_[2][mode.k].value;
    double result = mode.edge >= 0 ? edges_[mode.edge][mode.i].value : 1;
    if (mode.vertex >= 0) result *= vertices_[mode.vertex][mode.j].value;
    if (kind_ == CellKind::prism) return result * axes_[2][mode.k].value;
    return mode.k > 0 ? result * vertices_[3][mode.k].value : result;
  }
  /// Returns the value, and the gradient with respect to the canonical coordinates.
  double value(const LocalMode& mode, Vec3& gradient) const {
    const Factor f = evaluate(mode);
    gradient = f.gradient;
    return f.value;
  }

 private:
  struct Factor {
    double value;
    Vec3 gradient;
  };
  using LineTable = std::array<Factor, kMaxOrder + 1>;
  static Factor product(const Factor& a, const Factor& b) {
    return {a.value * b.value, a.value * b.gradient + b.value * a.gradient};
  }
  Factor evaluate(const LocalMode& mode) const;
  void set_axis(int axis, double x);
  void set_pyramid_point(const Vec3& point);

  CellKind kind_;
  Basis basis_;
  int max_order_;
  std::array<LineTable, 3> axes_;      // N along u, v, w; a prism uses w alone
  std::array<LineTable, 6> edges_;     // E_edge,i at i
  std::array<LineTable, 5> vertices_;  // V_vertex,j at j; a pyramid's N_vertex at 0
};

template <class Function>
void for_each_mode(EntityShape shape, int order, const Function& f) {
  if (shape == EntityShape::pyramid) return;
  const int n = order - 1;
  const bool simplex = shape == EntityShape::triangle || shape == EntityShape::prism;
  const bool flat = shape == EntityShape::triangle || shape == EntityShape::quad;
  if (shape == EntityShape::edge) {
    for (int i = 1; i <= n; ++i) f(ModeIndex{i, 0, 0});
  } else if (flat) {
    for (int j = 1; j <= n; ++j)
      for (int i = 1; i <= (simplex ? n - j : n); ++i) f(ModeIndex{i, j, 0});
  } else {
    for (int k = 1; k <= n; ++k) {
      const int last = shape == EntityShape::tet ? n - k : n;
      for (int j = 1; j <= last; ++j)
        for (int i = 1; i <= (shape == EntityShape::hex ? n : last - j); ++i) f(ModeIndex{i, j, k});
    }
  }
}

}  // namespace subvol
