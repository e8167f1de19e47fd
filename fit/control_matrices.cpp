// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/control_matrices.h"

#include <Eigen/LU>

#include <cmath>
#include <limits>

namespace subvol {

namespace {

constexpr double kRoundoff = std::numeric_limits<double>::epsilon() / 2;

Wide all(double x) { return Wide{} + x; }
Wide absolute(const Wide& x) { return x < 0 ? -x : x; }

/// Transposed rotation of the polar decomposition, by Newton's iteration, scaled while far from it (Higham).
Mat3 unrotate(Mat3 m) {
  for (int step = 0; step < 12; ++step) {
    const Mat3 inverse = m.inverse().transpose();
    const double distance = (inverse - m).squaredNorm();
    const double factor = distance > 0.1 ? std::sqrt(inverse.norm() / m.norm()) : 1;
    m = 0.5 * (factor * m + inverse / factor);
    if (distance < 1e-6) break;  // the next one would be below 1e-12
  }
  return m.transpose();
}

/// Extremes over all S_b, per lane.
struct Extremes {
  Wide first = all(std::numeric_limits<double>::infinity()), second = first, third = first;  // least leading minors
  Wide largest = all(0);                                                                     // largest entry
};

}  // namespace

Mat3 ControlMatrices::mean() const {
  Mat3 result;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) {
      const double* x = entries(r, c);
      Wide sum{};
      std::size_t b = 0;
      for (; b + kWide <= count_; b += kWide) sum += load_wide(x + b);
      double total = 0;
      for (; b < count_; ++b) total += x[b];
      for (int lane = 0; lane < kWide; ++lane) total += sum[lane];
      result(r, c) = total / static_cast<double>(count_);
    }
  return result;
}

double determinant_bound(const ControlMatrices& matrices, const Mat3& remainder) {
  const Mat3 mean = matrices.mean();
  const Vec3 scale = mean.colwise().norm().cwiseInverse().transpose();
  const Mat3 normalised = mean * scale.asDiagonal();
  if (!(normalised.determinant() > 1e-12)) return 0;  // also where a column is 0 or not finite
  const Mat3 l = unrotate(normalised);
  const Mat3 g = l.cwiseAbs() * remainder * scale.asDiagonal();
  Vec3 shift;
  for (int i = 0; i < 3; ++i) shift[i] = 0.5 * (1 + 1e-12) * (g.row(i).sum() + g.col(i).sum());
  if (!(shift.maxCoeff() < 1 && l.cwiseAbs().maxCoeff() < 2 && l.determinant() > 0.5)) return 0;

  Extremes x;
  const std::size_t count = matrices.size();
  constexpr std::size_t kBetween = 8 * kWide;  // looks at whether all is lost
  for (std::size_t b = 0; b < count; b += kWide) {
    if (b % kBetween == 0 && !(lowest_lane(x.first) > 0 && lowest_lane(x.second) > 0 && lowest_lane(x.third) > 0))
      return 0;
    const std::size_t at = std::min(b, count - kWide);  // the last lanes overlap
    Wide m[3][3] = {};
    for (int c = 0; c < 3; ++c) {
      const Wide j0 = load_wide(matrices.entries(0, c) + at) * scale[c];
      const Wide j1 = load_wide(matrices.entries(1, c) + at) * scale[c];
      const Wide j2 = load_wide(matrices.entries(2, c) + at) * scale[c];
      for (int i = 0; i < 3; ++i) m[i][c] = l(i, 0) * j0 + l(i, 1) * j1 + l(i, 2) * j2;
    }
    const Wide s00 = m[0][0] - shift[0], s11 = m[1][1] - shift[1], s22 = m[2][2] - shift[2];
    const Wide s01 = 0.5 * (m[0][1] + m[1][0]), s02 = 0.5 * (m[0][2] + m[2][0]), s12 = 0.5 * (m[1][2] + m[2][1]);
    const Wide second = s00 * s11 - s01 * s01;
    const Wide third = s22 * second - s12 * (s00 * s12 - s01 * s02) + s02 * (s01 * s12 - s02 * s11);
    take_lower(x.first, s00);
    take_lower(x.second, second);
    take_lower(x.third, third);
    for (const Wide& entry : {s00, s11, s22, s01, s02, s12}) take_higher(x.largest, absolute(entry));
  }
  double largest = 0;
  for (int lane = 0; lane < kWide; ++lane) largest = std::max(largest, x.largest[lane]);
  // Products of two entries with at most 3 roundings each in a second minor, six of three with 5 to 6 in a third.
  const double third = lowest_lane(x.third) - 96 * kRoundoff * largest * largest * largest;
  if (!(largest < 1e30 && lowest_lane(x.first) > 0 && lowest_lane(x.second) > 8 * kRoundoff * largest * largest &&
        third > 0))
    return 0;
  const double unscale = scale[0] * scale[1] * scale[2] * l.determinant();
  return third * (1 - 1e-12) / unscale;
}

}  // namespace subvol
