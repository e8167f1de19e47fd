// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/certificate/hex_matrices.h"

#include <algorithm>
#include <limits>
#include <type_traits>

namespace subvol::internal {

namespace {

/// Bisects a line of n coefficients, `stride` vectors apart.
template <int n, class Vector>
void halve_line(Vector* low, Vector* high, int stride) {
  Vector x[n];
  for (int i = 0; i < n; ++i) x[i] = low[i * stride];
  high[(n - 1) * stride] = x[n - 1];
  for (int round = 1; round < n; ++round) {
    for (int i = n - 1; i >= round; --i) x[i] = NumberOf<Vector>(0.5) * (x[i - 1] + x[i]);
    high[(n - 1 - round) * stride] = x[n - 1];
  }
  for (int i = 1; i < n; ++i) low[i * stride] = x[i];
}

template <class Vector>
using HalveLine = void (*)(Vector*, Vector*, int);
template <class Vector>
constexpr HalveLine<Vector> kHalveLine[] = {nullptr,
                                            nullptr,
                                            halve_line<2, Vector>,
                                            halve_line<3, Vector>,
                                            halve_line<4, Vector>,
                                            halve_line<5, Vector>,
                                            halve_line<6, Vector>,
                                            halve_line<7, Vector>,
                                            halve_line<8, Vector>};

/// Weight of coefficient k of a line of kWide in those of its halves: C(o, k) / 2^o in number o of the lower half.
template <class Vector>
struct HalvingWeights {
  constexpr HalvingWeights() {
    for (int o = 0; o < kWide; ++o) {
      double weight = 1;
      for (int i = 0; i < o; ++i) weight /= 2;
      for (int k = 0; k <= o; ++k) {
        low[k][o] = high[kWide - 1 - k][kWide - 1 - o] = static_cast<NumberOf<Vector>>(weight);
        weight = weight * (o - k) / (k + 1);
      }
    }
  }
  alignas(Vector) NumberOf<Vector> low[kWide][kWide] = {}, high[kWide][kWide] = {};
};
template <class Vector>
constexpr HalvingWeights<Vector> kHalving;

}  // namespace

template <class Vector>
void HexCoefficientsOf<Vector>::halve(int direction, HexCoefficientsOf& high) {
  high.resize(num_u_, num_w_);
  for (int row = 0; row < 3; ++row) {
    Vector *x = coordinate(row), *y = high.coordinate(row);
    if (direction == 0) {
      for (int w = 0; w < num_w_; ++w) kHalveLine<Vector>[num_u_](x + w, y + w, num_w_);
    } else if (direction == 2) {
      for (int u = 0; u < num_u_; ++u) kHalveLine<Vector>[num_w_](x + u * num_w_, y + u * num_w_, 1);
    } else {
      for (int n = 0; n < num_vectors(); ++n) {
        Vector lower{}, upper{};
        for (int k = 0; k < kWide; ++k) {
          lower += x[n][k] * load<Vector>(kHalving<Vector>.low[k]);
          upper += x[n][k] * load<Vector>(kHalving<Vector>.high[k]);
        }
        x[n] = lower, y[n] = upper;
      }
    }
  }
  precision.errors += kWide * kNarrowRoundoff * precision.sizes;
  high.precision = precision;
}
template void HexCoefficientsOf<Wide>::halve(int, HexCoefficientsOf&);
template void HexCoefficientsOf<Narrow>::halve(int, HexCoefficientsOf&);

template <class Vector>
void HexMatricesOf<Vector>::set(const Coefficients& coefficients) {
  of_ = &coefficients;
  num_u_ = of_->num_u(), num_w_ = of_->num_w();
  auto& weights = all_weights_[num_u_][num_w_];
  if (!weights) {
    auto made = std::make_unique<Weights>();
    for (int n = 0; n < of_->num_vectors(); ++n) {
      const int u = n / num_w_, w = n % num_w_;
      const int counts[4] = {u, num_u_ - 1 - u, w, num_w_ - 1 - w};
      for (int i = 0; i < 4; ++i) {
        made->of[n][i] = static_cast<Number>(counts[i]);
        std::fill_n(made->narrow[i].data() + n * kWide, kWide, static_cast<float>(counts[i]));
      }
    }
    weights = std::move(made);
  }
  weights_ = weights.get();
}

template <class Vector>
Mat3 HexMatricesOf<Vector>::operator[](std::size_t b) const {
  const std::size_t vector = b / kWide;
  const int v = static_cast<int>(b % kWide);
  const auto [low_u, high_u, low_w, high_w] = weights_->of[vector];
  Mat3 result;
  for (int row = 0; row < 3; ++row) {
    const Vector* x = of_->coordinate(row) + vector;
    const double here = x[0][v];
    result(row, 0) = low_u * (here - x[-num_w_][v]) + high_u * (x[num_w_][v] - here);
    result(row, 1) = 0;
    if (v > 0) result(row, 1) += v * (here - x[0][v - 1]);
    if (v < kWide - 1) result(row, 1) += (kWide - 1 - v) * (x[0][v + 1] - here);
    result(row, 2) = low_w * (here - x[-1][v]) + high_w * (x[1][v] - here);
  }
  return result;
}

template <class Vector>
Mat3 HexMatricesOf<Vector>::mean() const {
  Mat3 result;
  for (int row = 0; row < 3; ++row) {
    const Vector *x = of_->coordinate(row), *last = x + (num_u_ - 1) * num_w_;
    Vector low_u{}, high_u{}, low_w{}, high_w{};
    for (int w = 0; w < num_w_; ++w) low_u += x[w], high_u += last[w];
    for (int u = 0; u < num_u_; ++u) low_w += x[u * num_w_], high_w += x[u * num_w_ + num_w_ - 1];
    const Vector all = low_u + high_u + low_w + high_w;
    result(row, 0) = sum_of_lanes(widen(high_u - low_u)) / (kWide * num_w_);
    result(row, 1) = (all[kWide - 1] - all[0]) / (2 * (num_u_ + num_w_));
    result(row, 2) = sum_of_lanes(widen(high_w - low_w)) / (kWide * num_u_);
  }
  return result;
}

template <class Vector>
Mat3 HexMatricesOf<Vector>::variation() const {
  constexpr Vector kLanesBeforeLastTwo{1, 1, 1, 1, 1, 1, 0, 0};
  const int degree_u = num_u_ - 1, degree_v = kWide - 1, degree_w = num_w_ - 1;
  Vector uu{}, vv{}, ww{}, uv{}, uw{}, vw{};
  for (int row = 0; row < 3; ++row)
    for (int u = 0; u < degree_u; u += 2)
      for (int w = 0; w < degree_w; w += 2) {
        const Vector* x = of_->coordinate(row) + u * num_w_ + w;
        const Vector step_u = x[num_w_] - x[0], step_v = shifted_down(x[0]) - x[0], step_w = x[1] - x[0];
        uv += size_of(shifted_down(step_u) - step_u);
        vw += size_of(shifted_down(step_w) - step_w);
        uw += size_of(x[num_w_ + 1] - x[1] - step_u);
        vv += size_of(kLanesBeforeLastTwo * (shifted_down(step_v) - step_v));
        if (u + 2 <= degree_u) uu += size_of(x[2 * num_w_] - x[num_w_] - step_u);
        if (w + 2 <= degree_w) ww += size_of(x[2] - x[1] - step_w);
      }
  const int samples_u = num_u_ / 2, samples_w = num_w_ / 2;
  const auto mean = [](const Vector& sum, int samples) {
    return sum_of_lanes(widen(sum)) / (kWide * std::max(samples, 1));
  };
  Mat3 result;
  result(0, 0) = degree_u * (degree_u - 1) * mean(uu, degree_u / 2 * samples_w);
  result(1, 1) = degree_v * (degree_v - 1) * mean(vv, samples_u * samples_w);
  result(2, 2) = degree_w * (degree_w - 1) * mean(ww, samples_u * (degree_w / 2));
  result(0, 1) = result(1, 0) = degree_u * degree_v * mean(uv, samples_u * samples_w);
  result(0, 2) = result(2, 0) = degree_u * degree_w * mean(uw, samples_u * samples_w);
  result(1, 2) = result(2, 1) = degree_v * degree_w * mean(vw, samples_u * samples_w);
  return result;
}

template class HexMatricesOf<Wide>;
template class HexMatricesOf<Narrow>;

HexMatrices::Product HexMatrices::times(const Mat3& l) {
  product_.resize(num_u_, num_w_);
  const Wide *x = of_->coordinate(0), *y = of_->coordinate(1), *z = of_->coordinate(2);
  for (int row = 0; row < 3; ++row) {
    Wide* out = product_.coordinate(row);
    for (int n = 0; n < num_u_ * num_w_; ++n) out[n] = l(row, 0) * x[n] + l(row, 1) * y[n] + l(row, 2) * z[n];
  }
  return Product(*this);
}

Vec3 NarrowHexMatrices::entry_errors(const NarrowHexCoefficients::Precision& precision) {
  // An entry sums q differences of two numbers, with their own errors and 4 roundings each (those of L and the
  // product), one rounding for each of three operations with them, and two more for what is computed from entries.
  constexpr double kMostHexDegree = kWide - 1, kRoundings = 18 * kMostHexDegree;
  return 2 * kMostHexDegree * precision.errors + kRoundings * kNarrowRoundoff * precision.sizes;
}

NarrowHexMatrices::NarrowProduct NarrowHexMatrices::narrow_product(const Mat3& l) {
  errors_ = l.cwiseAbs() * entry_errors(of_->precision);
  if (!(l.cwiseAbs().maxCoeff() < kMostNarrow)) errors_.setConstant(std::numeric_limits<double>::max());
  if (!(errors_.maxCoeff() <= kMostError)) return NarrowProduct(*this);
  const Eigen::Matrix3f factors = l.cast<float>();
  const int count = num_u_ * num_w_ * kWide;
  const float *x = numbers(of_->coordinate(0)), *y = numbers(of_->coordinate(1)), *z = numbers(of_->coordinate(2));
  for (int row = 0; row < 3; ++row) {
    float* out = numbers(product_.coordinate(row));
    for (int n = 0; n < count; n += kWideFloats)  // values beyond the end have weight 0
      store_wide(
          factors(row, 0) * load_wide(x + n) + factors(row, 1) * load_wide(y + n) + factors(row, 2) * load_wide(z + n),
          out + n);
  }
  return NarrowProduct(*this);
}

}  // namespace subvol::internal
