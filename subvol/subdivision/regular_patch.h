// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/surface_topology.h"

#include <array>
#include <span>

namespace subvol {

/// Whether the surface over a quad is one bicubic B-spline patch.
///
/// So it is if each corner is, seen from the quad: valence 4 and nothing sharp; or two edges of infinite sharpness with
/// two faces between them, this and another; or the only face between two such edges at a corner that stays. Quads all
/// around are expected.
bool is_regular(const SurfaceTopology& surface, Index face);

/// Control points of that patch: net[j][i], the corners of the quad at [1][1], [1][2], [2][2], [2][1]. Beyond creases
/// stand the points 2 p - q that continue a B-spline over its natural end.
using ControlNet = std::array<std::array<Vec3, 4>, 4>;

/// face      a regular quad; its corner number `turn` becomes (0, 0), the next one (1, 0).
ControlNet control_net(const SurfaceTopology& surface, std::span<const Vec3> points, Index face, int turn);

/// Values and first derivatives of the four uniform cubic B-splines over one interval, t in 0 .. 1.
///
///   ((1 - t)^3, 3 t^3 - 6 t^2 + 4, -3 t^3 + 3 t^2 + 3 t + 1, t^3) / 6
struct CubicWeights {
  std::array<double, 4> value, slope;
};
CubicWeights cubic_weights(double t);

}  // namespace subvol
