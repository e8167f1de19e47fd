// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/automatic_trials.h"

#include "subvol/base/format.h"
#include "subvol/base/option_checks.h"
#include "subvol/fit/stages/solve_control.h"
#include "subvol/fit/target/enclosed_volume.h"
#include "subvol/templates/auto_template.h"

#include <algorithm>
#include <cmath>

namespace subvol::internal {

AutomaticFitOptions checked_options(AutomaticFitOptions options) {
  constexpr double kLeastQuality = 0.1;  // aims below it are taken as this one: shares of the aim need a divisor
  const auto in_range = [](const char* name, double value, double low, double high) {
    require_in_range("AutomaticFitOptions", name, value, low, high);
  };
  in_range("quality", options.quality, 0, kMostQuality);
  if (options.crease_angle_degrees) in_range("crease_angle_degrees", *options.crease_angle_degrees, 0, 180);
  in_range("mean_tolerance_percent", options.mean_tolerance_percent, 1e-9, 100);
  in_range("max_tolerance_percent", options.max_tolerance_percent, 1e-9, 100);
  check_control("AutomaticFitOptions", options.control);
  in_range("levels", options.levels, 1, 6);
  if (options.cells) in_range("cells", static_cast<double>(*options.cells), kLeastTemplateCells, 1e9);
  options.quality = std::max(options.quality, kLeastQuality);
  return options;
}

double merit_of(const AutomaticFitTrial& trial, const AutomaticFitOptions& options) {
  const AutomaticTuning& tuning = options.tuning.automatic;
  const auto excess = [](double value, double aim) { return std::max(0.0, value / aim - 1); };
  const double least_acceptable = std::min(tuning.acceptable_quality, options.quality);
  const bool counts_misses = trial.feature_miss && trial.curves > 0;
  const double missed = counts_misses ? excess(trial.feature_miss->share, kAutomaticFeatureShare) : 0;
  const bool is_far_off =
      trial.long_edges_lost > 0 || trial.lost_feature || trial.solid_volume_percent > kFarOffSolidVolumePercent;
  return excess(trial.max_percent, options.max_tolerance_percent) +
         excess(trial.mean_percent, options.mean_tolerance_percent) + std::min(tuning.most_miss, missed) +
         std::min(tuning.most_miss, excess(trial.volume_percent, kAutomaticVolumePercent)) +
         std::min(tuning.most_miss, excess(trial.solid_volume_percent, kFarOffSolidVolumePercent)) +
         tuning.quality_weight * (1 - trial.least_share) +
         tuning.quality_weight * std::max(0.0, 1 - std::max(0.0, trial.least_scaled_jacobian) / least_acceptable) +
         tuning.edge_weight * (1 - trial.within_share) + (is_far_off ? tuning.far_off : 0) +
         (trial.self_intersections == std::size_t{0} ? 0 : tuning.not_valid) +
         (trial.uncertified > 0 ? tuning.not_valid : 0);
}

double volume_difference_percent(const TriangleMesh& boundary, const TargetSurface& target) {
  if (target.volume_source() != VolumeSource::signed_sum) return 0;
  return 100 * std::abs(signed_volume(boundary.positions, boundary.triangles) / target.volume() - 1);
}

double merit_if_relaxed(AutomaticFitTrial trial, const AutomaticFitOptions& options) {
  const double acceptable = std::min(options.tuning.automatic.acceptable_quality, options.quality);
  trial.self_intersections = 0;
  trial.least_scaled_jacobian = std::max(trial.least_scaled_jacobian, acceptable);
  trial.least_share = std::max(trial.least_share, acceptable / options.quality);
  return merit_of(trial, options);
}

bool is_valid(const AutomaticFitTrial& trial) {
  return trial.uncertified == 0 && trial.self_intersections == std::size_t{0};
}

bool meets_distances(const AutomaticFitTrial& trial, const AutomaticFitOptions& options) {
  return trial.max_percent <= options.max_tolerance_percent && trial.mean_percent <= options.mean_tolerance_percent;
}

bool is_good_enough(const AutomaticFitTrial& trial, const AutomaticTuning& tuning) {
  const double excused =
      trial.least_share >= tuning.enough_quality ? tuning.quality_weight * (1 - trial.least_share) : 0;
  return trial.merit - excused < tuning.good_merit;
}

namespace {

bool is_long(const MissedEdge& edge) { return edge.length_percent > kLongEdgePercent; }

/// Returns true if a trial is better than the best one before. If it is that one polished and still good, the quality
/// decides, unless it no longer meets the distances.
bool is_better(const AutomaticFitTrial& trial, const AutomaticFitTrial& best, const AutomaticFitOptions& options) {
  if (trial.is_polished && is_good_enough(trial, options.tuning.automatic) &&
      (meets_distances(trial, options) || !meets_distances(best, options)))
    return trial.least_scaled_jacobian > best.least_scaled_jacobian;
  return trial.merit < best.merit;
}

}  // namespace

bool add_trial(AutomaticFitTrial trial, const VolumeMesh& mesh, const QualityReport& quality,
               const std::optional<CreaseDistance>& edges, const AutomaticFitOptions& options,
               AutomaticFitResult& result) {
  trial.cells = mesh.num_cells();
  trial.least_scaled_jacobian = quality.min_scaled_jacobian;
  trial.mean_scaled_jacobian = quality.mean_scaled_jacobian;
  trial.uncertified = quality.certificate.not_certified.size();
  if (edges) {
    trial.curves = edges->num_curves;
    trial.followed_curves = edges->num_followed;
    trial.within_share = edges->within_share();
  }
  trial.merit = merit_of(trial, options);
  result.trials.push_back(trial);
  if (result.trials.size() > 1 && !is_better(trial, result.trials[result.chosen], options)) return false;
  result.chosen = result.trials.size() - 1;
  result.mesh = mesh;
  result.report.creases = edges;
  return true;
}

std::vector<MissedEdge> missed_edges(std::span<const UnfollowedCurve> unfollowed, const Normalization& normalization) {
  std::vector<MissedEdge> missed;
  for (const UnfollowedCurve& curve : unfollowed)
    missed.push_back({curve.reason, normalization.from_unit({curve.place})[0], 100 * curve.length});
  std::stable_sort(missed.begin(), missed.end(),
                   [](const MissedEdge& a, const MissedEdge& b) { return a.length_percent > b.length_percent; });
  return missed;
}

std::size_t num_long_edges_lost(std::span<const MissedEdge> missed) {
  return static_cast<std::size_t>(std::ranges::count_if(
      missed, [](const MissedEdge& edge) { return is_long(edge) && edge.reason != NotFollowed::too_acute; }));
}

void warn_of_missed_edges(std::span<const MissedEdge> missed, std::size_t num_curves, const char* name,
                          FitReport& report) {
  if (missed.empty()) return;
  const MissedEdge& longest = missed.front();
  report.warnings.push_back(
      formatted("%zu of %zu %s are not followed, or not all along; the most is left out, %.3g %% of the diagonal, at "
                "(%.6g, %.6g, %.6g): %s",
                missed.size(), num_curves, name, longest.length_percent, longest.place.x(), longest.place.y(),
                longest.place.z(), to_string(longest.reason).c_str()));
}

void mark_if_far_off(AutomaticFitResult& result, const AutomaticFitOptions& options, const char* name) {
  const AutomaticFitTrial& chosen = result.trials[result.chosen];
  std::vector<std::string> reasons;
  const double most = kFarOffFactor * options.max_tolerance_percent;
  if (chosen.max_percent > most)
    reasons.push_back(formatted("the largest distance is above %.3g %% of the diagonal", most));
  const auto num_long = std::ranges::count_if(result.missed_edges, is_long);
  if (num_long > 0)
    reasons.push_back(formatted("%s longer than %.3g %% of the diagonal that are not followed: %td", name,
                                kLongEdgePercent, num_long));
  if (chosen.lost_feature)
    reasons.push_back(formatted("a feature of radius %.4g is missed by %.4g", chosen.lost_feature->size,
                                chosen.lost_feature->distance));
  const double most_volume = kFarOffVolumeFactor * kAutomaticVolumePercent;
  if (chosen.volume_percent > most_volume)
    reasons.push_back(formatted("the volume of a region differs by more than %.3g %%", most_volume));
  if (chosen.solid_volume_percent > kFarOffSolidVolumePercent)
    reasons.push_back(formatted("the volume differs from the target's by %.3g %%", chosen.solid_volume_percent));
  if (reasons.empty()) return;
  result.report.stop_reason = StopReason::tolerance_missed;
  for (const std::string& reason : reasons) result.report.explanation += "; " + reason;
}

void conclude_fit(AutomaticFitResult& result, const AutomaticFitOptions& options) {
  constexpr double kNotablyLower = 0.8;  // share of the quality
  FitReport& report = result.report;
  const AutomaticFitTrial& chosen = result.trials[result.chosen];
  const std::string found = formatted("least scaled Jacobian %.3f, mean distance %.4g %%, largest %.4g %%",
                                      chosen.least_scaled_jacobian, chosen.mean_percent, chosen.max_percent);
  report.explanation = found;
  if (chosen.max_percent > options.max_tolerance_percent || chosen.mean_percent > options.mean_tolerance_percent ||
      chosen.least_share < 1)
    report.warnings.push_back(
        formatted("not as good as aimed at (quality %.2f, distances %.3g and %.3g %%): ", options.quality,
                  options.mean_tolerance_percent, options.max_tolerance_percent) +
        found);
  else if (chosen.least_scaled_jacobian < kNotablyLower * options.quality)
    report.warnings.push_back(
        formatted("the least scaled Jacobian, %.3f, is below the quality of %.2f that was asked for: less is asked "
                  "of cells at sharp edges, because of the angles there",
                  chosen.least_scaled_jacobian, options.quality));
  if (const std::optional<CreaseDistance>& edges = report.creases;
      edges && edges->num_followed > 0 && edges->max_percent() > options.max_tolerance_percent)
    report.warnings.push_back(formatted(
        "creases are up to %.3g %% of the diagonal away from the sharp edges that they follow, the farthest at "
        "(%.6g, %.6g, %.6g); %.3g %% of the length of all edges is within %g %%",
        edges->max_percent(), edges->farthest.x(), edges->farthest.y(), edges->farthest.z(),
        100 * edges->within_share(), kSharpPercent));
  if (chosen.feature_miss && chosen.feature_miss->share > kAutomaticFeatureShare) {
    const FeatureMiss& miss = *chosen.feature_miss;
    report.warnings.push_back(
        formatted("a narrow place of radius %.4g (a hole, pin, wall or slot, or the tip of a wedge) is missed by %.4g, "
                  "%.0f %% of its size, at (%.6g, %.6g, %.6g); a mesh with more cells comes nearer",
                  miss.size, miss.distance, 100 * miss.share, miss.place.x(), miss.place.y(), miss.place.z()));
  }
  warn_of_missed_edges(result.missed_edges, chosen.curves, "sharp edges", report);
  mark_if_far_off(result, options, "sharp edges");
}

}  // namespace subvol::internal
