// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/solver/anderson.h"

#include "subvol/fit/solver/vector_math.h"

#include <Eigen/QR>

#include <algorithm>
#include <cmath>
#include <utility>

namespace subvol::internal {

namespace {

/// Replaces `before` by now - before.
void replace_by_difference(std::span<const Vec3> now, std::span<Vec3> before) {
#pragma omp parallel for schedule(static)
  for (std::size_t i = 0; i < now.size(); ++i) before[i] = now[i] - before[i];
}

}  // namespace

void AndersonMemory::clear() {
  last_ = {};
  history_.clear();
}

void AndersonMemory::add(std::span<const Vec3> x, std::span<const Vec3> f, std::span<const Vec3> g) {
  Difference oldest;  // its arrays are used again
  if (!last_.x.empty()) {
    if (history_.size() == kMostDifferences) {
      oldest = std::move(history_.front());
      history_.erase(history_.begin());
    }
    replace_by_difference(x, last_.x);
    replace_by_difference(f, last_.f);
    replace_by_difference(g, last_.g);
    history_.push_back(std::move(last_));
    last_ = std::move(oldest);
  }
  last_.x.assign(x.begin(), x.end());
  last_.f.assign(f.begin(), f.end());
  last_.g.assign(g.begin(), g.end());
}

bool AndersonMemory::find_step(std::vector<Vec3>& step) const {
  const auto m = static_cast<Eigen::Index>(history_.size());
  if (m == 0) return false;
  Eigen::MatrixXd products(m, m);
  Eigen::VectorXd right(m);
  for (Eigen::Index i = 0; i < m; ++i) {
    right[i] = dot(history_[i].x, last_.g);
    for (Eigen::Index j = 0; j < m; ++j) products(i, j) = dot(history_[i].x, history_[j].g);
  }
  // Differences grow shorter from step to step: they are brought to one size, so that none counts as rounding.
  Eigen::VectorXd scale(m);
  for (Eigen::Index i = 0; i < m; ++i) {
    if (!(std::abs(products(i, i)) > 0)) return false;
    scale[i] = 1 / std::sqrt(std::abs(products(i, i)));
  }
  products = (scale.asDiagonal() * products * scale.asDiagonal()).eval();
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> solver(products);
  if (!solver.isInvertible()) return false;
  const Eigen::VectorXd gamma = scale.asDiagonal() * solver.solve(scale.asDiagonal() * right);
  if (!gamma.allFinite()) return false;
  step = last_.f;
  for (Eigen::Index j = 0; j < m; ++j) {
    add_scaled(-gamma[j], history_[j].x, step);
    add_scaled(-gamma[j], history_[j].f, step);
  }
  return true;
}

}  // namespace subvol::internal
