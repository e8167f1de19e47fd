// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/solver/anderson.h"
#include "subvol/fit/solver/fit_problem.h"
#include "subvol/fit/solver/minimizer.h"
#include "subvol/fit/solver/reduced_hessian.h"

#include <string>
#include <vector>

namespace subvol::internal {

/// The state that runs of Newton's method and of the Levenberg-Marquardt method have in common: the present values, the
/// trial that a search has found, and the step to it.
class MinimizerRun {
 protected:
  MinimizerRun(FitProblem& problem, std::vector<Vec3>& x, const MinimizerOptions& options);
  ~MinimizerRun() = default;

  /// Forgets all but x and the result, so that the minimization can be resumed from them, and hands these on.
  void restart();
  /// Takes t times the direction d_, whose energies are those of the trial.
  void take_step(double t, IterationRecord& record);
  /// Takes the step that follows from the last ones by Anderson acceleration instead, if `admits_step` returns true and
  /// E, with correspondences found anew, is not above that of the trial. Returns false otherwise.
  bool take_accelerated_step(double t, IterationRecord& record);
  /// Returns true if no cell stands in the way of a step of the nodes by dy_, to y_trial_.
  virtual bool admits_step(IterationRecord& record) = 0;
  /// Records the step. Returns true if E has stopped decreasing or the caller wants to stop.
  bool is_done(const IterationRecord& record);
  MinimizerResult end(MinimizerStop why, std::string explanation);

  FitProblem& problem_;
  std::vector<Vec3>& x_;
  const MinimizerOptions& options_;
  MinimizerResult result_{MinimizerStop::iteration_limit, "", {}};
  std::vector<Vec3> y_, z_;  // nodes and samples at x
  Linearization linearized_;
  AndersonMemory memory_;
  std::vector<Vec3> d_, dy_, dz_, y_trial_, z_trial_;
  bool is_assigned_ = false;  // true if the surface term's correspondences are those of z_
  std::vector<Mat3> inverse_diagonal_;
  std::vector<Index> uncertified_, trial_uncertified_;  // at y_, up to rounding, and at y_trial_
  double energy_ = 0, trial_ = 0, trial_surface_ = 0, trial_volume_ = 0;

 private:
  bool accepts_accelerated(IterationRecord& record);

  std::vector<Vec3> step_;
};

}  // namespace subvol::internal
