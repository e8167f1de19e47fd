// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/subdivision_fit.h"

#include "subvol/base/error.h"
#include "subvol/base/format.h"
#include "subvol/fit/cage_fit.h"
#include "subvol/fit/energies/make_surface_term.h"
#include "subvol/fit/freed_mesh.h"
#include "subvol/fit/stages/stage_runner.h"
#include "subvol/fit/target/region_matching.h"
#include "subvol/subdivision/audit.h"

#include <algorithm>
#include <iterator>
#include <new>
#include <string>
#include <utility>
#include <vector>

namespace subvol {

using namespace internal;

namespace {

/// Drops warnings of a template that are not true of a mesh that was freed from its cage.
void drop_warnings(const std::vector<std::string>& dropped, FitReport& report) {
  std::erase_if(report.warnings,
                [&](const std::string& warning) { return std::ranges::find(dropped, warning) != dropped.end(); });
}

/// Adds seconds to those of the same part.
void add_seconds(const std::vector<std::pair<std::string, double>>& added, FitReport& report) {
  for (const auto& [part, seconds] : added) {
    const auto same = std::ranges::find(report.seconds, part, &std::pair<std::string, double>::first);
    if (same == report.seconds.end())
      report.seconds.emplace_back(part, seconds);
    else
      same->second += seconds;
  }
}

/// A fit whose finest mesh may be freed from its cage. If it stalls at a lower level, it goes on from the freed mesh of
/// that level.
class FreedFit {
 public:
  FreedFit(const TriangleMesh& target, const FitOptions& options)
      : target_(target), options_(options), clock_(options.control) {}
  FitResult run(const VolumeMesh& template_mesh);

 private:
  FitOptions part_until(double end);
  FitResult fit_and_free(const VolumeMesh& template_mesh, int levels_before);
  bool can_go_on(const FitResult& result) const;
  bool is_kept(const FitResult& next, const FitResult& result) const;
  void go_on(FitResult& result);

