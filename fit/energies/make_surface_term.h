// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/energies/closest_point_energy.h"
#include "subvol/fit/energies/correspondence.h"
#include "subvol/fit/energies/surface_term.h"
#include "subvol/fit/target/target_surface.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace subvol::internal {

/// Groups of the triangles of both surfaces, as for `ClosestPointEnergy::set_groups`; empty: there are none.
struct SurfaceGroups {
  std::span<const Index> of_sample_triangle, of_target;
};

/// Makes E_S between samples of the fitted surface and a target, which must outlive it.
///
/// The last four parameters apply to closest points only:
/// pull        direction of the correspondences of `ClosestPointEnergy`
/// far_length  argument of `ClosestPointEnergy::emphasize_far`; 0: not called
/// refined     argument of `ClosestPointEnergy::refine`; empty: not called
/// groups      only parts of the same group correspond. InputError: groups with Correspondence::voronoi, whose cells
///             know none.
std::unique_ptr<SurfaceTerm> make_surface_term(
    const TargetSurface& target, const std::vector<std::array<Index, 3>>& sample_triangles, std::size_t num_samples,
    double tangential_weight, Correspondence correspondence, SurfacePull pull = SurfacePull::along_normals,
    double far_length = 0, std::span<const std::uint8_t> refined = {}, const SurfaceGroups& groups = {});

/// Throws InputError unless correspondences are closest points: Voronoi cells of a point cloud have no area.
void require_closest(Correspondence correspondence);

}  // namespace subvol::internal
