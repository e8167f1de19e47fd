// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/edge_layout.h"
#include "subvol/fit/features/joined_curves.h"
#include "subvol/fit/features/narrow_strips.h"
#include "subvol/fit/features/routing_graph.h"

#include "subvol/mesh/mesh_topology.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace subvol::internal {

namespace {

/// near_target  the grid at its fitted positions.  h: mean length of the edges of its boundary, if a curve is lost.
EdgeLayout layout_of(const VolumeMesh& grid, const VolumeMesh& near_target, const TriangleMesh& target,
                     const SignedFeatures& features, FeatureRouting routing, double h, const QualityTuning& tuning) {
  EdgeLayout layout;
  layout.routing = std::move(routing);
  layout.patched = patched_mesh(grid, near_target.positions, layout.routing, target);
  PatchGroups groups =
      patch_groups(MeshTopology(grid), layout.patched.patches, near_target.positions, target, features);
  layout.pads = add_pads(layout.patched, features);
  NarrowStrips strips = follow_narrow_strips(layout.patched, layout.routing, groups, target, features, h);
  std::ranges::move(strips.pads, std::back_inserter(layout.pads.pads));
  layout.caps = quality_caps(layout.patched, features, tuning);
  layout.tagged_mesh = layout.patched.mesh;
  const std::vector<CreasePath> paths = paths_of_parts(layout.patched.paths, features.curves.curves.size());
  layout.creases = FollowedCreases(followed_parts(near_target, features, layout.routing), paths, layout.tagged_mesh);
  for (const CreasePath& path : paths)
    for (std::size_t i = 0; i + 1 < path.vertices.size(); ++i)
      layout.segments.push_back({{path.vertices[i], path.vertices[i + 1]}, path.curve});
  const MeshTopology topology(layout.patched.mesh);
  layout.group_of_face.assign(topology.num_faces(), 0);
  const auto boundary = topology.boundary_faces();
  for (std::size_t i = 0; i < boundary.size(); ++i)
    layout.group_of_face[boundary[i]] = groups.of_patch[layout.patched.patches.of_face[i]];
  for (const Index region : features.regions) layout.group_of_triangle.push_back(groups.of_region[region]);
  return layout;
}

}  // namespace

EdgeLayout edge_layout(const VolumeMesh& grid, std::span<const Vec3> fitted, const TriangleMesh& target,
                       const SignedFeatures& features, const RoutingOptions& options, const QualityTuning& tuning) {
  VolumeMesh near_target = grid;
  near_target.positions.assign(fitted.begin(), fitted.end());
  const FeatureRouting routing = route_features(near_target, features, options);
  const double h = routing.unfollowed.empty() ? 0 : RoutingGraph(near_target).edge_length();
  std::vector<Index> beside = strips_in_parts(routing, target, features, h);
  while (true) {
    EdgeLayout layout =
        layout_of(grid, near_target, target, features, without_parts(routing, beside, features.curves), h, tuning);
    // Curves that no strip follows are followed in parts again.
    const auto is_lost = [&](Index c) {
      return std::ranges::find(layout.routing.unfollowed, c, &UnfollowedCurve::curve) !=
             layout.routing.unfollowed.end();
    };
    if (std::erase_if(beside, is_lost) == 0) return layout;
  }
}

}  // namespace subvol::internal
