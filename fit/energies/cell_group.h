// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/elements/element_space.h"
#include "fit/elements/quadrature.h"
#include "fit/energies/frozen_distortion.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

namespace subvol {

/// Cells of one kind, order and quadrature, in batches of eight: the tables they share and what each batch has of its
/// own.
struct CellGroup {
  CellKind kind;
  int order, points_per_direction;
  std::vector<Vec3> points;  ///< hex: w fastest, then u, then v: column by column
  std::vector<double> weights;
  std::size_t num_modes = 0;
  std::vector<double> values, derivatives;  ///< hex: of the order + 1 line functions at every point of a line
  std::vector<LocalMode> modes;             ///< prism, tet: of any of the cells, ascending
  std::vector<Vec3> gradients;              ///< prism, tet: of every mode at every point
  std::vector<std::array<double, 6>> products;  ///< of every mode: mean of d_c N d_d N over the points, by kPairs

  std::vector<std::array<Index, kLanes>> batches;  ///< the last one is padded with repeats
  std::vector<int> active;                         ///< real cells of each batch
  std::vector<Index> nodes;                        ///< by batch, mode, lane; kNoIndex: the cell has no such mode
  std::vector<std::int8_t> signs;
  std::size_t local_begin = 0;                     ///< of the first batch in what the energy keeps of all groups
  std::vector<Wide> to_reference;  ///< A^-1: 9 per batch, or per point of each where cells have references
  std::vector<Wide> point_weights;                 ///< of every point of each batch; empty: all 1
  bool by_point = false;
  std::vector<Narrow> frozen;                      ///< `frozen_size` per point of every batch
  std::vector<Wide> mean_blocks;                   ///< 54 per batch: `add_blocks` over all points

  std::size_t num_points() const { return weights.size(); }
  /// Of a point in the mean over its cells.
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
  void make_tables(Basis basis, QuadratureRule rule);
};

}  // namespace subvol
