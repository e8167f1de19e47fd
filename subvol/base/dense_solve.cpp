// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/dense_solve.h"

#include <Eigen/QR>

namespace subvol::internal {

Eigen::VectorXd least_norm_solution(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& right) {
  return matrix.completeOrthogonalDecomposition().solve(right);
}

}  // namespace subvol::internal
