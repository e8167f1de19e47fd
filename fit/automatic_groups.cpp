// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/automatic_groups.h"

#include "subvol/base/error.h"
#include "subvol/fit/automatic_trials.h"
#include "subvol/fit/features/feature_curves.h"
#include "subvol/fit/target/carried_groups.h"
#include "subvol/mesh/mesh_topology.h"

#include <algorithm>
#include <string>
#include <utility>

namespace subvol::internal {

namespace {

/// Share of the whole progress that a first fit takes if a second one may follow.
constexpr double kFirstShare = 0.6;

/// Returns the options of one of two fits, whose progress goes from one share to another.
AutomaticFitOptions with_progress(AutomaticFitOptions options, double from, double to) {
  if (options.control.progress)
    options.control.progress = [tell = options.control.progress, from, to](FitProgress progress) {
      progress.fraction = from + (to - from) * progress.fraction;
      return tell(progress);
    };
  return options;
}

/// Adds the trials, stages and seconds of a fit to those of another one, before or after its own.
void add(AutomaticFitResult& result, const AutomaticFitResult& other, bool before) {
  const auto put = [before](auto& list, const auto& others) {
    list.insert(before ? list.begin() : list.end(), others.begin(), others.end());
  };
  put(result.trials, other.trials);
  if (before) result.chosen += other.trials.size();
  const std::size_t first = before ? 0 : result.report.stages.size();
  put(result.report.stages, other.report.stages);
  result.report.undo_stages(first, first + other.report.stages.size());
  for (std::size_t i = 0; i < std::min(result.report.seconds.size(), other.report.seconds.size()); ++i)
    result.report.seconds[i].second += other.report.seconds[i].second;
}

/// Returns what missed groups add to the merit of a trial: ten of them weigh as much as a fifth of the quality aimed
/// at.
double cost_of_missed(std::size_t groups) {
  constexpr double kMissedGroupCost = 0.1, kMostMissedGroupsCost = 1;
  return std::min(kMostMissedGroupsCost, kMissedGroupCost * static_cast<double>(groups));
}

/// Returns true if a result is to be preferred to another one that misses so many groups.
bool is_preferred(const TriangleMesh& target, const AutomaticFitResult& result, const AutomaticFitResult& other,
                  std::size_t missed_by_other, const AutomaticTuning& tuning) {
  if (result.trials.empty() || !is_valid(result.trials[result.chosen])) return false;
  const std::size_t missed = num_groups_missed(target, result.mesh);
  if (missed >= missed_by_other) return false;
  const AutomaticFitTrial& trial = result.trials[result.chosen];
  return is_good_enough(trial, tuning) ||
         trial.merit + cost_of_missed(missed) <= other.trials[other.chosen].merit + cost_of_missed(missed_by_other);
}

}  // namespace

bool has_smooth_borders(const TriangleMesh& target, double angle_degrees) {
  const std::vector<std::array<Index, 2>> borders = group_borders(target, target);
  if (borders.empty()) return false;
  const auto num_edges = [](const FeatureCurves& curves) {
    std::size_t count = 0;
    for (const FeatureCurve& curve : curves.curves) count += curve.points.size() - 1;
    return count;
  };
  return num_edges(feature_curves(target, angle_degrees, borders)) > num_edges(feature_curves(target, angle_degrees));
}

std::size_t num_groups_missed(const TriangleMesh& target, const VolumeMesh& mesh) {
  const MeshTopology topology(mesh);
  const CurvedBoundary boundary = linear_boundary(mesh, topology);
  const std::vector<Index> carried = carried_groups(target, boundary, topology.boundary_faces().size());
  return warnings_of_groups(areas_of_groups(target, boundary, carried)).size();
}

AutomaticFitResult fit_for_groups(const TriangleMesh& target, const AutomaticFitOptions& options,
                                  const GroupedFit& fit) {
  AutomaticFitResult first = fit(false, with_progress(options, 0, kFirstShare));
  if (ended_early(first.report.stop_reason)) return first;
  const std::size_t missed = num_groups_missed(target, first.mesh);
  if (missed == 0) return first;
  AutomaticFitOptions left = with_progress(options, kFirstShare, 1);
  left.keeps_groups = true;
  if (options.control.time_limit_seconds > 0)
    left.control.time_limit_seconds =
        std::max(1e-3, options.control.time_limit_seconds - first.report.seconds.front().second);
  AutomaticFitResult second;
  try {
    second = fit(true, left);
  } catch (const InputError& error) {  // no grid that follows the borders has the topology
    first.report.warnings.push_back(std::string("borders between groups are not followed: ") + error.what());
    return first;
  }
  if (is_preferred(target, second, first, missed, options.tuning.automatic)) {
    add(second, first, true);
    return second;
  }
  if (second.report.stop_reason == StopReason::cancelled) {
    first.report.stop_reason = StopReason::cancelled;
    first.report.explanation = second.report.explanation;
  }
  add(first, second, false);
  return first;
}

}  // namespace subvol::internal
