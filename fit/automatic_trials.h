// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/automatic_fit.h"
#include "subvol/fit/features/feature_routing.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/fit/target/normalization.h"
#include "subvol/fit/target/target_surface.h"

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace subvol::internal {

/// Portions of the work, for forecasts. An attempt takes `AutomaticAttempt::portion` of what is left. Of what is left
/// of an attempt, the other portions are those of its template, of the coarser of two levels, of a smooth fit, and of
/// each routing and relaxation.
inline constexpr double kTemplatePortion = 0.1, kCoarsePortion = 0.25, kSmoothPortion = 0.35, kRoutingPortion = 0.9;

/// Returns the options, with the least goal that the stages can use in place of none. InputError: one out of range.
AutomaticFitOptions checked_options(AutomaticFitOptions options);

/// Returns how far a trial is from its aims: the formula in `fit_automatically`.
double merit_of(const AutomaticFitTrial& trial, const AutomaticFitOptions& options);

/// Returns the difference of the volume inside a closed boundary from that of the target, in percent of the latter; 0
/// if the target is not closed.
double volume_difference_percent(const TriangleMesh& boundary, const TargetSurface& target);

/// Returns the merit that a trial would have if its boundary did not meet itself and no cell were worse than
/// acceptable.
double merit_if_relaxed(AutomaticFitTrial trial, const AutomaticFitOptions& options);

/// Returns true if all cells are certified and the boundary is found not to meet itself.
bool is_valid(const AutomaticFitTrial& trial);

/// Returns false if the boundary of a trial is known not to meet itself.
inline bool meets_itself(const AutomaticFitTrial& trial) { return trial.self_intersections != std::size_t{0}; }

/// Returns true if a trial is so good that it is polished, and neither smaller cells nor, with edges to follow, another
/// template is tried.
bool is_good_enough(const AutomaticFitTrial& trial, const AutomaticTuning& tuning);

/// Returns true if both distances are within those allowed.
bool meets_distances(const AutomaticFitTrial& trial, const AutomaticFitOptions& options);

/// Completes a trial by what was measured of its mesh, and adds it to a result. Returns true if it is the best one so
/// far; the result then holds the mesh and its edges. trial  with its distances, self-intersections and least share of
/// the goal. edges  how well edges are followed; nothing: there are none to follow.
bool add_trial(AutomaticFitTrial trial, const VolumeMesh& mesh, const QualityReport& quality,
               const std::optional<CreaseDistance>& edges, const AutomaticFitOptions& options,
               AutomaticFitResult& result);

/// Returns the curves that no path follows, longest first, in the target's own coordinates.
/// unfollowed  in normalized coordinates.
std::vector<MissedEdge> missed_edges(std::span<const UnfollowedCurve> unfollowed, const Normalization& normalization);

/// Returns the number of edges longer than `kLongEdgePercent` that cells could follow: all but those that are too
/// acute.
std::size_t num_long_edges_lost(std::span<const MissedEdge> missed);

/// Adds a warning about missed edges to a report, if there are any, with the place of the longest.
/// num_curves  number of those to be followed.  name  what they are called.
void warn_of_missed_edges(std::span<const MissedEdge> missed, std::size_t num_curves, const char* name,
                          FitReport& report);

/// Writes the explanation of a finished fit of one solid, and warnings of what it misses: quality, distances, a small
/// feature, sharp edges; then as `mark_if_far_off`.
void conclude_fit(AutomaticFitResult& result, const AutomaticFitOptions& options);

/// Completes the report of a finished fit, whose explanation says what was reached: `tolerance_missed` if that is far
/// off (`kFarOffFactor` and the constants below it).
/// name  what the curves are called.
void mark_if_far_off(AutomaticFitResult& result, const AutomaticFitOptions& options, const char* name);

}  // namespace subvol::internal
