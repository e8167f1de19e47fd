// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/cell_group.h"

#include <algorithm>
#include <memory>
#include <span>
#include <vector>

namespace subvol {

/// Takes the coefficients of one batch to the Jacobians at its points, and back: the work space of one thread.
class CellSweep {
 public:
  explicit CellSweep(const CellGroup& group)
      : group_(group), m_(group.order + 1), n_(group.points_per_direction), coefficients_(3 * group.num_modes) {
    if (group.kind != CellKind::hex) return;
    const std::size_t lines = static_cast<std::size_t>(m_) * m_ * n_ * 6, planes = 9 * m_ * num_columns();
    lines_ = std::make_unique_for_overwrite<Wide[]>(lines);
    planes_ = std::make_unique_for_overwrite<Wide[]>(planes);
    plane_sums_ = std::make_unique_for_overwrite<Wide[]>(planes);
    points_ = std::make_unique_for_overwrite<Wide[][9]>(kColumns * n_);
  }

  void load(std::size_t batch, std::span<const Vec3> nodes);

  /// Calls op(first, count, J) for all points, some at a time: first, first + 1, ... with the 9 entries of J = dx/du
  /// for each. With kBack, op leaves there what is summed into the coefficients: out_a = sum_q J_q grad N_a(q).
  template <bool kBack, class Op>
  void run(Op&& op) {
    if (group_.kind == CellKind::hex)
      run_tensor<kBack>(op);
    else
      run_dense<kBack>(op);
  }

  const std::vector<Wide>& coefficients() const { return coefficients_; }

 private:
  /// Columns of a hex, and points of other cells, at once: two, so that kernels find pairs.
  static constexpr int kColumns = 2, kPoints = 2;

  std::size_t num_columns() const { return static_cast<std::size_t>(n_) * n_; }
  std::size_t plane_place(int k, std::size_t column) const { return 9 * (k * num_columns() + column); }

  template <bool kBack, class Op>
  void run_dense(Op&& op) {
    const std::size_t num_modes = group_.num_modes;
    std::vector<Wide>& sums = dense_sums_;
    if constexpr (kBack) sums.assign(coefficients_.size(), Wide{});
    const std::size_t num_points = group_.num_points();
    for (std::size_t first = 0; first < num_points; first += kPoints) {
      const int count = static_cast<int>(std::min<std::size_t>(kPoints, num_points - first));
      Wide j[kPoints][9] = {};
      for (int n = 0; n < count; ++n) {
        const Vec3* gradients = group_.gradients.data() + (first + n) * num_modes;
        for (std::size_t a = 0; a < num_modes; ++a)
          for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 3; ++c) j[n][3 * r + c] += gradients[a][c] * coefficients_[3 * a + r];
      }
      op(first, count, j);
      if constexpr (kBack)
        for (int n = 0; n < count; ++n) {
          const Vec3* gradients = group_.gradients.data() + (first + n) * num_modes;
          for (std::size_t a = 0; a < num_modes; ++a)
            for (int r = 0; r < 3; ++r)
              sums[3 * a + r] += gradients[a][0] * j[n][3 * r] + gradients[a][1] * j[n][3 * r + 1] +
                                 gradients[a][2] * j[n][3 * r + 2];
        }
    }
    if constexpr (kBack) coefficients_.swap(sums);
  }

  /// One direction at a time: coefficients (k, j, i) -> lines (k, j, q1) -> planes (k, q2, q1) -> points, column by
  /// column: what a column needs stays in the fastest cache.
  template <bool kBack, class Op>
  void run_tensor(Op&& op) {
    to_lines();
    to_planes();
    for (std::size_t column = 0; column < num_columns(); column += kColumns) {
      const int count = static_cast<int>(std::min<std::size_t>(kColumns, num_columns() - column));
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

  /// lines: values along u, then derivatives.
  void to_lines();

  /// planes: derivatives along u, along v, values.
  void to_planes();

  /// J at the points of a column; and back into the sums of its planes.
  void to_points(std::size_t column, Wide (*j)[9]) const;
  void from_points(std::size_t column, const Wide (*j)[9]);

  void from_planes();

  void from_lines();

  const CellGroup& group_;
  int m_, n_;
  std::vector<Wide> coefficients_, dense_sums_;
  std::unique_ptr<Wide[]> lines_, planes_, plane_sums_;  // hex: not filled with zeros first
  std::unique_ptr<Wide[][9]> points_;
};

}  // namespace subvol
