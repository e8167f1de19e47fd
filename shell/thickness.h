// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "shell/shell_check.h"
#include "shell/shell_layers.h"

#include <functional>
#include <span>
#include <vector>

namespace subvol {

/// Thickness per strand that leaves room for what stands opposite, smoothly:
///
///   t <= asked,   t <= diagonal,   t <= 0.45 gap,   t(v) <= t(w) + 1/2 |v - w| along every edge
///
/// diagonal  of the surface's bounding box.
/// gap  from a surface vertex along its direction (or against it, inside) to another part of the surface (`ray_gaps`).
/// directions  one per column. asked: per strand. Never below a ten-thousandth of what is asked.
std::vector<double> limited_thickness(const ShellLayers& layers, std::span<const Vec3> directions,
                                      std::span<const double> asked);

/// Lowers thicknesses until they differ by half the length of an edge between its ends at most. Cost: n log n.
void limit_slope(const ShellLayers& layers, std::span<double> thickness);

/// Straight columns so thin that they are valid: the state from which a shell grows.
///
/// thickness  per strand: none gets thicker. InputError, naming vertices, where nothing thin enough is found.
/// cancelled  asked within long searches, from the calling thread; true ends the work; empty: none.
/// returns  one position per vertex; none where the work was ended.
std::vector<Vec3> thinnest_shell(const ShellLayers& layers, const ShellCheck& check, std::span<const Vec3> directions,
                                 std::span<const double> thickness, const std::function<bool()>& cancelled = {});

/// What the thickness of a shell came to, in the surface's unit.
struct MeasuredThickness {
  std::vector<double> achieved;    ///< per strand: length of its column on that side, straight from end to end
  std::vector<double> clearance;   ///< per strand: distance of its end from the surface of `layers`
  double surface_distance_max = 0; ///< of the vertices of the sheet that is the surface, from that of `layers`
};

/// positions  one per vertex of the shell. Strands of a side without layers get 0. Quads are cut by `triangulate`.
MeasuredThickness measure_thickness(const ShellLayers& layers, std::span<const Vec3> positions);

}  // namespace subvol
