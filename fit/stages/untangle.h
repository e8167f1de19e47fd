// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/solver/fit_problem.h"
#include "subvol/fit/stages/fit_report.h"
#include "subvol/fit/stages/stage_runner.h"
#include "subvol/fit/tuning/optimize_tuning.h"

#include <cstddef>
#include <vector>

namespace subvol::internal {

struct UntangleOptions {
  double tangential_weight = 0;  ///< weight in the problem's surface term, for the report
  int max_rounds = 40;           ///< largest number of solves of a few Newton steps, each with its own epsilon
  int patience = 6;              ///< number of rounds in a row without a gain after which the work ends
  OptimizeTuning tuning{};       ///< how epsilon falls
};

struct UntangleResult {
  bool going = true;               ///< false: the caller or the time limit ended the work; the report says which
  std::vector<Index> uncertified;  ///< cells that are not certified at the end, ascending
};

/// Minimizes E = E_S + lambda E_W with the regularized barrier (`regularized_barrier.h`) in rounds that adapt epsilon
/// to the worst determinant, until every cell is certified. Cells that are positive at their quadrature points but not
/// certified get more points; cells that still fail when a round has nearly stopped decreasing E get more weight.
///
/// problem   its volume term is a RegularizedTerm of `num_cells` cells; on return, its regularization is off.
/// record    name, level and cells of the reported stages, one per round.
/// x         any finite start; receives the result, certified or not.
/// A round counts as a gain if fewer cells fail than in any round before or the worst determinant rises.
UntangleResult untangle(FitProblem& problem, std::size_t num_cells, const UntangleOptions& options,
                        const StageRunner& runner, const StageRecord& record, std::vector<Vec3>& x, FitReport& report);

}  // namespace subvol::internal
