// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/mesh/cell_topology.h"

#include <cstdint>
#include <span>
#include <vector>

namespace subvol::internal {

/// Quadrature of a linear cell, as gradients of its shape functions in the coordinates of its ideal cell.
///
///   J_q = sum_a x_a grad N_a(u_q) A^-1 / h                                     Paper: Eqs. 4-6
///
/// A maps the canonical to the ideal cell of edge length 1: the unit cube, the prism over the equilateral triangle, the
/// regular tetrahedron, the pyramid of four equilateral triangles over the unit square. Points form the trapezoidal
/// grid with `points_per_direction` samples (both ends included) and its counterparts on triangle and tetrahedron: the
/// corners of the regular split into (n-1)^2 triangles, with the weights of the vertex rule on each. A tet's Jacobian
/// is constant: one point. A pyramid's is constant along each ray from its base to its apex: the points are those of
/// its base. Weights sum to 1.
///
/// Only the vertices whose shape function has a nonzero gradient at a point are listed: 4 of 8 at a hex's corner.
struct ElementRule {
  struct Entry {
    std::int8_t vertex;              ///< local vertex number
    std::array<double, 3> gradient;  ///< in ideal coordinates, for h = 1
  };
  CellKind kind;
  std::vector<Vec3> points;  ///< canonical coordinates
  std::vector<double> weights;
  std::vector<std::size_t> offsets;  ///< weights.size() + 1 entries into `entries`
  std::vector<Entry> entries;

  std::size_t num_points() const { return weights.size(); }
  std::span<const Entry> point(std::size_t q) const {
    return {entries.data() + offsets[q], offsets[q + 1] - offsets[q]};
  }
};

/// The rule of a kind. points_per_direction >= 2, else InputError. Rules are nested if n - 1 divides n' - 1.
ElementRule make_element_rule(CellKind kind, int points_per_direction);

/// A of the ideal cell of edge length 1 (paper: section 3.2), its inverse, and that cell's volume.
Mat3 ideal_matrix(CellKind kind);
Mat3 ideal_inverse(CellKind kind);
double ideal_volume(CellKind kind);

}  // namespace subvol::internal
