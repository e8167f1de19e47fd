// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/feature_routing.h"
#include "subvol/fit/features/not_followed.h"
#include "subvol/fit/features/routing_graph.h"
#include "subvol/fit/features/signed_features.h"
#include "subvol/mesh/volume_mesh.h"

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace subvol::internal {

/// Holds what all attempts of `route_features` share: the edges that paths may run along, the curves of the target, and
/// which of these are eligible, that is, may be followed at all.
class RoutingTask {
 public:
  /// mesh, features  must outlive the object. InputError: as `route_features`.
  RoutingTask(const VolumeMesh& mesh, const SignedFeatures& features, const RoutingOptions& options);

  const RoutingGraph& graph() const { return graph_; }
  const SignedFeatures& features() const { return features_; }
  const std::vector<FeatureCurve>& curves() const { return features_.curves.curves; }
  /// Returns the vertex of the target at the first point of a curve (end 0) or its last one (end 1).
  Index corner_of(Index c, int end) const {
    const std::vector<Index>& vertices = curves()[c].vertices;
    return end == 0 ? vertices.front() : vertices.back();
  }

  /// Returns why no path of a curve is even looked for; nothing if it is eligible.
  const std::optional<NotFollowed>& reason_against(Index c) const { return reasons_[c]; }
  bool is_eligible(Index c) const { return !reasons_[c]; }
  /// Returns the eligible curves, the longest first.
  std::vector<Index> eligible_by_length() const;
  /// Returns true if the path of a curve may end inside that of another one.
  bool may_join(Index c) const { return may_join_[c] != 0; }
  /// Returns what `CurveSearch` expects: one entry per curve; nothing if paths run along the boundary. The span points
  /// into this object.
  std::optional<std::span<const std::uint8_t>> along_sheet_curves() const;

 private:
  const SignedFeatures& features_;
  RoutingGraph graph_;
  bool on_sheets_;
  std::vector<std::optional<NotFollowed>> reasons_;
  std::vector<std::uint8_t> may_join_, along_sheet_curves_;
};

}  // namespace subvol::internal
