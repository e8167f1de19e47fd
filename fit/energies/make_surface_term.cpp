// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/energies/make_surface_term.h"

#include "subvol/base/error.h"
#include "subvol/fit/energies/surface_energy.h"

namespace subvol::internal {

std::unique_ptr<SurfaceTerm> make_surface_term(const TargetSurface& target,
                                               const std::vector<std::array<Index, 3>>& sample_triangles,
                                               std::size_t num_samples, double tangential_weight,
                                               Correspondence correspondence, SurfacePull pull, double far_length,
                                               std::span<const std::uint8_t> refined, const SurfaceGroups& groups) {
  if (correspondence == Correspondence::voronoi) {
    if (!groups.of_target.empty())
      throw InputError(
          "Correspondence::voronoi: its cells know no regions; a template of several needs closest points");
    return std::make_unique<SurfaceEnergy>(target, sample_triangles, num_samples, tangential_weight);
  }
  const int points = sample_triangles.size() > 2 * target.triangles().size() ? 1 : 3;
  auto energy =
      std::make_unique<ClosestPointEnergy>(target, sample_triangles, num_samples, tangential_weight, points, pull);
  if (far_length > 0) energy->emphasize_far(far_length);
  if (!refined.empty()) energy->refine(refined);
  if (!groups.of_target.empty())
    energy->set_groups({groups.of_sample_triangle.begin(), groups.of_sample_triangle.end()}, groups.of_target);
  return energy;
}

void require_closest(Correspondence correspondence) {
  if (correspondence != Correspondence::closest)
    throw InputError(
        "Correspondence::voronoi: a cloud has no surface to cut into cells; points pull at the closest places");
}

}  // namespace subvol::internal
