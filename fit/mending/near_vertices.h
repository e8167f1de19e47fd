// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <array>
#include <span>
#include <vector>

namespace subvol::internal {

/// Returns for each position the number of the vertex that it is to become: of some vertices, those within a distance
/// of one that stays become the nearest such one, whose number is smaller than theirs; all others stay.
///
/// So no vertex moves by more than the distance, however many lie in a row.
///
/// vertices  that may become one, ascending.  distance: > 0.
/// Deterministic. Cost: linear if few vertices that stay are within a distance of each other. After 300 million
/// comparisons, which are a second or two, the rest of the vertices stay.
std::vector<Index> near_vertices(std::span<const Vec3> positions, std::span<const Index> vertices, double distance);

/// Returns for each position the number of the vertex that it is to become, so that cracks close: of vertices at rims,
/// the nearest pairs become one first, and all become the one of the smallest number, if that is within a distance of
/// each.
///
/// Neighbors along a rim never become one, nor do vertices between which the way along rims is at most twice as long as
/// the straight one: they are of one stretch of a rim, and not of two sides of a crack.
///
/// rims      edges of one triangle, by their ends.  distance: > 0.
/// Deterministic. Cost: linear if few vertices are within a distance of each other. If there are more than 10 million
/// pairs, or if a search takes more than a second or two, all stay.
std::vector<Index> crack_vertices(std::span<const Vec3> positions, std::span<const std::array<Index, 2>> rims,
                                  double distance);

}  // namespace subvol::internal
