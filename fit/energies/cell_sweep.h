// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/energies/cell_group.h"

#include <algorithm>
#include <memory>
#include <span>
#include <vector>

namespace subvol::internal {

/// Maps the coefficients of one batch to the Jacobians at its points, and back. Holds the work space of one thread.
class CellSweep {
 public:
  explicit CellSweep(const CellGroup& group)
      : group_(group), m_(group.order + 1), n_(group.points_per_direction), coefficients_(3 * group.num_modes) {
    if (group.kind != CellKind::hex) {
      sums_.resize(coefficients_.size());
      layer_.resize(is_collapsed() ? 9 * group.collapsed.num_pairs() : 6 * group.num_triangle_functions);
      layer_sums_.resize(layer_.size());
      if (!is_collapsed()) return;
      expansion_.resize(9 * group.collapsed.num_functions());
      row_.resize(9 * m_);
      points_ = std::make_unique_for_overwrite<Wide[][9]>(n_);
      return;
    }
    const std::size_t lines = static_cast<std::size_t>(m_) * m_ * n_ * 6, planes = 9 * m_ * num_columns();
    lines_ = std::make_unique_for_overwrite<Wide[]>(lines);
    planes_ = std::make_unique_for_overwrite<Wide[]>(planes);
    plane_sums_ = std::make_unique_for_overwrite<Wide[]>(planes);
    points_ = std::make_unique_for_overwrite<Wide[][9]>(kColumnsPerChunk * n_);
  }

  void load(std::size_t batch, std::span<const Vec3> nodes);

  /// Calls op(first, count, J) for all points in chunks, where J[n] holds the 9 entries of dx/du at point first + n.
  /// With kBack, op overwrites J, and the result is summed into the coefficients: out_a = sum_q J_q grad N_a(q).
  template <bool kBack, class Op>
  void run(Op&& op) {
    if (group_.kind == CellKind::hex)
      run_tensor<kBack>(op);
    else if (group_.kind == CellKind::prism)
      run_layers<kBack>(op);
    else if (is_collapsed())
      run_collapsed<kBack>(op);
    else
      run_dense<kBack>(op);
  }

  const std::vector<Wide>& coefficients() const { return coefficients_; }

 private:
  /// Number of columns of a hex, or of points of another cell, per chunk: two, so that kernels can work on pairs.
  static constexpr int kColumnsPerChunk = 2, kPointsPerChunk = 2;

  bool is_collapsed() const { return group_.collapsed.degree >= 0; }
  std::size_t num_columns() const { return static_cast<std::size_t>(n_) * n_; }
  std::size_t plane_place(int k, std::size_t column) const { return 9 * (k * num_columns() + column); }

  template <bool kBack, class Op>
  void run_dense(Op&& op) {
    if constexpr (kBack) std::fill(sums_.begin(), sums_.end(), Wide{});
    const std::size_t num_points = group_.num_points();
    for (std::size_t first = 0; first < num_points; first += kPointsPerChunk) {
      const bool all = first + kPointsPerChunk <= num_points;
      Wide j[kPointsPerChunk][9];
      all ? to_dense<kPointsPerChunk>(first, j) : to_dense<1>(first, j);
      op(first, all ? kPointsPerChunk : 1, j);
      if constexpr (kBack) all ? from_dense<kPointsPerChunk>(first, j) : from_dense<1>(first, j);
    }
    if constexpr (kBack) coefficients_.swap(sums_);
  }

  /// Works on one direction at a time: coefficients -> polynomials (i, j, k) -> a layer's (i, j) -> a row's (i) ->
  /// points.
  template <bool kBack, class Op>
  void run_collapsed(Op&& op) {
    expand();
    if constexpr (kBack) std::fill(sums_.begin(), sums_.end(), Wide{});
    if constexpr (kBack) expansion_sums_.assign(expansion_.size(), Wide{});
    std::size_t first = 0;
    for (const CollapsedBasis::Layer& layer : group_.collapsed.layers) {
      to_collapsed_layer(layer);
      if constexpr (kBack) std::fill(layer_sums_.begin(), layer_sums_.end(), Wide{});
      for (const CollapsedBasis::Row& row : layer.rows) {
        to_row(row);
        op(first, row.num_points, points_.get());
        if constexpr (kBack) from_row(row);
        first += row.num_points;
      }
      if constexpr (kBack) from_collapsed_layer(layer);
    }
    if constexpr (kBack) {
      collect();
      coefficients_.swap(sums_);
    }
  }

