// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/fits/graded_template.h"

#include "subvol/mesh/mesh_topology.h"
#include "subvol/templates/graded_grid.h"
#include "subvol/templates/pillow.h"

#include <algorithm>
#include <utility>

namespace subvol::internal {

std::vector<Vec3> missed_points(const TargetSurface& target, const ClosestPoint& fitted, double distance) {
  const std::vector<Vec3>& samples = target.samples();
  std::vector<ClosestPoint::Hit> hits(samples.size());
  fitted.closest(samples, hits);
  std::vector<std::pair<double, std::size_t>> missed;
  for (std::size_t i = 0; i < samples.size(); ++i)
    if (hits[i].distance > distance) missed.push_back({-hits[i].distance, i});
  std::sort(missed.begin(), missed.end());
  std::vector<Vec3> points;
  for (const auto& [nearness, i] : missed) points.push_back(samples[i]);
  return points;
}

std::optional<SizedMesh> graded_template(const TriangleMesh& surface, const VoxelGrid& grid, std::span<const char> kept,
                                         std::span<const Vec3> places, std::size_t most_cells, SearchStop& stop) {
  constexpr double kRetryPlacesShare = 0.6;  // share of the places that is tried next if there was no room for them
  for (auto count = static_cast<double>(places.size()); count >= 1 && !stop.is_stopped(); count *= kRetryPlacesShare) {
    const std::vector<char> cut = cells_around_points(grid, places.first(static_cast<std::size_t>(count)));
    GradedGrid graded = graded_grid(surface, grid, kept, cut, &stop);
    if (stop.is_stopped()) break;
    const std::size_t pillows = MeshTopology(graded.mesh).boundary_faces().size();
    if (graded.mesh.num_cells() + pillows > most_cells) continue;
    if (graded.sizes.empty() || std::ranges::min(graded.sizes) == 1) break;
    SizedMesh result{pillow(graded.mesh), {}};
    result.sizes = padded_sizes(result.mesh, graded.sizes);
    return result;
  }
  return std::nullopt;
}

}  // namespace subvol::internal
