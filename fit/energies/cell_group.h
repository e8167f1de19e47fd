// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/collapsed_basis.h"
#include "subvol/fit/elements/element_space.h"
#include "subvol/fit/elements/quadrature.h"
#include "subvol/fit/energies/frozen_distortion.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

namespace subvol::internal {

/// Cells of one kind, order and quadrature, in batches of eight: the tables that they share and the data of each batch.
struct CellGroup {
  CellKind kind;
  int order, points_per_direction;
  std::vector<Vec3> points;  ///< hex: column by column (w fastest, then u, then v); prism: layer by layer (w slowest)
  std::vector<double> weights;
  std::size_t num_modes = 0;
  std::vector<double> values, derivatives;  ///< hex, prism: the order + 1 line functions at every point of a line
  std::vector<LocalMode> modes;             ///< prism, tet: union of the cells' modes, ascending
  /// Tet of Legendre functions: the polynomials of which the modes' gradients are sums.
  CollapsedBasis collapsed;
  /// Tet: the gradient of every mode, by its coefficients in `collapsed` if that has tables, or else at every point.
  std::vector<Vec3> gradients;
  /// Prism: each mode's function of the triangle, and the derivatives along u and v and the value of each of these
  /// functions at every point of a layer.
  std::vector<std::size_t> triangle_function;
  std::vector<Vec3> triangle_functions;
  std::size_t num_triangle_functions = 0;
  std::vector<std::array<double, 6>> products;  ///< per mode: mean of d_c N d_d N, by kDirectionPairs

  std::vector<std::array<Index, kSimdLanes>> batches;  ///< cell numbers; the last batch is padded with repeats
  std::vector<int> active;                             ///< number of cells in each batch without padding
  std::vector<Index> nodes;                            ///< by batch, mode, lane; kNoIndex: the cell has no such mode
  std::vector<std::int8_t> signs;
  std::size_t local_begin = 0;      ///< where this group begins in the energy's `local_`
  std::vector<Wide> to_reference;   ///< A^-1: 9 per batch; if `by_point`, 9 per batch and point
  std::vector<Wide> point_weights;  ///< one per batch and point; empty: all 1
  bool by_point = false;
  std::vector<Narrow> frozen;         ///< `frozen_size` entries per batch and point
  std::vector<Narrow> frozen_hinges;  ///< 9 per batch and point; empty: there is no hinge
  std::vector<Wide> mean_blocks;      ///< 54 per batch: sum of `add_blocks` over its points

  std::size_t num_points() const { return weights.size(); }
  /// Weight of point q in the mean over each cell of the batch.
  Wide weight(std::size_t batch, std::size_t q) const {
    return weights[q] * (point_weights.empty() ? Wide{} + 1.0 : point_weights[batch * num_points() + q]);
  }
  const Wide* reference(std::size_t batch, std::size_t q) const {
    return to_reference.data() + 9 * (by_point ? batch * num_points() + q : batch);
  }
  std::size_t mode_number(const LocalMode& mode) const {
    if (kind == CellKind::hex) return (mode.k * (order + 1) + mode.j) * (order + 1) + mode.i;
    return std::lower_bound(modes.begin(), modes.end(), mode) - modes.begin();
  }
  /// Fills the quadrature points and weights, and the values and gradients of the functions there.
  void make_tables(Basis basis, QuadratureRule rule);

 private:
  struct LineProducts;
  LineProducts make_line(Basis basis, QuadratureRule rule);
  void make_hex_tables(const LineProducts& line);
  void make_prism_tables(Basis basis, QuadratureRule rule, const LineProducts& line);
  void make_tet_tables(Basis basis, QuadratureRule rule);
  void expand_gradients(Basis basis);
};

}  // namespace subvol::internal