  /// Works on one layer of a prism's points at a time: coefficients -> functions of the triangle -> points.
  template <bool kBack, class Op>
  void run_layers(Op&& op) {
    if constexpr (kBack) std::fill(sums_.begin(), sums_.end(), Wide{});
    const std::size_t size = group_.num_points() / n_;
    for (int layer = 0; layer < n_; ++layer) {
      to_layer(layer);
      if constexpr (kBack) std::fill(layer_sums_.begin(), layer_sums_.end(), Wide{});
      for (std::size_t first = 0; first < size; first += kPointsPerChunk) {
        const bool all = first + kPointsPerChunk <= size;
        Wide j[kPointsPerChunk][9];
        all ? to_triangle<kPointsPerChunk>(first, j) : to_triangle<1>(first, j);
        op(layer * size + first, all ? kPointsPerChunk : 1, j);
        if constexpr (kBack) all ? from_triangle<kPointsPerChunk>(first, j) : from_triangle<1>(first, j);
      }
      if constexpr (kBack) from_layer(layer);
    }
    if constexpr (kBack) coefficients_.swap(sums_);
  }

  /// Works on one direction at a time: coefficients (k, j, i) -> lines (k, j, q1) -> planes (k, q2, q1) -> points. The
  /// points are made column by column, so that the data of a column stays in the fastest cache.
  template <bool kBack, class Op>
  void run_tensor(Op&& op) {
    to_lines();
    to_planes();
    for (std::size_t column = 0; column < num_columns(); column += kColumnsPerChunk) {
      const int count = static_cast<int>(std::min<std::size_t>(kColumnsPerChunk, num_columns() - column));
      for (int c = 0; c < count; ++c) to_points(column + c, points_.get() + c * n_);
      op(column * n_, count * n_, points_.get());
      if constexpr (kBack)
        for (int c = 0; c < count; ++c) from_points(column + c, points_.get() + c * n_);
    }
    if constexpr (kBack) {
      from_planes();
      from_lines();
    }
  }

  /// Fills layer_: for each function of the triangle, its coefficient's value, then its derivative along w.
  void to_layer(int layer);
  void from_layer(int layer);

  /// `to_triangle` computes J at kCount points of the layer; `from_triangle` sums back into its functions.
  template <int kCount>
  void to_triangle(std::size_t first, Wide (*j)[9]) const;
  template <int kCount>
  void from_triangle(std::size_t first, const Wide (*j)[9]);

  /// `expand` fills expansion_: for each polynomial of `collapsed`, the coefficients of the 9 entries of J. `collect`
  /// sums back into the modes.
  void expand();
  void collect();
  /// Fills layer_ with the coefficients of A_i B_ij in a layer.
  void to_collapsed_layer(const CollapsedBasis::Layer& layer);
  void from_collapsed_layer(const CollapsedBasis::Layer& layer);
  /// Fills points_ with J at the points of a row of the layer.
  void to_row(const CollapsedBasis::Row& row);
  void from_row(const CollapsedBasis::Row& row);

  /// `to_dense` computes J at kCount points of a tet; `from_dense` sums back into its modes.
  template <int kCount>
  void to_dense(std::size_t first, Wide (*j)[9]) const;
  template <int kCount>
  void from_dense(std::size_t first, const Wide (*j)[9]);

  /// Fills lines_: values, then derivatives along u.
  void to_lines();

  /// Fills planes_: derivatives along u, derivatives along v, values.
  void to_planes();

  /// `to_points` computes J at the points of a column; `from_points` sums back into its planes.
  void to_points(std::size_t column, Wide (*j)[9]) const;
  void from_points(std::size_t column, const Wide (*j)[9]);

  void from_planes();

  void from_lines();

  const CellGroup& group_;
  int m_, n_;
  std::vector<Wide> coefficients_, sums_;                // sums_: prism, tet
  std::vector<Wide> layer_, layer_sums_;                 // prism, collapsed tet
  std::vector<Wide> expansion_, expansion_sums_, row_;   // collapsed tet
  std::unique_ptr<Wide[]> lines_, planes_, plane_sums_;  // hex: not initialized with zeros
  std::unique_ptr<Wide[][9]> points_;                    // hex, collapsed tet
};

}  // namespace subvol::internal
