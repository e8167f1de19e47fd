// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/target/soup_topology.h"
#include "subvol/fit/target/target_surface.h"
#include "subvol/surface/solid_topology.h"

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace subvol {

/// The state of a target, and whether a template can take its topology at all.
struct TargetReport {
  std::size_t num_points = 0;   ///< number of points of a cloud; 0: the target is a surface
  SoupTopology edges;           ///< edges of a surface
  double area = 0, volume = 0;  ///< in the target's unit; estimates for a cloud
  VolumeSource volume_source = VolumeSource::signed_sum;
  /// Topology of the solids inside target and template. It is set if the target bounds a solid without open or
  /// non-manifold edges, whatever the orientation of its triangles.
  std::optional<BettiNumbers> topology, template_topology;
  bool same_topology() const { return topology == template_topology; }
};

/// The start of a fit: distances between the template's boundary and the target.
struct StartComparison {
  double mean_distance = 0, max_distance = 0;  ///< symmetric, in shares of the target's diagonal
  TargetReport target;
};

/// Describes a target. boundary  the template's, closed and oriented. Cost: sorts of the edges.
TargetReport describe_target(const TargetSurface& target, const TriangleMesh& boundary);

/// Returns warnings in words about open, inconsistently oriented and non-manifold edges, a volume that was not computed
/// from the surface itself, and a topology other than the template's.
std::vector<std::string> warnings_of(const TargetReport& target);

}  // namespace subvol
