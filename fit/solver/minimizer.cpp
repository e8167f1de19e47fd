// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/solver/minimizer.h"

#include "subvol/base/error.h"
#include "subvol/fit/solver/fit_problem.h"

#include <algorithm>
#include <iterator>
#include <string>

namespace subvol::internal {

namespace {

void cancel(MinimizerResult& result) {
  result.stop = MinimizerStop::cancelled;
  result.explanation = "stopped by the caller";
}

}  // namespace

std::vector<Index> newly_failed(const std::vector<Index>& before, const std::vector<Index>& now) {
  std::vector<Index> result;
  std::set_difference(now.begin(), now.end(), before.begin(), before.end(), std::back_inserter(result));
  return result;
}

bool has_ended(const MinimizerOptions& options, MinimizerResult& result) {
  if (!options.ended || !options.ended()) return false;
  cancel(result);
  return true;
}

bool record_step(const IterationRecord& record, const MinimizerOptions& options, MinimizerResult& result) {
  result.iterations.push_back(record);
  if (!options.progress || options.progress(record)) return true;
  cancel(result);
  return false;
}

void densify_again(FitProblem& problem, const MinimizerResult& result) {
  if (result.densified.empty()) return;
  if (result.densified_at.size() != problem.nodes.num_cols)
    throw InputError("cells were densified at a state of " + std::to_string(result.densified_at.size()) +
                     " unknowns, expected " + std::to_string(problem.nodes.num_cols));
  std::vector<Vec3> nodes(problem.nodes.num_rows());
  problem.apply_nodes(result.densified_at, nodes);
  for (const std::vector<Index>& cells : result.densified) problem.volume->densify(cells, nodes);
}

}  // namespace subvol::internal
