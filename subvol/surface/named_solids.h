// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <optional>
#include <span>
#include <vector>

namespace subvol::internal {

/// Returns the volumes of the solids that a surface consists of, if these have names: each group of its triangles
/// bounds a solid of its own.
///
/// That is so if there are several groups, each triangle is in one, each edge has an even number of triangles of each
/// group, and each group encloses more than rounding. The faces of one solid are no such groups: they are open.
///
/// surface  welded (`welded`), with the copies of triangles at which solids touch.
/// returns  the signed volume that each group encloses, negative if it faces inward, 0 for groups without triangles;
///          empty if the surface is another one. Cost: a sort of the edges, if there are groups.
std::vector<double> volumes_of_named_solids(const TriangleMesh& surface);

/// The named solids behind each triangle and in front of it, as places in the list of groups, or kNoIndex.
using SolidSides = std::vector<std::array<Index, 2>>;

/// Returns the named solids on the sides of triangles without copies; nothing if there are no named solids, or if two
/// of them are on the same side of a triangle.
///
/// mesh     welded, with copies.
/// kept     its triangles without copies.
/// kept_as  the number among these of each triangle, or of its copy (`drop_copies`).
std::optional<SolidSides> solids_at_sides(const TriangleMesh& mesh, std::span<const std::array<Index, 3>> kept,
                                          std::span<const Index> kept_as);

}  // namespace subvol::internal
