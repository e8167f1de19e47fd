// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/edge_layout.h"
#include "subvol/fit/features/joined_curves.h"

#include "subvol/mesh/mesh_topology.h"

#include <utility>

namespace subvol::internal {

EdgeLayout edge_layout(const VolumeMesh& grid, std::span<const Vec3> fitted, const TriangleMesh& target,
                       const SignedFeatures& features, const RoutingOptions& options) {
  VolumeMesh near_target = grid;
  near_target.positions.assign(fitted.begin(), fitted.end());
  EdgeLayout layout;
  layout.routing = route_features(near_target, features, options);
  layout.patched = patched_mesh(grid, near_target.positions, layout.routing, target);
  const PatchGroups groups =
      patch_groups(MeshTopology(grid), layout.patched.patches, near_target.positions, target, features);
  layout.pads = add_pads(layout.patched, features);
  layout.caps = quality_caps(layout.patched, features);
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

}  // namespace subvol::internal
