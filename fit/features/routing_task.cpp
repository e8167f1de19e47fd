// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/routing_task.h"

#include "subvol/base/error.h"
#include "subvol/fit/features/corner_clusters.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>

namespace subvol::internal {

namespace {

/// Curves at which the solid is thinner than this angle, in degrees, are left alone: 0.93 sin(19) = 0.3 is the scaled
/// Jacobian at which cells are given up.
constexpr double kLeastFollowedAngle = 19;

}  // namespace

RoutingTask::RoutingTask(const VolumeMesh& mesh, const SignedFeatures& features, const RoutingOptions& options)
    : features_(features),
      graph_(mesh, options.on_sheets),
      on_sheets_(options.on_sheets),
      reasons_(curves().size()),
      may_join_(curves().size(), 1),
      along_sheet_curves_(options.along_sheet_curves) {
  const std::size_t num_curves = curves().size();
  if (features.angles.size() != num_curves)
    throw InputError("route_features: features need one angle for each of the " + std::to_string(num_curves) +
                     " curves");
  for (const auto* list : {&options.excluded, &options.not_joined, &options.along_sheet_curves})
    if (!list->empty() && list->size() != num_curves)
      throw InputError("route_features: options need one entry for each of the " + std::to_string(num_curves) +
                       " curves");
  for (std::size_t c = 0; c < num_curves; ++c) {
    const FeatureCurve& curve = curves()[c];
    if (!options.excluded.empty() && options.excluded[c])
      reasons_[c] = NotFollowed::excluded;
    else if (features.angles[c] < kLeastFollowedAngle)
      reasons_[c] = NotFollowed::too_acute;
    else if (curve.length() < kLeastRoutedLength * graph_.edge_length() && !has_edge_on(graph_, curve))
      reasons_[c] = NotFollowed::shorter_than_cell;
    if (!options.not_joined.empty() && options.not_joined[c]) may_join_[c] = 0;
  }
  along_sheet_curves_.resize(num_curves, 0);
}

std::vector<Index> RoutingTask::eligible_by_length() const {
  std::vector<std::pair<double, Index>> order;
  for (std::size_t c = 0; c < curves().size(); ++c)
    if (is_eligible(static_cast<Index>(c))) order.push_back({-curves()[c].length(), static_cast<Index>(c)});
  std::sort(order.begin(), order.end());
  std::vector<Index> eligible;
  for (const auto& [length, c] : order) eligible.push_back(c);
  return eligible;
}

std::optional<std::span<const std::uint8_t>> RoutingTask::along_sheet_curves() const {
  if (!on_sheets_) return std::nullopt;
  return along_sheet_curves_;
}

}  // namespace subvol::internal
