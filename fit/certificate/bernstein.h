// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/simd/cell_lanes.h"

#include <array>
#include <cmath>
#include <limits>

namespace subvol::internal::bernstein {

/// Bernstein coefficients of det J over linear cells. They bound det J from both sides: a polynomial in Bernstein form
/// stays inside the hull of its coefficients. T is `double`, or a fixed-size Eigen array that holds one cell per lane.
template <class T>
using Vector = std::array<T, 3>;

template <class T>
Vector<T> difference(const Vector<T>& p, const Vector<T>& q) {
  return {T(p[0] - q[0]), T(p[1] - q[1]), T(p[2] - q[2])};
}
template <class T>
Vector<T> cross(const Vector<T>& p, const Vector<T>& q) {
  return {T(p[1] * q[2] - p[2] * q[1]), T(p[2] * q[0] - p[0] * q[2]), T(p[0] * q[1] - p[1] * q[0])};
}
template <class T>
T dot(const Vector<T>& p, const Vector<T>& q) {
  return p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
}
template <class T>
Vector<T> mean(const Vector<T>& p, const Vector<T>& q) {
  return {T(0.5 * (p[0] + q[0])), T(0.5 * (p[1] + q[1])), T(0.5 * (p[2] + q[2]))};
}
/// Squared edge lengths per reference direction, from which the rounding margin is computed.
template <class T>
struct EdgeLengths {
  std::array<T, 3> squared_max;  ///< of the longest edge along u, v, w
  T squared_sum;                 ///< over all these edges; NaN or infinite if any coordinate is
};

/// Local number of the hex corner at (i, j, k) in {0, 1}^3.
inline constexpr int hex_corner(int i, int j, int k) { return 4 * k + (j == 0 ? i : 3 - i); }

/// Computes the 27 coefficients of det J of a trilinear hex; the degree is 2 in each of u, v, w.
///
///   d_IJK = mean over i+i'=I, j+j'=J, k+k'=K of det[a_jk, b_ik', c_i'j']      a, b, c: the edges along u, v, w
///
/// x        the 8 corners in the kind's order.
/// d        coefficient (I, J, K) is at 9 I + 3 J + K; those with even I, J and K are the corner values of det J.
/// Cost: 16 cross products and 48 dot products.
template <class T>
void hex_coefficients(const std::array<Vector<T>, 8>& x, std::array<T, 27>& d, EdgeLengths<T>& lengths) {
  std::array<std::array<Vector<T>, 2>, 2> a, b, c;
  for (int m = 0; m < 2; ++m)
    for (int n = 0; n < 2; ++n) {
      a[m][n] = difference(x[hex_corner(1, m, n)], x[hex_corner(0, m, n)]);
      b[m][n] = difference(x[hex_corner(m, 1, n)], x[hex_corner(m, 0, n)]);
      c[m][n] = difference(x[hex_corner(m, n, 1)], x[hex_corner(m, n, 0)]);
    }
  int direction = 0;
  for (const auto* edges : {&a, &b, &c}) {
    const auto& e = *edges;
    const T l0 = dot(e[0][0], e[0][0]), l1 = dot(e[0][1], e[0][1]), l2 = dot(e[1][0], e[1][0]),
            l3 = dot(e[1][1], e[1][1]);
    const T sum = l0 + l1 + l2 + l3;
    lengths.squared_max[direction] = larger(larger(l0, l1), larger(l2, l3));
    lengths.squared_sum = direction == 0 ? sum : T(lengths.squared_sum + sum);
    ++direction;
  }
  for (int i = 0; i < 3; ++i) {
    std::array<std::array<Vector<T>, 2>, 2> normal;  // mean of b_ik x c_i'j over i + i' = I, at [j][k]
    for (int j = 0; j < 2; ++j)
      for (int k = 0; k < 2; ++k)
        normal[j][k] =
            i == 1 ? mean(cross(b[0][k], c[1][j]), cross(b[1][k], c[0][j])) : cross(b[i / 2][k], c[i / 2][j]);
    T* out = d.data() + 9 * i;
    for (int j = 0; j < 2; ++j)
      for (int k = 0; k < 2; ++k) out[6 * j + 2 * k] = dot(a[j][k], normal[j][k]);
    for (int j = 0; j < 2; ++j) {
      out[6 * j + 1] = 0.5 * (dot(a[j][0], normal[j][1]) + dot(a[j][1], normal[j][0]));
      out[3 + 2 * j] = 0.5 * (dot(a[0][j], normal[1][j]) + dot(a[1][j], normal[0][j]));
    }
    out[4] = 0.25 * ((dot(a[0][0], normal[1][1]) + dot(a[1][1], normal[0][0])) +
                     (dot(a[0][1], normal[1][0]) + dot(a[1][0], normal[0][1])));
  }
}

/// Computes the 9 coefficients of det J of a prism, of degree 1 over the triangle and 2 along w; (i, K) is at 3 i + K:
/// d_iK = mean over k+k'=K of det[p_k, q_k', c_i] with p, q the bottom and top triangles' edges and c_i the upright
/// edges. For every w, det J is linear over the triangle, so three quadratics in w decide the cell.
template <class T>
void prism_coefficients(const std::array<Vector<T>, 6>& x, std::array<T, 9>& d, EdgeLengths<T>& lengths) {
  const std::array<Vector<T>, 2> p = {difference(x[1], x[0]), difference(x[4], x[3])};
  const std::array<Vector<T>, 2> q = {difference(x[2], x[0]), difference(x[5], x[3])};
  const std::array<Vector<T>, 3> normal = {cross(p[0], q[0]), mean(cross(p[0], q[1]), cross(p[1], q[0])),
                                           cross(p[1], q[1])};
  const T p0 = dot(p[0], p[0]), p1 = dot(p[1], p[1]), q0 = dot(q[0], q[0]), q1 = dot(q[1], q[1]);
  lengths.squared_max = {larger(p0, p1), larger(q0, q1), p0};
  lengths.squared_sum = p0 + p1 + q0 + q1;
  for (int i = 0; i < 3; ++i) {
    const Vector<T> c = difference(x[i + 3], x[i]);
    const T l = dot(c, c);
    lengths.squared_max[2] = i == 0 ? l : larger(lengths.squared_max[2], l);
    lengths.squared_sum = lengths.squared_sum + l;
    for (int k = 0; k < 3; ++k) d[3 * i + k] = dot(c, normal[k]);
  }
}

/// Computes the one coefficient of a tet: det[x1 - x0, x2 - x0, x3 - x0], six times its volume.
template <class T>
void tet_coefficients(const std::array<Vector<T>, 4>& x, std::array<T, 1>& d, EdgeLengths<T>& lengths) {
  const Vector<T> a = difference(x[1], x[0]), b = difference(x[2], x[0]), c = difference(x[3], x[0]);
  lengths.squared_max = {dot(a, a), dot(b, b), dot(c, c)};
  lengths.squared_sum = lengths.squared_max[0] + lengths.squared_max[1] + lengths.squared_max[2];
  d[0] = dot(a, cross(b, c));
}

/// Computes the 4 coefficients of det J of a pyramid, which is bilinear over the base and constant along the rays to
/// the apex: (i, j) is at 2 i + j, the value at the base's corner (i, j) along u and v. With e and f the base's edges
/// along u and v and g = x0 - x1 + x2 - x3, det J = det[e + t g, f + s g, x4 - x0 + s t g] is linear in s and in t.
template <class T>
void pyramid_coefficients(const std::array<Vector<T>, 5>& x, std::array<T, 4>& d, EdgeLengths<T>& lengths) {
  const std::array<Vector<T>, 2> e = {difference(x[1], x[0]), difference(x[2], x[3])};
  const std::array<Vector<T>, 2> f = {difference(x[3], x[0]), difference(x[2], x[1])};
  const T e0 = dot(e[0], e[0]), e1 = dot(e[1], e[1]), f0 = dot(f[0], f[0]), f1 = dot(f[1], f[1]);
  lengths.squared_max = {larger(e0, e1), larger(f0, f1), e0};
  lengths.squared_sum = e0 + e1 + f0 + f1;
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 2; ++j) {
      const Vector<T> up = difference(x[4], x[hex_corner(i, j, 0)]);
      const T l = dot(up, up);
      lengths.squared_max[2] = i + j == 0 ? l : larger(lengths.squared_max[2], l);
      lengths.squared_sum = lengths.squared_sum + l;
      d[2 * i + j] = dot(up, cross(e[j], f[i]));
    }
}

