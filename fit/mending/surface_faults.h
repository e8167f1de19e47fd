// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/fit/mending/mending_goal.h"
#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace subvol {

/// Largest number of places that a message lists.
inline constexpr std::size_t kMostNamedPlaces = 10;

/// Faults that keep layers from standing on a surface that `make_layers` accepts, or the surface from bounding a solid.
struct SurfaceFaults {
  std::vector<Index> flat;                    ///< faces with a triangle without area, ascending
  std::vector<std::array<Index, 2>> meeting;  ///< pairs of faces that intersect or touch, smaller first, ascending
  std::vector<Index> hidden;                  ///< vertices from which no direction sees all faces around, ascending
  bool is_complete = true;                    ///< false: canceled, or ended as in `self_intersections`
  bool none() const { return flat.empty() && meeting.empty() && hidden.empty() && is_complete; }
};

/// Numbers and positions by which messages name a surface's faces and vertices.
struct SurfaceNames {
  std::span<const Index> vertices, faces;  ///< numbers in the caller's file; empty: those of the surface
};

/// Returns the places at which a surface intersects itself (quads as their `fan_triangles`), has no area, or cannot be
/// extruded (`visible_normals`; only if the goal is layers).
///
/// surface  triangles and quads; every vertex is used.
/// Cost: that of `self_intersections`.
SurfaceFaults find_faults(const PolygonMesh& surface, MendingGoal goal = MendingGoal::layers,
                          const std::function<bool()>& cancelled = {});

/// Returns a sentence for people with the number of faults of each kind and the first `kMostNamedPlaces` of them, with
/// coordinates; empty if there are none.
std::string to_text(const SurfaceFaults& faults, const PolygonMesh& surface, const SurfaceNames& names = {});

/// Returns "vertex 4 at (1, 2, 0.5)" for each of the first `kMostNamedPlaces` vertices, and the number of all of them
/// if there are more.
std::string text_of_vertices(std::span<const Index> vertices, std::span<const Vec3> positions,
                             std::span<const Index> names = {});

}  // namespace subvol
