// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/simd/wide.h"

namespace subvol::internal {

// Eight 3x3 matrices at once, in registers: everything is inlined everywhere.

[[gnu::always_inline]] inline Wide wide(double x) { return Wide{} + x; }
[[gnu::always_inline]] inline Wide absolute(const Wide& x) { return x < 0 ? -x : x; }

/// The 2x2 rotation that diagonalizes a symmetric matrix [[p, o], [o, q]] with entries of at most 1, by the half angle:
/// cos 2t = |d| / sqrt(d^2 + b^2), d = q - p, b = 2 o.
struct Rotation {
  Wide c, s;

  [[gnu::always_inline]] inline Rotation(const Wide& p, const Wide& q, const Wide& o) {
    const Wide d = q - p, b = 2 * o, size = absolute(d) + 1e-150;  // never 0
    const Wide inverse = reciprocal_square_root(size * size + b * b);
    const Wide c2 = 0.5 + 0.5 * size * inverse, inverse_c = reciprocal_square_root(c2);
    const Wide half = 0.5 * b * inverse * inverse_c;
    c = c2 * inverse_c;
    s = d < 0 ? -half : half;
  }
  [[gnu::always_inline]] inline void turn(Wide* x, Wide* y) const {
    for (int k = 0; k < 3; ++k) {
      const Wide turned = c * x[k] - s * y[k];
      y[k] = s * x[k] + c * y[k];
      x[k] = turned;
    }
  }
};

/// A symmetric matrix; coupled: entries (0,1), (1,2), (2,0).
struct Symmetric {
  Wide diagonal[3], coupled[3];
};

[[gnu::always_inline]] inline Wide determinant(const Symmetric& a) {
  const Wide *d = a.diagonal, *o = a.coupled;
  return d[0] * (d[1] * d[2] - o[1] * o[1]) - o[0] * (o[0] * d[2] - o[1] * o[2]) + o[2] * (o[0] * o[1] - d[1] * o[2]);
}

/// cos(acos(r) / 3) for r in [0, 1], the largest root c of 4 c^3 - 3 c = r. A polynomial that interpolates it at
/// Chebyshev nodes is accurate to 1.3e-8; one Newton step then makes it accurate to rounding.
[[gnu::always_inline]] inline Wide cosine_of_third(const Wide& r) {
  const Wide c = 0.866025416 +
                 r * (0.166665043 +
                      r * (-0.0480773503 +
                           r * (0.0243923838 +
                                r * (-0.0142895648 + r * (0.00766430175 + r * (-0.0029228305 + r * 0.000542607712))))));
  const Wide c2 = c * c;
  return c - (c * (4 * c2 - 3) - r) * reciprocal(12 * c2 - 3);
}

/// The unit eigenvector of a symmetric matrix whose eigenvalue is the farthest from both others. Entries must be at
/// most 1 in size. If the matrix is nearly a multiple of the identity, the result may be any vector.
///
/// With q = tr A / 3, 6 p^2 = |A - q I|^2, C = (A - q I)/p: C has the eigenvalues 2 cos(t + 2 pi k/3), cos 3t = r =
/// det C / 2. With the sign of p that makes r >= 0 the first of them differs from the others by at least sqrt 3, so
/// that its eigenvector is well-conditioned, and the adjugate of C - 2 cos t I is v v^T times 6 to 9.
[[gnu::always_inline]] inline void isolated_eigenvector(const Symmetric& a, Wide* vector) {
  constexpr double kLeastDeviatorSquare = 1e-60;  // of |A - q I|^2, so that nothing is divided by zero
  Symmetric m = a;
  const Wide mean = (1.0 / 3) * (a.diagonal[0] + a.diagonal[1] + a.diagonal[2]);
  Wide square = Wide{}, mixed = Wide{};
  for (int i = 0; i < 3; ++i) {
    m.diagonal[i] -= mean;
    square += m.diagonal[i] * m.diagonal[i];
    mixed += m.coupled[i] * m.coupled[i];
  }
  const Wide inverse = reciprocal_square_root((1.0 / 6) * square + (1.0 / 3) * mixed + kLeastDeviatorSquare);
  const Wide r = 0.5 * determinant(m) * (inverse * inverse * inverse);
  const Wide scale = r < 0 ? -inverse : inverse, eigenvalue = 2 * cosine_of_third(absolute(r));
  for (int i = 0; i < 3; ++i) {
    m.diagonal[i] = m.diagonal[i] * scale - eigenvalue;
    m.coupled[i] *= scale;
  }
  Symmetric adjugate;
  for (int i = 0; i < 3; ++i) {
    const int j = i == 2 ? 0 : i + 1, k = i == 0 ? 2 : i - 1;
    adjugate.diagonal[i] = m.diagonal[j] * m.diagonal[k] - m.coupled[j] * m.coupled[j];
    adjugate.coupled[i] = m.coupled[j] * m.coupled[k] - m.coupled[i] * m.diagonal[k];
  }
  // The column with the largest diagonal entry.
  const Wide *d = adjugate.diagonal, *o = adjugate.coupled;
  const auto second = d[1] > d[0];
  const Wide larger = second ? d[1] : d[0];
  const auto third = d[2] > larger;
  vector[0] = third ? o[2] : second ? o[0] : d[0];
  vector[1] = third ? o[1] : second ? d[1] : o[0];
  vector[2] = third ? d[2] : second ? o[1] : o[2];
  const Wide normalize = reciprocal_square_root(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2]);
  for (int k = 0; k < 3; ++k) vector[k] *= normalize;
}

