// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/template_fit.h"

#include "subvol/fit/automatic_trials.h"
#include "subvol/fit/features/followed_creases.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>
#include <vector>

namespace subvol {

using namespace internal;

AutomaticFitResult fit_template(const TriangleMesh& target, AutomaticFitOptions options, TemplateUse use) {
  constexpr double kLeastTime = 1e-3;  // seconds
  const auto begin = std::chrono::steady_clock::now();
  options.mean_tolerance_percent = std::max(options.mean_tolerance_percent, kTemplateMeanPercent);
  options.max_tolerance_percent = std::max(options.max_tolerance_percent, kTemplateMaxPercent);
  options.makes_cage = false;
  std::vector<std::size_t> counts(kTemplateCells.begin(), kTemplateCells.end());
  if (use == TemplateUse::curved_cells) counts.push_back(kCurvedEdgeCells);
  if (find_regions(target, options.regions)) counts = {kRegionTemplateCells};
  if (options.cells) counts = {*options.cells};
  std::optional<AutomaticFitResult> best;
  const double limit = options.control.time_limit_seconds;
  for (const std::size_t cells : counts) {
    const bool has_no_edges = best && !best->trials.empty() && best->trials[best->chosen].curves == 0;
    if (has_no_edges && cells > kTemplateCells.back()) break;
    options.cells = cells;
    if (limit > 0) {
      const std::chrono::duration<double> used = std::chrono::steady_clock::now() - begin;
      options.control.time_limit_seconds = std::max(kLeastTime, limit - used.count());
    }
    AutomaticFitResult made = fit_automatically(target, options);
    const StopReason reason = made.report.stop_reason;
    const bool is_ended = reason != StopReason::converged && reason != StopReason::tolerance_missed;
    const auto merit = [](const AutomaticFitResult& result) { return result.trials[result.chosen].merit; };
    const bool is_made = !made.trials.empty();
    if (!best || (is_made && (best->trials.empty() || merit(made) < merit(*best)))) {
      best = std::move(made);
    } else if (reason == StopReason::cancelled) {
      best->report.stop_reason = reason;
      best->report.explanation = std::move(made.report.explanation);
    }
    if (is_ended || (is_made && is_good_enough(best->trials[best->chosen], options.tuning.automatic))) break;
  }
  if (best->mesh.num_cells() > 0) FollowedCreases().keep_from_folding(best->mesh);
  return std::move(*best);
}

}  // namespace subvol
