// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/certificate/prism_matrices.h"

#include "subvol/fit/certificate/simplex_tables.h"

#include <algorithm>
#include <limits>

namespace subvol::internal {

struct PrismMatrices::Triangle {
  /// Numbers of alpha - e_c + e_i for c = 0, 1, 2: neighbors of alpha, and of one another.
  struct Neighbors {
    int u0, v0;  ///< alpha - e_0 + e_1, + e_2
    int o1, v1;  ///< alpha - e_1 + e_0, + e_2
    int o2, u2;  ///< alpha - e_2 + e_0, + e_1
    std::array<float, 3> exponents;
  };
  explicit Triangle(int degree);

  std::vector<Neighbors> neighbors;       ///< by alpha; alpha itself if there is none, and the exponent is 0
  std::array<std::vector<int>, 3> edges;  ///< the alpha with alpha_c = 0
  std::array<std::size_t, 3> corners;
  int middle;
};

PrismMatrices::Triangle::Triangle(int degree) {
  const SimplexIndex& index = SimplexTables::get(2, degree).index;
  for (int n = 0; n < index.size(); ++n) {
    const SimplexIndex::Exponents e = index.exponents(n);
    const auto moved = [&](int from, int to) {
      if (e[from] == 0) return n;
      SimplexIndex::Exponents other = e;
      --other[from], ++other[to];
      return index.find(other);
    };
    neighbors.push_back({moved(0, 1),
                         moved(0, 2),
                         moved(1, 0),
                         moved(1, 2),
                         moved(2, 0),
                         moved(2, 1),
                         {static_cast<float>(e[0]), static_cast<float>(e[1]), static_cast<float>(e[2])}});
    for (int c = 0; c < 3; ++c) {
      if (e[c] == 0) edges[c].push_back(n);
      if (e[c] == degree) corners[c] = static_cast<std::size_t>(n);
    }
  }
  SimplexIndex::Exponents center{};
  center[1] = center[2] = static_cast<std::int8_t>(degree / 3);
  center[0] = static_cast<std::int8_t>(degree - 2 * (degree / 3));
  middle = index.find(center);
}

PrismMatrices::PrismMatrices() = default;
PrismMatrices::~PrismMatrices() = default;
PrismMatrices::PrismMatrices(PrismMatrices&&) noexcept = default;

void PrismMatrices::resize(int degree) {
  is_narrowed_ = false;
  if (degree == degree_) return;
  if (triangles_.size() <= static_cast<std::size_t>(degree)) triangles_.resize(degree + 1);
  if (!triangles_[degree]) triangles_[degree] = std::make_unique<Triangle>(degree);
  triangle_ = triangles_[degree].get();
  degree_ = degree;
  count_ = static_cast<int>(triangle_->neighbors.size());
  for (int row = 0; row < 3; ++row) {
    x_[row].resize(count_);
    product_[row].resize(count_);
    narrow_[row].resize(count_);
    narrow_product_[row].resize(count_);
  }
}

template <class Lanes>
void PrismMatrices::load(const std::array<std::vector<Lanes>, 3>& x, std::size_t first, MatrixOf<Lanes>& result) const {
  using Number = NumberOf<Lanes>;
  constexpr Lanes kLowW{0, 1, 2, 3, 4, 5, 6, 7}, kHighW = kWide - 1 - kLowW;
  const std::size_t n = first / kWide;
  const Triangle::Neighbors& at = triangle_->neighbors[n];
  const Number e0 = at.exponents[0], e1 = at.exponents[1], e2 = at.exponents[2];
  for (int row = 0; row < 3; ++row) {
    const Lanes* of = x[row].data();
    const Lanes here = of[n], o1 = of[at.o1], o2 = of[at.o2];
    result[row][0] = e0 * (of[at.u0] - here) + e1 * (here - o1) + e2 * (of[at.u2] - o2);
    result[row][1] = e0 * (of[at.v0] - here) + e1 * (of[at.v1] - o1) + e2 * (here - o2);
    const Lanes step = shifted_down(here) - here;
    result[row][2] = kLowW * shifted_up(step) + kHighW * step;
  }
}
template void PrismMatrices::load(const std::array<std::vector<Wide>, 3>&, std::size_t, WideMatrix&) const;
template void PrismMatrices::load(const std::array<std::vector<Narrow>, 3>&, std::size_t, MatrixOf<Narrow>&) const;

Mat3 PrismMatrices::operator[](std::size_t b) const {
  WideMatrix wide;
  load(b / kWide * kWide, wide);
  Mat3 result;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) result(r, c) = wide[r][c][b % kWide];
  return result;
}