/// Finds two vectors that complete n, |n| = 1, to an orthonormal basis.         Duff et al., JCGT 6(1), 2017
[[gnu::always_inline]] inline void complete_basis(const Wide* n, Wide* u, Wide* v) {
  const Wide sign = n[2] < 0 ? wide(-1) : wide(1), a = -reciprocal(sign + n[2]), b = n[0] * n[1] * a;
  u[0] = 1 + sign * n[0] * n[0] * a;
  u[1] = sign * b;
  u[2] = -sign * n[0];
  v[0] = b;
  v[1] = sign + n[1] * n[1] * a;
  v[2] = -n[1];
}

[[gnu::always_inline]] inline Wide dot(const Wide* a, const Wide* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// Returns J^T J divided by its trace; `inverse_trace` receives 1 / trace.
[[gnu::always_inline]] inline Symmetric right_gram(const Wide* j, Wide& inverse_trace) {
  Symmetric a;
  for (int i = 0; i < 3; ++i) {
    const int k = i == 2 ? 0 : i + 1;
    a.diagonal[i] = j[i] * j[i] + j[3 + i] * j[3 + i] + j[6 + i] * j[6 + i];
    a.coupled[i] = j[i] * j[k] + j[3 + i] * j[3 + k] + j[6 + i] * j[6 + k];
  }
  inverse_trace = reciprocal(a.diagonal[0] + a.diagonal[1] + a.diagonal[2]);
  for (int i = 0; i < 3; ++i) a.diagonal[i] *= inverse_trace, a.coupled[i] *= inverse_trace;
  return a;
}

/// The right singular vectors v_i of J, the vectors J v_i, and the squares of the singular values.
struct Singular {
  Wide v[3][3], jv[3][3], square[3];
};

/// v_0 is the isolated eigenvector of J^T J. The others are found from the images under J of the plane perpendicular to
/// it, not from J^T J, so that small singular values are as accurate as J.
[[gnu::always_inline]] inline void decompose(const Wide* j, Singular& result) {
  Wide inverse_trace;
  auto& [v, jv, square] = result;
  isolated_eigenvector(right_gram(j, inverse_trace), v[0]);
  complete_basis(v[0], v[1], v[2]);
  for (int i = 0; i < 3; ++i)
    for (int r = 0; r < 3; ++r) jv[i][r] = dot(j + 3 * r, v[i]);
  const Rotation rotation(inverse_trace * dot(jv[1], jv[1]), inverse_trace * dot(jv[2], jv[2]),
                          inverse_trace * dot(jv[1], jv[2]));
  rotation.turn(v[1], v[2]);
  rotation.turn(jv[1], jv[2]);
  for (int i = 0; i < 3; ++i) square[i] = dot(jv[i], jv[i]);
}

}  // namespace subvol::internal
