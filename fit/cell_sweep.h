// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/cell_group.h"

#include <algorithm>
#include <span>
#include <vector>

namespace subvol {

/// Takes the coefficients of one batch to the Jacobians at its points, and back: the work space of one thread.
class CellSweep {
 public:
  explicit CellSweep(const CellGroup& group)
      : group_(group), m_(group.order + 1), n_(group.points_per_direction), coefficients_(3 * group.num_modes) {
    if (group.kind != CellKind::hex) return;
    lines_.resize(static_cast<std::size_t>(m_) * m_ * n_ * 6);
    planes_.resize(static_cast<std::size_t>(m_) * n_ * n_ * 9);
    plane_sums_.resize(planes_.size());
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

  /// The same with op(q, J), point by point.
  template <bool kBack, class Op>
  void run(Op&& op) {
    run_several<kBack>([&](std::size_t first, int count, Wide (*j)[9]) {
      for (int n = 0; n < count; ++n) op(first + n, j[n]);
    });
  }

  const std::vector<Wide>& coefficients() const { return coefficients_; }

 private:
  template <bool kBack, class Op>
  void run_dense(Op&& op) {
    const std::size_t num_modes = group_.num_modes;
    std::vector<Wide>& sums = plane_sums_;
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
    if constexpr (kBack) std::fill(plane_sums_.begin(), plane_sums_.end(), Wide{});
    const std::size_t plane = static_cast<std::size_t>(n_) * n_;
    for (int q3 = 0; q3 < n_; ++q3) {
      const double *v = &group_.values[q3 * m_], *d = &group_.derivatives[q3 * m_];
      for (std::size_t first = 0; first < plane; first += kAtOnce) {
        const int count = static_cast<int>(std::min<std::size_t>(kAtOnce, plane - first));
        Wide j[kAtOnce][9] = {};
        for (int n = 0; n < count; ++n)
          for (int k = 0; k < m_; ++k) {
            const Wide* b = &planes_[9 * (k * plane + first + n)];
            for (int r = 0; r < 3; ++r) {
              j[n][3 * r] += v[k] * b[r];
              j[n][3 * r + 1] += v[k] * b[3 + r];
              j[n][3 * r + 2] += d[k] * b[6 + r];
            }
          }
        op(q3 * plane + first, count, j);
        if constexpr (kBack)
          for (int n = 0; n < count; ++n)
            for (int k = 0; k < m_; ++k) {
              Wide* b = &plane_sums_[9 * (k * plane + first + n)];
              for (int r = 0; r < 3; ++r) {
                b[r] += v[k] * j[n][3 * r];
                b[3 + r] += v[k] * j[n][3 * r + 1];
                b[6 + r] += d[k] * j[n][3 * r + 2];
              }
            }
      }
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
  std::vector<Wide> coefficients_, lines_, planes_, plane_sums_;
};

}  // namespace subvol
