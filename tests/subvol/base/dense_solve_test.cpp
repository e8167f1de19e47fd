// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/dense_solve.h"

#include <catch2/catch.hpp>

#include <cmath>
#include <vector>

using namespace subvol::internal;

TEST_CASE("Large singular systems have the same least-norm solutions as small ones", "[dense_solve]") {
  // Rows of a third of the unknowns are empty; the right-hand side has entries there that nothing can meet.
  constexpr Eigen::Index kSize = 400, kUsed = 270;
  std::vector<MatrixEntry> entries;
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(kSize, kSize);
  const auto add = [&](Eigen::Index row, Eigen::Index column, double value) {
    entries.push_back({row, column, value});
    dense(row, column) += value;
  };
  Eigen::VectorXd right(kSize);
  for (Eigen::Index i = 0; i < kSize; ++i) right[i] = std::sin(static_cast<double>(i));
  for (Eigen::Index i = 0; i < kUsed; ++i) {
    add(i, i, 2);
    add(i, i, 1);  // two entries of one place
    add(i, (i + 1) % kUsed, -1);
    add((i + 1) % kUsed, i, -1);
  }
  CHECK((least_norm_solution(entries, right) - least_norm_solution(dense, right)).norm() < 1e-9);
  std::vector<MatrixEntry> small{{0, 0, 1}, {0, 1, 1}};
  CHECK((least_norm_solution(small, Eigen::Vector2d(2, 5)) - Eigen::Vector2d(1, 1)).norm() < 1e-12);
  CHECK(least_norm_solution(std::vector<MatrixEntry>{}, Eigen::VectorXd(0)).size() == 0);
}
