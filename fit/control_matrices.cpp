// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/control_matrices.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <limits>

namespace subvol {

namespace {

constexpr double kRoundoff = std::numeric_limits<double>::epsilon() / 2;

Wide all(double x) { return Wide{} + x; }

/// About the transposed rotation of m's polar decomposition, by Newton's iteration, scaled while far from it (Higham).
/// As m comes closer to a singular matrix, better and better; and times m symmetric.
Mat3 unrotate(const Mat3& m) {
  const auto inverse_transposed = [](const Mat3& x) {
    Mat3 result;
    for (int d = 0; d < 3; ++d) result.col(d) = x.col((d + 1) % 3).cross(x.col((d + 2) % 3));
    return Mat3(result / x.col(0).dot(result.col(0)));
  };
  const double near = m.determinant();
  const Mat3 first_inverse = inverse_transposed(m);
  Mat3 rotation = m, inverse = first_inverse;
  for (int step = 0; step < 12; ++step) {
    if (step > 0) inverse = inverse_transposed(rotation);
    const double distance = (inverse - rotation).squaredNorm();
    const double factor = distance > 1 ? std::sqrt(inverse.norm() / rotation.norm()) : 1;
    rotation = 0.5 * (factor * rotation + inverse / factor);
    if (distance < near) break;
  }
  const Mat3 product = rotation.transpose() * m;
  return rotation.transpose() - 0.5 * (product - product.transpose()) * first_inverse.transpose();
}

/// Mean square of the entries of rotation (J_b - mean) frame, over some of the matrices that are spread over all.
Mat3 variation(const ControlMatrices& matrices, const Mat3& mean, const Mat3& rotation, const Mat3& frame) {
  constexpr std::size_t kMost = 8;  // vectors of them; more make little difference (measured)
  const std::size_t vectors = (matrices.size() + kWide - 1) / kWide, sampled = std::min(vectors, kMost);
  Wide products[3][6] = {};  // of the columns of rotation (J - mean), by its rows
  for (std::size_t i = 0; i < sampled; ++i) {
    const std::size_t at = std::min(i == 0 ? 0 : i * (vectors - 1) / (sampled - 1) * kWide, matrices.size() - kWide);
    Wide turned[3][3];
    for (int c = 0; c < 3; ++c) {
      Wide j[3];
      for (int r = 0; r < 3; ++r) j[r] = load_wide(matrices.entries(r, c) + at) - mean(r, c);
      for (int r = 0; r < 3; ++r)
        turned[r][c] = rotation(r, 0) * j[0] + rotation(r, 1) * j[1] + rotation(r, 2) * j[2];
    }
    for (int r = 0; r < 3; ++r)
      for (int c = 0, pair = 0; c < 3; ++c)
        for (int d = c; d < 3; ++d) products[r][pair++] += turned[r][c] * turned[r][d];
  }
  Mat3 result;
  for (int r = 0; r < 3; ++r) {
    Mat3 moments;
    for (int c = 0, pair = 0; c < 3; ++c)
      for (int d = c; d < 3; ++d) moments(c, d) = moments(d, c) = sum_of_lanes(products[r][pair++]);
    for (int c = 0; c < 3; ++c) result(r, c) = frame.col(c).dot(moments * frame.col(c));
  }
  return result / static_cast<double>(kWide * sampled);
}

/// c, up to a factor. lengths: of the columns of M frame.
Vec3 scales_by_variation(const Mat3& variation, const Vec3& lengths) {
  constexpr double kLeast = 0.01;  // squared share of the lengths, beside which less variation does not count
  const Mat3 v = variation + kLeast * Vec3::Ones() * lengths.cwiseAbs2().transpose();
  Vec3 result;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    result[i] = std::cbrt(std::sqrt(v(i, j) / v(j, i) * (v(i, k) / v(k, i))));
  }
  return result;
}

constexpr std::size_t kNone = static_cast<std::size_t>(-1);

struct Bound {
  double value;                    ///< of det J, 0: none
  bool is_final;                   ///< no other L finds one
  std::size_t in_the_way = kNone;  ///< b of an S_b that is not positive definite, if one is known
};

int lowest_place(const Wide& x) {
  int result = 0;
  for (int k = 1; k < kWide; ++k)
    if (x[k] < x[result]) result = k;
  return result;
}

/// L + (margin - e) v (J_b D v)^T / |J_b D v|^2, where e <= 0 is the least eigenvalue of sym(L J_b D) and v its
/// eigenvector: then v^T L J_b D v = margin. A step of the perceptron algorithm for an L that suits all b.
Mat3 turned(Mat3 l, const Mat3& scaled_matrix) {
  constexpr double kMargin = 0.06;  // against L's largest entry
  l /= l.cwiseAbs().maxCoeff();
  const Mat3 product = l * scaled_matrix;
  Eigen::SelfAdjointEigenSolver<Mat3> solver;
  solver.computeDirect(Mat3(0.5 * (product + product.transpose())));
  const double least = std::min(0.0, solver.eigenvalues()[0]);
  const Vec3 v = solver.eigenvectors().col(0), w = scaled_matrix * v;
  return l + (kMargin - least) / w.squaredNorm() * v * w.transpose();
}

/// The bound by one L.
///
/// scale  D
/// begin  number of the matrix to begin with: one that another L failed at is likely to be in the way again
Bound bound_by(Mat3 l, const Vec3& scale, const Mat3& mean, const ControlMatrices& matrices, const Mat3& remainder,
               std::size_t begin) {
  constexpr double kLeastDeterminant = 1e-3;  // of L, by its largest entry cubed: so it is good to 1e-11
  l /= l.cwiseAbs().maxCoeff();
  if (!(l.determinant() > kLeastDeterminant)) return {0, false};
  const Mat3 g = l.cwiseAbs() * remainder * scale.asDiagonal();
  Vec3 shift;
  for (int i = 0; i < 3; ++i) shift[i] = 0.5 * (1 + 1e-12) * (g.row(i).sum() + g.col(i).sum());
  if (!(((l * mean * scale.asDiagonal()).diagonal() - shift).minCoeff() > 0)) return {0, false};

  // T_b = D^-1 S_b D^-1: what is scaled are the extremes over all b.
  const Mat3 unscaled = scale.cwiseInverse().asDiagonal() * l, half = 0.5 * unscaled;
  const Vec3 start = -shift.cwiseQuotient(scale.cwiseAbs2());
  Wide first = all(std::numeric_limits<double>::infinity()), second = first, third = first;  // least leading minors
  Wide sizes[6] = {};                                                                        // largest entries
  const std::size_t count = matrices.size();
  const std::size_t vectors = (count + kWide - 1) / kWide;
  for (std::size_t n = 0, vector = begin / kWide; n < vectors; ++n, vector = vector + 1 < vectors ? vector + 1 : 0) {
    const std::size_t at = std::min(vector * kWide, count - kWide);  // the last lanes overlap
    Wide j[3][3];
    for (int r = 0; r < 3; ++r)
      for (int d = 0; d < 3; ++d) j[r][d] = load_wide(matrices.entries(r, d) + at);
    const auto diagonal = [&](int i) {
      return start[i] + unscaled(i, 0) * j[0][i] + unscaled(i, 1) * j[1][i] + unscaled(i, 2) * j[2][i];
    };
    const auto beside = [&](int i, int k) {
      return half(i, 0) * j[0][k] + half(i, 1) * j[1][k] + half(i, 2) * j[2][k] + half(k, 0) * j[0][i] +
             half(k, 1) * j[1][i] + half(k, 2) * j[2][i];
    };
    const Wide t00 = diagonal(0), t11 = diagonal(1), t22 = diagonal(2);
    const Wide t01 = beside(0, 1), t02 = beside(0, 2), t12 = beside(1, 2);
    const Wide minor = t00 * t11 - t01 * t01;
    const Wide determinant = t22 * minor - t12 * (t00 * t12 - t01 * t02) + t02 * (t01 * t12 - t02 * t11);
    Wide least = t00;
    take_lower(least, minor);
    take_lower(least, determinant);
    if (lanes_within(least, 0)) {
      const Wide own = j[0][0] * (j[1][1] * j[2][2] - j[1][2] * j[2][1]) -
                       j[0][1] * (j[1][0] * j[2][2] - j[1][2] * j[2][0]) +
                       j[0][2] * (j[1][0] * j[2][1] - j[1][1] * j[2][0]);
      return {0, lanes_within(own, 0) != 0, at + lowest_place(least)};  // S_b > 0 has det J_b > 0
    }
    take_lower(first, t00);
    take_lower(second, minor);
    take_lower(third, determinant);
    const Wide entries[6] = {t00, t11, t22, t01, t02, t12};
    for (int e = 0; e < 6; ++e) take_higher_size(sizes[e], entries[e]);
  }
  const auto scaled_size = [&](int e, int i, int k) { return highest_lane(sizes[e]) * scale[i] * scale[k]; };
  const double largest = std::max({scaled_size(0, 0, 0), scaled_size(1, 1, 1), scaled_size(2, 2, 2),
                                   scaled_size(3, 0, 1), scaled_size(4, 0, 2), scaled_size(5, 1, 2)});
  const double to_second = scale[0] * scale[0] * scale[1] * scale[1], to_third = to_second * scale[2] * scale[2];
  // Products of two entries with at most 3 roundings each in a second minor, six of three with 5 to 6 in a third.
  const double least_third = to_third * lowest_lane(third) - 100 * kRoundoff * largest * largest * largest;
  if (!(largest < 1e30 && lowest_lane(first) > 0 &&
        to_second * lowest_lane(second) > 9 * kRoundoff * largest * largest && least_third > 0))
    return {0, false};
  return {least_third * (1 - 1e-11) / (scale.prod() * l.determinant()), true};
}

}  // namespace

