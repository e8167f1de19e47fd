// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/energies/point_jacobians.h"

#include <algorithm>
#include <array>
#include <cassert>

namespace subvol::internal {

namespace {

/// 1 / |d|; of shorter d, that of the least length.
Wide reciprocal_length(const std::array<Wide, 3>& d, double least) {
  Wide squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
  take_higher(squared, Wide{} + least * least);
  return reciprocal_square_root(squared);
}

}  // namespace

PointJacobians::PointJacobians(const ElementRule& rule)
    : num_corners_(static_cast<std::size_t>(cell_topology(rule.kind).num_vertices)),
      num_groups_((rule.num_points() + kWide - 1) / kWide),
      gradients_(num_groups_ * 3 * num_corners_ * kWide) {
  assert(num_groups_ * kWide <= kMostPointJacobians);
  for (std::size_t value = 0; value < num_groups_ * kWide; ++value)
    for (const ElementRule::Entry& entry : rule.point(std::min(value, rule.num_points() - 1)))
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t row = (value / kWide * 3 + k) * num_corners_ + static_cast<std::size_t>(entry.vertex);
        gradients_[kWide * row + value % kWide] = entry.gradient[k];
      }
}

void PointJacobians::evaluate(const Vec3* corners, double least_length, double* values) const {
  const double* gradient = gradients_.data();
  for (std::size_t group = 0; group < num_groups_; ++group) {
    std::array<std::array<Wide, 3>, 3> d{};
    for (std::array<Wide, 3>& column : d)
      for (std::size_t a = 0; a < num_corners_; ++a, gradient += kWide) {
        const Wide weight = load_wide(gradient);
        for (int c = 0; c < 3; ++c) column[c] += weight * corners[a][c];
      }
    const Wide determinant = d[0][0] * (d[1][1] * d[2][2] - d[1][2] * d[2][1]) +
                             d[0][1] * (d[1][2] * d[2][0] - d[1][0] * d[2][2]) +
                             d[0][2] * (d[1][0] * d[2][1] - d[1][1] * d[2][0]);
    const Wide scale = reciprocal_length(d[0], least_length) * reciprocal_length(d[1], least_length) *
                       reciprocal_length(d[2], least_length);
    store_wide(determinant * scale, values + kWide * group);
  }
}

double PointJacobians::least(const Vec3* corners, double least_length) const {
  std::array<double, kMostPointJacobians> values;
  evaluate(corners, least_length, values.data());
  return *std::min_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(kWide * num_groups_));
}

}  // namespace subvol::internal
