// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/target/soup_topology.h"
#include "fit/target/target_surface.h"
#include "subvol/surface/solid_topology.h"

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace subvol {

/// The state that a target is in, and whether a template can become it at all.
struct TargetReport {
  std::size_t num_points = 0;     ///< of a cloud; 0: the target is a surface
  SoupTopology edges;             ///< of a surface
  double area = 0, volume = 0;    ///< in the target's unit; of a cloud, estimates
  VolumeSource volume_source = VolumeSource::signed_sum;
  /// How the solids inside target and template hang together; where the target is closed and manifold, whatever way its
  /// triangles run.
  std::optional<BettiNumbers> topology, template_topology;
  bool same_topology() const { return topology == template_topology; }
};

/// How a fit begins: how far the template's boundary is from the target.
struct StartComparison {
  double mean_distance = 0, max_distance = 0;  ///< symmetric, in shares of the target's diagonal
  TargetReport target;
};

/// boundary  closed and oriented: the template's. Cost: sorts of the edges.
TargetReport describe_target(const TargetSurface& target, const TriangleMesh& boundary);

/// What is odd about it, in words: holes, edges of many triangles, triangles turned over, a volume that is an estimate,
/// another topology than the template's.
std::vector<std::string> warnings_of(const TargetReport& target);

}  // namespace subvol
