// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

namespace subvol::internal {

/// Solves a small linear system in the least-squares sense: of all x with the least |A x - b|, the one of least norm.
///
/// matrix   A, any shape, of any rank.
/// right    b, as many entries as A has rows.
/// returns  as many entries as A has columns; not finite if the input is not.
/// Cost: cubic. Eigen's decomposition is compiled here only, because that takes long.
Eigen::VectorXd least_norm_solution(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& right);

}  // namespace subvol::internal
