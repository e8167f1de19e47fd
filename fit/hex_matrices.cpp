// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/hex_matrices.h"

#include <algorithm>
#include <limits>

namespace subvol {

namespace {

/// Of n coefficients, `stride` vectors apart.
template <int n>
void halve_line(Wide* low, Wide* high, int stride) {
  Wide x[n];
  for (int i = 0; i < n; ++i) x[i] = low[i * stride];
  high[(n - 1) * stride] = x[n - 1];
  for (int round = 1; round < n; ++round) {
    for (int i = n - 1; i >= round; --i) x[i] = 0.5 * (x[i - 1] + x[i]);
    high[(n - 1 - round) * stride] = x[n - 1];
  }
  for (int i = 1; i < n; ++i) low[i * stride] = x[i];
}

using HalveLine = void (*)(Wide*, Wide*, int);
constexpr HalveLine kHalveLine[] = {nullptr,       nullptr,       halve_line<2>, halve_line<3>, halve_line<4>,
                                    halve_line<5>, halve_line<6>, halve_line<7>, halve_line<8>};

/// What coefficient k of a line of kWide counts in those of the halves: C(o, k) / 2^o in number o of the lower one.
struct HalvingWeights {
  constexpr HalvingWeights() {
    for (int o = 0; o < kWide; ++o) {
      double weight = 1;
      for (int i = 0; i < o; ++i) weight /= 2;
      for (int k = 0; k <= o; ++k) {
        low[k][o] = high[kWide - 1 - k][kWide - 1 - o] = weight;
        weight = weight * (o - k) / (k + 1);
      }
    }
  }
  double low[kWide][kWide] = {}, high[kWide][kWide] = {};
};
constexpr HalvingWeights kHalving;

}  // namespace

void HexCoefficients::halve(int direction, HexCoefficients& high) {
  high.resize(num_u_, num_w_);
  for (int row = 0; row < 3; ++row) {
    Wide *x = coordinate(row), *y = high.coordinate(row);
    if (direction == 0) {
      for (int w = 0; w < num_w_; ++w) kHalveLine[num_u_](x + w, y + w, num_w_);
    } else if (direction == 2) {
      for (int u = 0; u < num_u_; ++u) kHalveLine[num_w_](x + u * num_w_, y + u * num_w_, 1);
    } else {
      for (int n = 0; n < num_vectors(); ++n) {
        Wide lower{}, upper{};
        for (int k = 0; k < kWide; ++k) {
          lower += x[n][k] * load_wide(kHalving.low[k]);
          upper += x[n][k] * load_wide(kHalving.high[k]);
        }
        x[n] = lower, y[n] = upper;
      }
    }
  }
}

void HexMatrices::set(const HexCoefficients& coefficients) {
  of_ = &coefficients;
  is_narrowed_ = false;
  num_u_ = of_->num_u(), num_w_ = of_->num_w();
  auto& weights = all_weights_[num_u_][num_w_];
  if (!weights) {
    auto made = std::make_unique<Weights>();
    for (int n = 0; n < of_->num_vectors(); ++n) {
      const int u = n / num_w_, w = n % num_w_;
      const int counts[4] = {u, num_u_ - 1 - u, w, num_w_ - 1 - w};
      for (int i = 0; i < 4; ++i) {
        made->of[n][i] = counts[i];
        std::fill_n(made->narrow[i].data() + n * kWide, kWide, static_cast<float>(counts[i]));
      }
    }
    weights = std::move(made);
  }
  weights_ = weights.get();
}

Mat3 HexMatrices::operator[](std::size_t b) const {
  const std::size_t vector = b / kWide;
  const int v = static_cast<int>(b % kWide);
  const auto [low_u, high_u, low_w, high_w] = weights_->of[vector];
  Mat3 result;
  for (int row = 0; row < 3; ++row) {
    const Wide* x = of_->coordinate(row) + vector;
    const double here = x[0][v];
    result(row, 0) = low_u * (here - x[-num_w_][v]) + high_u * (x[num_w_][v] - here);
    result(row, 1) = 0;
    if (v > 0) result(row, 1) += v * (here - x[0][v - 1]);
    if (v < kWide - 1) result(row, 1) += (kWide - 1 - v) * (x[0][v + 1] - here);
    result(row, 2) = low_w * (here - x[-1][v]) + high_w * (x[1][v] - here);
  }
  return result;
}

Mat3 HexMatrices::mean() const {
  Mat3 result;
  for (int row = 0; row < 3; ++row) {
    const Wide *x = of_->coordinate(row), *last = x + (num_u_ - 1) * num_w_;
    Wide low_u{}, high_u{}, low_w{}, high_w{};
    for (int w = 0; w < num_w_; ++w) low_u += x[w], high_u += last[w];
    for (int u = 0; u < num_u_; ++u) low_w += x[u * num_w_], high_w += x[u * num_w_ + num_w_ - 1];
    const Wide all = low_u + high_u + low_w + high_w;
    result(row, 0) = sum_of_lanes(high_u - low_u) / (kWide * num_w_);
    result(row, 1) = (all[kWide - 1] - all[0]) / (2 * (num_u_ + num_w_));
    result(row, 2) = sum_of_lanes(high_w - low_w) / (kWide * num_u_);
  }
  return result;
}

Mat3 HexMatrices::variation() const {
  constexpr Wide kInside{1, 1, 1, 1, 1, 1, 0, 0};  // where there are two more
  const auto size = [](const Wide& x) { return x < 0 ? -x : x; };
  const int degree_u = num_u_ - 1, degree_v = kWide - 1, degree_w = num_w_ - 1;
  Wide uu{}, vv{}, ww{}, uv{}, uw{}, vw{};
  for (int row = 0; row < 3; ++row)
    for (int u = 0; u < degree_u; u += 2)
      for (int w = 0; w < degree_w; w += 2) {
        const Wide* x = of_->coordinate(row) + u * num_w_ + w;
        const Wide step_u = x[num_w_] - x[0], step_v = shifted_down(x[0]) - x[0], step_w = x[1] - x[0];
        uv += size(shifted_down(step_u) - step_u);
        vw += size(shifted_down(step_w) - step_w);
        uw += size(x[num_w_ + 1] - x[1] - step_u);
        vv += size(kInside * (shifted_down(step_v) - step_v));
        if (u + 2 <= degree_u) uu += size(x[2 * num_w_] - x[num_w_] - step_u);
        if (w + 2 <= degree_w) ww += size(x[2] - x[1] - step_w);
      }
  const int samples_u = num_u_ / 2, samples_w = num_w_ / 2;
  const auto mean = [](const Wide& sum, int samples) { return sum_of_lanes(sum) / (kWide * std::max(samples, 1)); };
  Mat3 result;
  result(0, 0) = degree_u * (degree_u - 1) * mean(uu, degree_u / 2 * samples_w);
  result(1, 1) = degree_v * (degree_v - 1) * mean(vv, samples_u * samples_w);
  result(2, 2) = degree_w * (degree_w - 1) * mean(ww, samples_u * (degree_w / 2));
  result(0, 1) = result(1, 0) = degree_u * degree_v * mean(uv, samples_u * samples_w);
  result(0, 2) = result(2, 0) = degree_u * degree_w * mean(uw, samples_u * samples_w);
  result(1, 2) = result(2, 1) = degree_v * degree_w * mean(vw, samples_u * samples_w);
  return result;
}

HexMatrices::Product HexMatrices::times(const Mat3& l) {
  product_.resize(num_u_, num_w_);
  const Wide *x = of_->coordinate(0), *y = of_->coordinate(1), *z = of_->coordinate(2);
  for (int row = 0; row < 3; ++row) {
    Wide* out = product_.coordinate(row);
    for (int n = 0; n < num_u_ * num_w_; ++n) out[n] = l(row, 0) * x[n] + l(row, 1) * y[n] + l(row, 2) * z[n];
  }
  return Product(*this);
}

void HexMatrices::make_narrow() {
  const int count = num_u_ * num_w_, middle = num_u_ / 2 * num_w_ + num_w_ / 2;
  for (int row = 0; row < 3; ++row) {
    const Wide* x = of_->coordinate(row);
    const double origin = x[middle][kWide / 2];
    Wide size{};
    for (int n = 0; n < count; ++n) {
      const Wide relative = x[n] - origin;
      take_higher_size(size, relative);
      store_wide(narrow(relative), narrow_[row].data() + n * kWide);
    }
    if (count % 2 != 0) store_wide(Narrow{}, narrow_[row].data() + count * kWide);  // the rest of the last kWideFloats
    narrow_sizes_[row] = highest_lane(size);
    if (!(narrow_sizes_[row] < kMostNarrow)) {  // no number must be infinite, even if it counts 0 times
      narrow_[row].fill(0);
      narrow_sizes_[row] = std::numeric_limits<double>::max();
    }
  }
  is_narrowed_ = true;
}

HexMatrices::NarrowProduct HexMatrices::narrow_product(const Mat3& l) {
  if (!is_narrowed_) make_narrow();
  // q differences of two numbers with 5 roundings each, one for each of three operations with them, and two more for
  // what is made of entries.
  constexpr double kRoundings = 20 * (kWide - 1);
  narrow_errors_ = kRoundings * (std::numeric_limits<float>::epsilon() / 2) * l.cwiseAbs() * narrow_sizes_;
  if (!(l.cwiseAbs().maxCoeff() < kMostNarrow)) narrow_errors_.setConstant(std::numeric_limits<double>::max());
  if (!(narrow_errors_.maxCoeff() <= kMostError)) return NarrowProduct(*this);
  const Eigen::Matrix3f factors = l.cast<float>();
  const int count = num_u_ * num_w_ * kWide;
  for (int n = 0; n < count; n += kWideFloats) {  // what is behind the end is 0, and counts 0 times
    const WideFloats x = load_wide(narrow_[0].data() + n), y = load_wide(narrow_[1].data() + n),
                     z = load_wide(narrow_[2].data() + n);
    for (int row = 0; row < 3; ++row)
      store_wide(factors(row, 0) * x + factors(row, 1) * y + factors(row, 2) * z,
                 narrow_product_[row].data() + kNarrowMargin + n);
  }
  return NarrowProduct(*this);
}

}  // namespace subvol
