// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <span>

namespace subvol {

/// A point of a triangle: weights of its corners, with sum 1. Also the corners' values of a function linear on it.
using Barycentric = std::array<double, 3>;

inline double dot(const Barycentric& a, const Barycentric& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

inline Barycentric operator-(const Barycentric& a, const Barycentric& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

/// The point a + t (b - a).
inline Barycentric between(const Barycentric& a, const Barycentric& b, double t) {
  return {a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])};
}

/// Area of the triangle abc as a share of the whole one; negative where abc runs the other way.
inline double share(const Barycentric& a, const Barycentric& b, const Barycentric& c) {
  return (b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1]);
}

/// m += 1/area * integral of l_i l_j over a polygon, ij = 00 01 02 11 12 22; `at` takes its corners' numbers to them.
template <class At>
void add_moments(std::size_t num_corners, const At& at, std::array<double, 6>& m) {
  for (std::size_t i = 1; i + 1 < num_corners; ++i) {
    const Barycentric &a = at(0), &b = at(i), &c = at(i + 1);
    const double weight = share(a, b, c) / 12;
    const Barycentric s = {a[0] + b[0] + c[0], a[1] + b[1] + c[1], a[2] + b[2] + c[2]};
    int k = 0;
    for (int p = 0; p < 3; ++p)
      for (int q = p; q < 3; ++q) m[k++] += weight * (a[p] * a[q] + b[p] * b[q] + c[p] * c[q] + s[p] * s[q]);
  }
}

/// Sum of all nine moments: the share of the triangle's area.
inline double total(const std::array<double, 6>& m) { return m[0] + m[3] + m[5] + 2 * (m[1] + m[2] + m[4]); }

}  // namespace subvol
