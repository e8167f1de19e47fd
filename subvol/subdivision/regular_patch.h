// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/surface_topology.h"

#include <array>
#include <span>

namespace subvol::internal {

/// Returns true if the surface over a quad is one bicubic B-spline patch.
///
/// That is so if each corner of the quad has valence 4 and nothing sharp; or two edges of infinite sharpness with two
/// faces between them, this one and another; or stays in place and has this face alone between two such edges. All
/// faces around the quad must be quads.
bool is_regular(const SurfaceTopology& surface, Index face);

/// Control points of that patch, net[j][i]: the corners of the quad are at [1][1], [1][2], [2][2], [2][1]. Beyond a
/// crease they are the points 2 p - q that continue a B-spline past a natural end.
using ControlNet = std::array<std::array<Vec3, 4>, 4>;

/// Returns the control points of a face, which must be regular; its corner number `turn` becomes (0, 0), the next one
/// (1, 0).
ControlNet control_net(const SurfaceTopology& surface, std::span<const Vec3> points, Index face, int turn);

/// Returns the values and first derivatives of the four uniform cubic B-splines over one interval, t in 0 .. 1.
///
///   ((1 - t)^3, 3 t^3 - 6 t^2 + 4, -3 t^3 + 3 t^2 + 3 t + 1, t^3) / 6
struct CubicWeights {
  std::array<double, 4> value, slope;
};
CubicWeights cubic_weights(double t);

}  // namespace subvol::internal