Mat3 ControlMatrices::mean() const {
  const std::size_t last = count_ - kWide, step = count_ > 16 * kWide ? 2 * kWide : kWide;
  const double sampled = kWide * (static_cast<double>(last / step) + 2);
  Mat3 result;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) {
      const double* x = entries(r, c);
      Wide sum = load_wide(x + last);
      for (std::size_t b = 0; b <= last; b += step) sum += load_wide(x + b);
      result(r, c) = sum_of_lanes(sum) / sampled;
    }
  return result;
}

double determinant_bound(const ControlMatrices& matrices, const Mat3& remainder, const Mat3& frame) {
  constexpr int kMostTurns = 3;  // more cost what they save (measured)
  const Mat3 mean = matrices.mean();
  const Vec3 lengths = mean.colwise().norm().transpose(), scale = lengths.cwiseInverse();
  if (!((mean * scale.asDiagonal()).determinant() > 1e-12)) return 0;  // also where a column is 0 or not finite
  const auto bound = [&](const Mat3& l, std::size_t start = 0) {
    return bound_by(l, scale, mean, matrices, remainder, start == kNone ? 0 : start);
  };
  const bool is_framed = frame != Mat3::Identity();

  const Mat3 framed = is_framed ? Mat3(mean * frame) : mean;
  const Vec3 framed_lengths = is_framed ? Vec3(framed.colwise().norm().transpose()) : lengths;
  const Mat3 to_frame = scale.asDiagonal() * frame.inverse().transpose();
  const Mat3 rotation = unrotate(framed * framed_lengths.cwiseInverse().asDiagonal());
  Bound result = bound(to_frame * framed_lengths.asDiagonal() * rotation);
  if (result.is_final) return result.value;

  const Vec3 c = scales_by_variation(variation(matrices, mean, rotation, frame), framed_lengths);
  const double size = std::cbrt(framed.determinant() * c.prod());
  Mat3 l = to_frame * c.cwiseInverse().asDiagonal() * unrotate(framed * (c / size).asDiagonal());
  result = bound(l, result.in_the_way);
  for (int turn = 0; turn < kMostTurns && !result.is_final && result.in_the_way != kNone; ++turn) {
    l = turned(l, matrices[result.in_the_way] * scale.asDiagonal());
    result = bound(l, result.in_the_way);
  }
  // The remainder is smallest by the box's own coordinates.
  if (!result.is_final && is_framed) result = bound(unrotate(mean * scale.asDiagonal()), result.in_the_way);
  return result.value;
}

}  // namespace subvol
