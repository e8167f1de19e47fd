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
    const std::size_t lines = static_cast<std::size_t>(m_) * m_ * n_ * 6, planes = num_planes();
    lines_ = std::make_unique_for_overwrite<Wide[]>(lines);
    planes_ = std::make_unique_for_overwrite<Wide[]>(planes);
    plane_sums_ = std::make_unique_for_overwrite<Wide[]>(planes);
  }

  static constexpr int kAtOnce = 2;

  void load(std::size_t batch, std::span<const Vec3> nodes);

  /// Calls op(q, count, J) for all points, up to kAtOnce at a time: q, q + 1, ... with the 9 entries of J = dx/du for
  /// each. With kBack, op leaves there what is summed into the coefficients: out_a = sum_q J_q grad N_a(q).
  template <bool kBack, class Op>
  void run_several(Op&& op) {
    if (group_.kind == CellKind::hex)
      run_tensor<kBack>(op);
    else
      run_dense<kBack>(op);
  }

  /// The same point by point with op(q, J), and no sums.
  template <class Op>
  void run(Op&& op) {
    run_several<false>([&](std::size_t first, int count, const Wide (*j)[9]) {
      for (int n = 0; n < count; ++n) op(first + n, j[n]);
    });
  }

  /// Calls op(place, J) for all points, in the order of `CellGroup::frozen_place`, and sums as with kBack: what a column
  /// of points needs stays in the fastest cache.
  template <class Op>
  void run_columns(Op&& op) {
    if (group_.kind != CellKind::hex)
      return run_dense<true>([&](std::size_t first, int count, Wide (*j)[9]) {
        for (int n = 0; n < count; ++n) op(first + n, j[n]);
      });
    to_lines();
    to_planes();
    const std::size_t plane = static_cast<std::size_t>(n_) * n_;
    for (std::size_t column = 0; column < plane; ++column) {
      for (int k = 0; k < m_; ++k) std::fill_n(&plane_sums_[9 * (k * plane + column)], 9, Wide{});
      for (int q3 = 0; q3 < n_; ++q3) {
        Wide j[9] = {};
        from_column(q3, column, j);
        op(column * n_ + q3, j);
        to_column(q3, column, j);
      }
    }
    from_planes();
    from_lines();
  }

  const std::vector<Wide>& coefficients() const { return coefficients_; }

 private:
  std::size_t num_planes() const { return static_cast<std::size_t>(m_) * n_ * n_ * 9; }

  /// J at point q3 of a column, from the planes; and back into their sums.
  void from_column(int q3, std::size_t column, Wide* j) const {
    const double *v = &group_.values[q3 * m_], *d = &group_.derivatives[q3 * m_];
    for (int k = 0; k < m_; ++k) {
      const Wide* b = &planes_[9 * (static_cast<std::size_t>(k) * n_ * n_ + column)];
      for (int r = 0; r < 3; ++r) {
        j[3 * r] += v[k] * b[r];
        j[3 * r + 1] += v[k] * b[3 + r];
        j[3 * r + 2] += d[k] * b[6 + r];
      }
    }
  }
  void to_column(int q3, std::size_t column, const Wide* j) {
    const double *v = &group_.values[q3 * m_], *d = &group_.derivatives[q3 * m_];
    for (int k = 0; k < m_; ++k) {
      Wide* b = &plane_sums_[9 * (static_cast<std::size_t>(k) * n_ * n_ + column)];
      for (int r = 0; r < 3; ++r) {
        b[r] += v[k] * j[3 * r];
        b[3 + r] += v[k] * j[3 * r + 1];
        b[6 + r] += d[k] * j[3 * r + 2];
      }
    }
  }

  template <bool kBack, class Op>
  void run_dense(Op&& op) {
    const std::size_t num_modes = group_.num_modes;
    std::vector<Wide>& sums = dense_sums_;
    if constexpr (kBack) sums.assign(coefficients_.size(), Wide{});
    const std::size_t num_points = group_.num_points();
    for (std::size_t first = 0; first < num_points; first += kAtOnce) {
      const int count = static_cast<int>(std::min<std::size_t>(kAtOnce, num_points - first));
      Wide j[kAtOnce][9] = {};
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

  /// One direction at a time: coefficients (k, j, i) -> lines (k, j, q1) -> planes (k, q2, q1) -> points.
  template <bool kBack, class Op>
  void run_tensor(Op&& op) {
    to_lines();
    to_planes();
    if constexpr (kBack) std::fill_n(plane_sums_.get(), num_planes(), Wide{});
    const std::size_t plane = static_cast<std::size_t>(n_) * n_;
    for (int q3 = 0; q3 < n_; ++q3)
      for (std::size_t first = 0; first < plane; first += kAtOnce) {
        const int count = static_cast<int>(std::min<std::size_t>(kAtOnce, plane - first));
        Wide j[kAtOnce][9] = {};
        for (int n = 0; n < count; ++n) from_column(q3, first + n, j[n]);
        op(q3 * plane + first, count, j);
        if constexpr (kBack)
          for (int n = 0; n < count; ++n) to_column(q3, first + n, j[n]);
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

  void from_planes();

  void from_lines();

  const CellGroup& group_;
  int m_, n_;
  std::vector<Wide> coefficients_, dense_sums_;
  std::unique_ptr<Wide[]> lines_, planes_, plane_sums_;  // hex: not filled with zeros first
};

}  // namespace subvol
