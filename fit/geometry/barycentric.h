// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <span>

namespace subvol::internal {

/// A point of a triangle: weights of its corners, with sum 1. Also the values at the corners of a linear function.
using Barycentric = std::array<double, 3>;

inline double dot(const Barycentric& a, const Barycentric& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

inline Barycentric operator-(const Barycentric& a, const Barycentric& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

/// Returns the point a + t (b - a).
inline Barycentric between(const Barycentric& a, const Barycentric& b, double t) {
  return {a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])};
}

/// Returns the area of the triangle abc as a share of the whole one; negative if abc is oriented the other way.
inline double share(const Barycentric& a, const Barycentric& b, const Barycentric& c) {
  return (b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1]);
}

/// m += 1/area * integral of l_i l_j over a polygon, ij = 00 01 02 11 12 22; at(i) is corner i.
template <class At>
void add_moments(std::size_t num_corners, const At& at, std::array<double, 6>& m) {
  if (num_corners < 3) return;
  // Twelve times the moments, from products of corners and of their sums. Scalars, because arrays would be in memory.
  double m00 = 0, m01 = 0, m02 = 0, m11 = 0, m12 = 0, m22 = 0;
  const double a0 = at(0)[0], a1 = at(0)[1], a2 = at(0)[2];
  double b0 = at(1)[0], b1 = at(1)[1], b2 = at(1)[2];
  for (std::size_t i = 2; i < num_corners; ++i) {
    const double c0 = at(i)[0], c1 = at(i)[1], c2 = at(i)[2];
    const double s0 = a0 + b0 + c0, s1 = a1 + b1 + c1, s2 = a2 + b2 + c2;
    const double weight = (b1 - a1) * (c2 - a2) - (b2 - a2) * (c1 - a1);
    m00 += weight * (a0 * a0 + b0 * b0 + c0 * c0 + s0 * s0);
    m01 += weight * (a0 * a1 + b0 * b1 + c0 * c1 + s0 * s1);
    m02 += weight * (a0 * a2 + b0 * b2 + c0 * c2 + s0 * s2);
    m11 += weight * (a1 * a1 + b1 * b1 + c1 * c1 + s1 * s1);
    m12 += weight * (a1 * a2 + b1 * b2 + c1 * c2 + s1 * s2);
    m22 += weight * (a2 * a2 + b2 * b2 + c2 * c2 + s2 * s2);
    b0 = c0, b1 = c1, b2 = c2;
  }
  constexpr double kFactor = 1. / 12;
  m[0] += kFactor * m00;
  m[1] += kFactor * m01;
  m[2] += kFactor * m02;
  m[3] += kFactor * m11;
  m[4] += kFactor * m12;
  m[5] += kFactor * m22;
}

/// Returns the sum of all nine moments: the polygon's share of the triangle's area.
inline double total(const std::array<double, 6>& m) { return m[0] + m[3] + m[5] + 2 * (m[1] + m[2] + m[4]); }

}  // namespace subvol::internal
