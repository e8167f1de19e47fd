// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include <vector>

namespace subvol::internal {

/// Solves a small linear system in the least-squares sense: of all x with the least |A x - b|, the one of least norm.
///
/// matrix   A, any shape, of any rank.
/// right    b, as many entries as A has rows.
/// returns  as many entries as A has columns; not finite if the input is not.
/// Cost: cubic. Eigen's decomposition is compiled here only, because that takes long.
Eigen::VectorXd least_norm_solution(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& right);

/// An entry of a sparse matrix; those of one place are added up.
struct MatrixEntry {
  Eigen::Index row, column;
  double value;
};

/// Solves a square system of any size in the same sense: as above if it is small; else with the method of conjugate
/// gradients on the normal equations, up to a relative residual of these of 1e-12, or as near as it comes in as many
/// steps as there are unknowns. Callers that need more accuracy repeat it with what is left.
///
/// entries  of A, with rows and columns below the size of `right`.
Eigen::VectorXd least_norm_solution(const std::vector<MatrixEntry>& entries, const Eigen::VectorXd& right);

}  // namespace subvol::internal