  const TriangleMesh& target_;
  const FitOptions& options_;
  StageRunner clock_;
  double done_ = 0;  ///< share of the work
};

/// Returns the options of the next part of the work.
/// end  share of the work that is done after it.
FitOptions FreedFit::part_until(double end) {
  constexpr double kLeastSeconds = 1e-3;  // 0 is no limit
  FitOptions part = options_;
  if (options_.control.progress)
    part.control.progress = [this, begin = done_, end](FitProgress progress) {
      progress.fraction = done_ = begin + (end - begin) * std::clamp(progress.fraction, 0.0, 1.0);
      return options_.control.progress(progress);
    };
  if (double& limit = part.control.time_limit_seconds; limit > 0)
    limit = std::max(kLeastSeconds, limit - clock_.seconds());
  return part;
}

/// Fits a template, and frees its mesh if that is good for the cells.
/// levels_before  number of levels of the fit whose mesh is the template.
FitResult FreedFit::fit_and_free(const VolumeMesh& template_mesh, int levels_before) {
  constexpr double kShareIfStalled = 0.3;  // of the work that is left, if more levels follow
  FitOptions options = part_until(1 - kShareOfFreeing * (1 - done_));
  options.levels -= levels_before;
  CageFit fit = fit_cage(FitTarget(target_), template_mesh, options, levels_before);
  FitResult& result = fit.result;
  if (options_.control.time_limit_seconds > 0 && !clock_.in_time("the freeing of the mesh", result.report))
    return std::move(result);
  const bool levels_follow = result.report.stop_reason == StopReason::stalled && result.level < options_.levels;
  free_mesh(target_, part_until(levels_follow ? done_ + kShareIfStalled * (1 - done_) : 1), fit.lifted, result);
  if (result.cage.num_cells() == 0) drop_warnings(audit(template_mesh).warnings, result.report);
  return std::move(result);
}

bool FreedFit::can_go_on(const FitResult& result) const {
  return result.report.stop_reason == StopReason::stalled && result.cage.num_cells() == 0 &&
         result.level < options_.levels && measure_state(result.mesh, target_).is_valid();
}

/// Returns true if a fit that went on from the mesh of another has the better result.
bool FreedFit::is_kept(const FitResult& next, const FitResult& result) const {
  if (next.mesh.num_cells() <= result.mesh.num_cells()) return false;
  const MeshState now = measure_state(next.mesh, target_), before = measure_state(result.mesh, target_);
  if (!now.is_valid() || now.is_farther_than(before, options_.tuning.quality.most_rise)) return false;
  const StopReason reason = next.report.stop_reason;
  const bool is_done = reason != StopReason::stalled && !ended_early(reason);
  return is_done || now.least_jacobian >= before.least_jacobian;
}

/// Fits the levels that are left, with a freed mesh as the template, and keeps the better of the two results.
void FreedFit::go_on(FitResult& result) {
  FitResult next = fit_and_free(result.mesh, result.level);
  FitReport& report = result.report;
  const bool kept = is_kept(next, result);
  const std::size_t first = report.stages.size();
  std::ranges::move(next.report.stages, std::back_inserter(report.stages));
  add_seconds(next.report.seconds, report);
  if (!kept) {
    report.undo_stages(first, report.stages.size());
    if (ended_early(next.report.stop_reason)) report.stop_reason = next.report.stop_reason;
    report.explanation +=
        formatted("; fitting the levels from %d on from that mesh gave nothing better: ", result.level + 1) +
        next.report.explanation;
    return;
  }
  drop_warnings(audit(result.mesh).warnings, next.report);
  drop_warnings(report.warnings, next.report);
  std::ranges::move(next.report.warnings, std::back_inserter(report.warnings));
  report.stop_reason = next.report.stop_reason;
  report.explanation +=
      formatted("; the levels from %d on were fitted from that mesh: ", result.level + 1) + next.report.explanation;
  report.creases = next.report.creases;
  result.level = next.level;
  result.cage = std::move(next.cage);
  result.mesh = std::move(next.mesh);
}

FitResult FreedFit::run(const VolumeMesh& template_mesh) {
  FitResult result = fit_and_free(template_mesh, 0);
  while (can_go_on(result)) {
    const int level = result.level;
    if (!clock_.in_time(formatted("level %d", level + 1), result.report)) break;
    try {
      go_on(result);
    } catch (const std::bad_alloc&) {
      result.report.stop_reason = StopReason::memory_limit;
      result.report.explanation += "; no memory was left to go on from that mesh";
    }
    if (result.level == level) break;
  }
  return result;
}

}  // namespace

FitResult fit_subdivision_volume(const TriangleMesh& target, const VolumeMesh& template_mesh,
                                 const FitOptions& options) {
  const MatchedTarget matched = matched_target(target, template_mesh, options.control.cancelled);
  FitOptions used = options;
  used.frees_mesh = options.frees_mesh && can_be_freed(template_mesh, options);
  if (matched.regions) return fit_cage(FitTarget(*matched.regions), template_mesh, used).result;
  const TriangleMesh& surface = matched.outer ? *matched.outer : target;
  FitResult result = used.frees_mesh ? FreedFit(surface, used).run(template_mesh)
                                     : fit_cage(FitTarget(surface), template_mesh, used).result;
  if (!matched.warning.empty()) result.report.warnings.insert(result.report.warnings.begin(), matched.warning);
  return result;
}

FitResult fit_subdivision_volume(const PointCloud& target, const VolumeMesh& template_mesh, const FitOptions& options) {
  if (options.crease_angle_degrees)
    throw InputError("FitOptions::crease_angle_degrees: points have no edges to be kept sharp");
  require_closest(options.correspondence);
  FitOptions used = options;
  used.frees_mesh = false;
  return fit_cage(FitTarget(target, options.point_weights), template_mesh, used).result;
}

}  // namespace subvol
