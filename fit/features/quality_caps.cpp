// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/quality_caps.h"

#include "subvol/base/error.h"
#include "subvol/mesh/mesh_topology.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <string>

namespace subvol::internal {

namespace {

/// Distance, as a share of a curve's length, at which its direction at a corner is measured.
constexpr double kDirectionShare = 0.05;

void require_curves(const PatchedMesh& patched, const SignedFeatures& features) {
  for (const CreasePath& path : patched.paths)
    if (path.curve < 0 ||
        static_cast<std::size_t>(path.curve) >= std::min(features.angles.size(), features.curves.curves.size()))
      throw InputError("quality_caps: there is no curve " + std::to_string(path.curve));
}

double edge_cap(double angle, int cells, double reachable_share) {
  const double part = std::min(180.0, angle / cells);
  return reachable_share * std::max(0.0, std::sin(part * std::numbers::pi / 180));
}

std::vector<EdgeCap> edge_caps(const PatchedMesh& patched, const SignedFeatures& features, double reachable_share) {
  const MeshTopology topology(patched.mesh);
  std::vector<EdgeCap> caps;
  for (const CreasePath& path : patched.paths) {
    const double angle = features.angles[path.curve];
    for (Index edge : edges_of_path(topology, path.vertices))
      caps.push_back({topology.edge(edge), edge_cap(angle, topology.num_edge_cells(edge), reachable_share), angle});
  }
  std::ranges::sort(caps, {}, &EdgeCap::ends);
  return caps;
}

/// Directions of the curves whose paths end at each vertex.
std::map<Index, std::vector<Vec3>> directions_at_ends(const PatchedMesh& patched, const SignedFeatures& features) {
  std::map<Index, std::vector<Vec3>> directions;
  for (const CreasePath& path : patched.paths) {
    const FeatureCurve& curve = features.curves.curves[path.curve];
    const double reach = kDirectionShare * curve.length();
    directions[path.vertices.front()].push_back(direction_at_end(curve, true, reach));
    directions[path.vertices.back()].push_back(direction_at_end(curve, false, reach));
  }
  return directions;
}

std::vector<VertexCap> corner_caps(const PatchedMesh& patched, const SignedFeatures& features,
                                   const QualityTuning& tuning) {
  std::vector<int> cells(patched.mesh.num_vertices(), 0);
  for (Index v : patched.mesh.cell_vertices) ++cells[v];
  const auto directions = directions_at_ends(patched, features);
  std::vector<VertexCap> caps;
  for (const PlacedCorner& corner : patched.corners) {
    const auto at = directions.find(corner.vertex);
    const bool is_repeated = !caps.empty() && caps.back().vertex == corner.vertex;
    if (is_repeated || at == directions.end() || at->second.size() < 3) continue;
    const auto& t = at->second;
    const double best = std::abs(t[0].dot(t[1].cross(t[2])));
    caps.push_back({corner.vertex, cells[corner.vertex] == 1 ? tuning.reachable_share * best : tuning.corner_cap});
  }
  return caps;
}

}  // namespace

QualityCaps quality_caps(const PatchedMesh& patched, const SignedFeatures& features, const QualityTuning& tuning) {
  require_curves(patched, features);
  return {edge_caps(patched, features, tuning.reachable_share), corner_caps(patched, features, tuning)};
}

}  // namespace subvol::internal