std::array<std::size_t, 3> PrismMatrices::corners() const {
  std::array<std::size_t, 3> result = triangle_->corners;
  for (std::size_t& corner : result) corner *= kWide;
  return result;
}

/// The integral of dX/du over the triangle is that of X along the edge u + v = 1 minus that along u = 0.
Mat3 PrismMatrices::mean() const {
  Mat3 result;
  for (int row = 0; row < 3; ++row) {
    Wide sums[3] = {};
    for (int c = 0; c < 3; ++c)
      for (const int n : triangle_->edges[c]) sums[c] += x_[row][n];
    const Wide all = sums[0] + sums[1] + sums[2];
    const double of_edge = degree_ + 1;
    for (int column = 0; column < 2; ++column)
      result(row, column) = 2 * sum_of_lanes(sums[0] - sums[column + 1]) / (kWide * of_edge);
    result(row, 2) = (all[kWide - 1] - all[0]) / (3 * of_edge);
  }
  return result;
}

PrismMatrices::Product PrismMatrices::times(const Mat3& l) {
  for (int row = 0; row < 3; ++row)
    for (int n = 0; n < count_; ++n)
      product_[row][n] = l(row, 0) * x_[0][n] + l(row, 1) * x_[1][n] + l(row, 2) * x_[2][n];
  return Product(*this);
}

void PrismMatrices::make_narrow() {
  for (int row = 0; row < 3; ++row) {
    const double origin = x_[row][triangle_->middle][kWide / 2];
    Wide size{};
    for (int n = 0; n < count_; ++n) {
      const Wide relative = x_[row][n] - origin;
      take_higher_size(size, relative);
      narrow_[row][n] = narrow(relative);
    }
    narrow_sizes_[row] = highest_lane(size);
    if (!(narrow_sizes_[row] < kMostNarrow)) {  // no number may be infinite, even with weight 0
      std::fill(narrow_[row].begin(), narrow_[row].end(), Narrow{});
      narrow_sizes_[row] = std::numeric_limits<double>::max();
    }
  }
  is_narrowed_ = true;
}

PrismMatrices::NarrowProduct PrismMatrices::narrow_product(const Mat3& l) {
  if (!is_narrowed_) make_narrow();
  // An entry sums d differences of two numbers with 5 roundings each, one rounding for each of five operations with
  // them, and two more for what is computed from entries.
  const double roundings = 24.0 * std::max(degree_, kWide - 1);
  narrow_errors_ = roundings * (std::numeric_limits<float>::epsilon() / 2) * l.cwiseAbs() * narrow_sizes_;
  if (!(l.cwiseAbs().maxCoeff() < kMostNarrow)) narrow_errors_.setConstant(std::numeric_limits<double>::max());
  if (!(narrow_errors_.maxCoeff() <= kMostError)) return NarrowProduct(*this);
  const Eigen::Matrix3f f = l.cast<float>();
  const Narrow *x = narrow_[0].data(), *y = narrow_[1].data(), *z = narrow_[2].data();
  for (int row = 0; row < 3; ++row) {
    Narrow* out = narrow_product_[row].data();
    for (int n = 0; n < count_; ++n) out[n] = f(row, 0) * x[n] + f(row, 1) * y[n] + f(row, 2) * z[n];
  }
  return NarrowProduct(*this);
}

}  // namespace subvol::internal
