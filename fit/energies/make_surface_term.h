// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/energies/closest_point_energy.h"
#include "fit/energies/correspondence.h"
#include "fit/energies/surface_term.h"
#include "fit/target/target_surface.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace subvol {

/// E_S between samples of the fitted surface and a target, which must outlive it.
///
/// Voronoi cells have neither of these:
/// far_length  of `ClosestPointEnergy::emphasize_far`; 0: none
/// refined     of `ClosestPointEnergy::refine`; empty: none
std::unique_ptr<SurfaceTerm> make_surface_term(const TargetSurface& target,
                                               const std::vector<std::array<Index, 3>>& sample_triangles,
                                               std::size_t num_samples, double tangential_weight,
                                               Correspondence correspondence,
                                               SurfacePull pull = SurfacePull::along_normals,
                                               double far_length = 0,
                                               std::span<const std::uint8_t> refined = {});

/// InputError unless closest points are what pulls: Voronoi cells of points have no area.
void require_closest(Correspondence correspondence);

}  // namespace subvol
