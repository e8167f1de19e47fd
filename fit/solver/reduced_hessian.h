// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/solver/fit_problem.h"
#include "subvol/fit/solver/minimizer.h"

#include <span>
#include <vector>

namespace subvol::internal {

/// Energy and gradient of a problem at a state, with the work space for them.
class Linearization {
 public:
  /// Finds the correspondences of the samples z, computes E, its gradient over the degrees of freedom, and the Hessians
  /// over nodes and samples (`ReducedHessian`). Returns E; if it is infinite, nothing else is valid.
  /// y, z           nodes and samples of the state.
  /// keeps_hessian  true: the Hessian over the nodes stays that of the call before, at a state nearby.
  /// is_assigned    true: the correspondences are those of z already (`SurfaceTerm::assign`).
  double linearize(FitProblem& problem, std::span<const Vec3> y, std::span<const Vec3> z, bool keeps_hessian = false,
                   bool is_assigned = false);
  std::span<const Vec3> gradient() const { return gradient_; }

 private:
  std::vector<Vec3> node_gradient_, sample_gradient_, from_samples_, gradient_;
};

/// The Hessian of E over the degrees of freedom, M^T H_W M + N^T H_S N, at the state of the last linearization, without
/// being formed; optionally with a diagonal added to it.
class ReducedHessian {
 public:
  explicit ReducedHessian(const FitProblem& problem);

  /// Returns the 3x3 diagonal blocks, or approximations (`VolumeTerm::add_diagonal_blocks`), without what was added.
  std::vector<Mat3> diagonal() const;
  /// Adds these values >= 0, one per degree of freedom, to the three diagonal entries of each. Empty: none.
  void add_diagonal(std::vector<double> added) { added_ = std::move(added); }
  /// out = H in.
  void multiply(std::span<const Vec3> in, std::span<Vec3> out);

 private:
  const FitProblem& problem_;
  std::vector<double> added_;
  std::vector<Vec3> node_in_, node_out_, sample_in_, sample_out_, from_samples_;
};

/// Returns the inverse blocks, 0 for those with no positive trace: vertices of no cell do not move. Of a block that is
/// not positive definite, the inverse is that of its trace times the identity.
///
/// projectors  P, one per block: the inverse is that of the block on the image of P, and 0 across it, so that the
///             directions of `conjugate_gradients` stay in the images. Empty: the identity for all.
std::vector<Mat3> inverse_blocks(std::span<const Mat3> blocks, std::span<const Mat3> projectors = {});

/// Solves H d = -g approximately by conjugate gradients, preconditioned by the inverse diagonal blocks, with
/// `cg_tolerance` and `cg_max_iterations`. Ends early if the caller asks for an end (`ended`).
/// d  receives the solution, one entry per degree of freedom.  returns the number of iterations.
int conjugate_gradients(ReducedHessian& hessian, std::span<const Mat3> inverse_diagonal, std::span<const Vec3> gradient,
                        const MinimizerOptions& options, std::vector<Vec3>& d);

}  // namespace subvol::internal
