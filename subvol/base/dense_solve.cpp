// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/dense_solve.h"

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/QR>
#include <Eigen/SparseCore>

namespace subvol::internal {

Eigen::VectorXd least_norm_solution(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& right) {
  if (matrix.size() == 0) return Eigen::VectorXd::Zero(matrix.cols());
  return matrix.completeOrthogonalDecomposition().solve(right);
}

Eigen::VectorXd least_norm_solution(const std::vector<MatrixEntry>& entries, const Eigen::VectorXd& right) {
  constexpr Eigen::Index kMostDense = 300;  // a tenth of a second
  constexpr double kTolerance = 1e-12;      // relative residual
  const Eigen::Index n = right.size();
  if (n <= kMostDense) {
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(n, n);
    for (const MatrixEntry& entry : entries) matrix(entry.row, entry.column) += entry.value;
    return least_norm_solution(matrix, right);
  }
  std::vector<Eigen::Triplet<double>> triplets;
  triplets.reserve(entries.size());
  for (const MatrixEntry& entry : entries) triplets.emplace_back(entry.row, entry.column, entry.value);
  Eigen::SparseMatrix<double> matrix(n, n);
  matrix.setFromTriplets(triplets.begin(), triplets.end());
  // From 0, the least-squares method of conjugate gradients stays in the row space: its limit has the least norm.
  Eigen::LeastSquaresConjugateGradient<Eigen::SparseMatrix<double>, Eigen::IdentityPreconditioner> solver(matrix);
  solver.setTolerance(kTolerance);
  solver.setMaxIterations(n);
  return solver.solve(right);
}

}  // namespace subvol::internal