/// Largest possible product |a||b||c| of a cell's edges along the three directions: the unit of all rounding margins.
///
/// Infinite (nothing can be certified) if a length is NaN, or outside [1e-50, 1e50] so that products might underflow or
/// overflow.
inline double length_scale(const EdgeLengths<double>& lengths) {
  const auto& m = lengths.squared_max;
  const bool in_range = m[0] >= 1e-100 && m[1] >= 1e-100 && m[2] >= 1e-100 && lengths.squared_sum <= 1e100;
  return in_range ? std::sqrt(m[0] * m[1] * m[2]) : std::numeric_limits<double>::infinity();
}

/// Bound on the error of a computed coefficient after `level` bisections.
///
/// Each of the products summed in a coefficient carries at most 12 roundings (three edge differences, cross product,
/// two means, dot product), so with u = 2^-53
///
///   |error| <= 12u/(1 - 12u) perm(|a|,|b|,|c|) <= 12.1 u (6/3^1.5) |a||b||c| < 14 u |a||b||c|
///
/// (the permanent's bound is that of Carlen, Lieb and Loss). A bisection takes at most six averages in a row, and
/// averages do not enlarge errors: 6 u |a||b||c| more per level. `scale` is itself accurate to 10 u, which the factors
/// cover.
inline double rounding_margin(double scale, int level) {
  constexpr double u = std::numeric_limits<double>::epsilon() / 2;
  return (16 + 6.5 * level) * u * scale;
}

}  // namespace subvol::internal::bernstein
