// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/shell/shell_check.h"
#include "subvol/shell/shell_layers.h"

#include <functional>
#include <span>
#include <string>
#include <vector>

namespace subvol {

/// Returns a smooth thickness per strand that leaves room for opposite parts of the surface:
///
///   t <= asked,   t <= diagonal,   t <= 0.45 gap,   t(v) <= t(w) + 1/2 |v - w| along every edge
///
/// diagonal    of the surface's bounding box.
/// gap         distance from a surface vertex along its direction (on the inside: against it) to another part of the
///             surface (`ray_gaps`). It does not lower t below a ten-thousandth of min(asked, diagonal).
/// directions  one per column.
/// asked       per strand.
std::vector<double> limited_thickness(const ShellLayers& layers, std::span<const Vec3> directions,
                                      std::span<const double> asked);

/// Lowers thicknesses until those at the two ends of each edge differ by at most half its length. Cost: n log n.
void limit_slope(const ShellLayers& layers, std::span<double> thickness);

/// Returns straight columns so thin that they are valid: the state from which a shell grows.
///
/// thickness  per strand: upper bounds. InputError, naming vertices, if no thickness is found to be thin enough.
/// cancelled  polled within long searches, from the calling thread; returns true to end the work; may be empty.
/// names      returns vertices of the surface as messages name them; empty: `text_of_vertices`.
/// returns    one position per vertex; nothing if the work was ended.
std::vector<Vec3> thinnest_shell(const ShellLayers& layers, const ShellCheck& check, std::span<const Vec3> directions,
                                 std::span<const double> thickness, const std::function<bool()>& cancelled = {},
                                 const std::function<std::string(std::span<const Index>)>& names = {});

/// Turns the directions of columns that stay in planes (`layers.planes`) into these. A column is released from its
/// planes if no direction in them sees the front of all faces around its vertex at 6 degrees or more.
void turn_into_planes(ShellLayers& layers, std::span<Vec3> directions);

/// Returns the largest distance of a shell's vertices from the planes in which their columns stay.
double distance_from_planes(const ShellLayers& layers, std::span<const Vec3> positions);

/// The actual thickness of a shell, in the surface's unit.
struct MeasuredThickness {
  std::vector<double> achieved;     ///< per strand: distance of its end from the surface vertex of its column
  std::vector<double> clearance;    ///< per strand: distance of its end from the surface of `layers`
  double surface_distance_max = 0;  ///< of the vertices of sheet `inside` from the surface of `layers`
};

/// positions  one per vertex of the shell. Strands on a side without layers get 0. `triangulate` cuts the quads.
MeasuredThickness measure_thickness(const ShellLayers& layers, std::span<const Vec3> positions);

}  // namespace subvol
