// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/certificate/control_matrices.h"

#include <array>
#include <cstddef>
#include <limits>
#include <memory>
#include <type_traits>

namespace subvol::internal {

/// Largest relative error of rounding to single precision.
inline constexpr double kNarrowRoundoff = std::numeric_limits<float>::epsilon() / 2;

/// Bernstein coefficients X_b of a map on [0, 1]^3: degree num_u - 1 along u, kWide - 1 along v and num_w - 1 along w.
///
/// Coefficient (u, v, w) is lane v of vector u num_w + w.
template <class Vector>
class HexCoefficientsOf {
 public:
  static constexpr int kMostCoefficientsPerDirection = kWide;  ///< largest num_u and num_w; the smallest is 2
  static constexpr int kMarginVectors = kWide;

  void resize(int num_u, int num_w) { num_u_ = num_u, num_w_ = num_w; }
  int num_u() const { return num_u_; }
  int num_w() const { return num_w_; }
  int num_vectors() const { return num_u_ * num_w_; }
  /// Coefficients of x, y or z. The kMarginVectors on either side can be read and are finite.
  Vector* coordinate(int row) { return x_[row].data() + kMarginVectors; }
  const Vector* coordinate(int row) const { return x_[row].data() + kMarginVectors; }

  /// For single precision, by rows: bounds on the coefficients' errors due to it, and on their size when they were
  /// computed. Bisected coefficients are no larger, apart from rounding.
  struct Precision {
    Vec3 errors = Vec3::Zero(), sizes = Vec3::Zero();
  };
  Precision precision;

  /// Bisects along a direction (de Casteljau): this object becomes the lower half, `high` the upper one. Each
  /// coefficient becomes a mean of up to kWide coefficients, with exact weights.
  void halve(int direction, HexCoefficientsOf& high);

 private:
  int num_u_ = 0, num_w_ = 0;
  alignas(WideFloats) std::array<
      std::array<Vector, kMostCoefficientsPerDirection * kMostCoefficientsPerDirection + 2 * kMarginVectors>, 3> x_{};
};
using HexCoefficients = HexCoefficientsOf<Wide>;
/// Coefficients in single precision, relative to a nearby point.
using NarrowHexCoefficients = HexCoefficientsOf<Narrow>;

/// The `ControlMatrices` J_b of such a map, computed on demand.
///
/// Matrix (u, v, w) is number (u num_w + w) kWide + v. Its columns are differences of coefficients, with the degree
/// raised to the map's degree q again:
///
///   J_b = o (X_b - X_below) + (q - o) (X_above - X_b),   o the index of b along the column's direction
///
/// The L J_b are the matrices of L X_b, so L costs three products per coordinate instead of nine.
template <class Lanes>
class HexMatricesOf {
 public:
  using Vector = Lanes;
  using Coefficients = HexCoefficientsOf<Vector>;

  /// Sets the coefficients, which must stay valid and in place.
  void set(const Coefficients& coefficients);

  std::size_t size() const { return static_cast<std::size_t>(of_->num_vectors() * kWide); }
  /// Numbers of the first matrices along v at the four corners in u and w, where J is often furthest from its mean.
  std::array<std::size_t, 4> corners() const {
    const std::size_t row = static_cast<std::size_t>(num_w_ * kWide);
    return {0, row - kWide, size() - row, size() - kWide};
  }
  Mat3 operator[](std::size_t b) const;
  /// Loads the entries of kWide matrices from number `first`, a multiple of kWide, on.
  void load(std::size_t first, MatrixOf<Vector>& result) const { load(*of_, first, result); }
  /// Approximate mean: over the box for columns u and w, over the sides along u and w for column v.
  Mat3 mean() const;
  /// (direction, column): approximate mean over the box of how much the entries of that column vary along the
  /// direction, summed over rows; computed from second differences of some coefficients.
  Mat3 variation() const;

 protected:
  void load(const Coefficients& of, std::size_t first, MatrixOf<Vector>& result) const;

  using Number = NumberOf<Vector>;
  static constexpr int kMostVectors =
      Coefficients::kMostCoefficientsPerDirection * Coefficients::kMostCoefficientsPerDirection;
  /// Weights of the differences.
  struct Weights {
    /// For each vector: o and q - o along u, and along w.
    std::array<std::array<Number, 4>, kMostVectors> of;
    alignas(WideFloats) std::array<std::array<float, kMostVectors * kWide>, 4> narrow;  ///< for each coefficient
  };
  const Coefficients* of_ = nullptr;
  int num_u_ = 0, num_w_ = 0;         // those of of_
  const Weights* weights_ = nullptr;  // for these sizes

 private:
  std::array<std::array<std::unique_ptr<const Weights>, Coefficients::kMostCoefficientsPerDirection + 1>,
             Coefficients::kMostCoefficientsPerDirection + 1>
      all_weights_;
};

template <class Vector>
void HexMatricesOf<Vector>::load(const Coefficients& of, std::size_t first, MatrixOf<Vector>& result) const {
  constexpr Vector kLowWeightsV{0, 1, 2, 3, 4, 5, 6, 7}, kHighWeightsV = kWide - 1 - kLowWeightsV;
  const std::size_t vector = first / kWide;
  const int num_w = of.num_w();
  const auto [low_u, high_u, low_w, high_w] = weights_->of[vector];
  for (int row = 0; row < 3; ++row) {
    const Vector* x = of.coordinate(row) + vector;
    const Vector here = *x, step = shifted_down(here) - here;
    result[row][0] = low_u * (here - x[-num_w]) + high_u * (x[num_w] - here);
    result[row][1] = kLowWeightsV * shifted_up(step) + kHighWeightsV * step;
    result[row][2] = low_w * (here - x[-1]) + high_w * (x[1] - here);
  }
}

/// The matrices in double precision.
class HexMatrices : public HexMatricesOf<Wide> {
 public:
  /// Loads the matrices L J_b.
  class Product {
   public:
    explicit Product(const HexMatrices& matrices) : matrices_(&matrices) {}
    void load(std::size_t first, WideMatrix& result) const {
      matrices_->HexMatricesOf::load(matrices_->product_, first, result);
    }

   private:
    const HexMatrices* matrices_;
  };
  /// The result is valid until the next call.
  Product times(const Mat3& l);

 private:
  HexCoefficients product_;
};

/// The matrices in single precision.
class NarrowHexMatrices : public HexMatricesOf<Narrow> {
 public:
  /// Loads the matrices L J_b.
  class NarrowProduct {
   public:
    using Vector = WideFloats;
    explicit NarrowProduct(const NarrowHexMatrices& matrices) : matrices_(&matrices) {}
    /// Loads the entries of kWideFloats matrices from number `first`, a multiple of kWide, on.
    void load(std::size_t first, MatrixOf<WideFloats>& result) const;
    /// Bounds on the errors of the entries, by rows. If one exceeds kMostError, nothing may be loaded.
    const Vec3& errors() const { return matrices_->errors_; }

   private:
    const NarrowHexMatrices* matrices_;
  };
  /// Requires at least 2 vectors of coefficients. The result is valid until the next call.
  NarrowProduct narrow_product(const Mat3& l);
  /// Returns, by rows, bounds on the errors of J's entries. Multiplied by |L|, they bound the errors of L J_b and of
  /// what is computed from it.
  static Vec3 entry_errors(const NarrowHexCoefficients::Precision& precision);

 private:
  NarrowHexCoefficients product_;
  Vec3 errors_;
};

inline void NarrowHexMatrices::NarrowProduct::load(std::size_t first, MatrixOf<WideFloats>& result) const {
  constexpr WideFloats kLowFloatWeightsV{0, 1, 2, 3, 4, 5, 6, 7, 0, 1, 2, 3, 4, 5, 6, 7},
      kHighFloatWeightsV = kWide - 1 - kLowFloatWeightsV;
  const int next_u = matrices_->num_w_ * kWide;
  const auto& weights = matrices_->weights_->narrow;
  const WideFloats low_u = load_wide(weights[0].data() + first), high_u = load_wide(weights[1].data() + first),
                   low_w = load_wide(weights[2].data() + first), high_w = load_wide(weights[3].data() + first);
  for (int row = 0; row < 3; ++row) {
    const float* x = numbers(matrices_->product_.coordinate(row)) + first;
    const WideFloats here = load_wide(x);
    result[row][0] = low_u * (here - load_wide(x - next_u)) + high_u * (load_wide(x + next_u) - here);
    result[row][1] = kLowFloatWeightsV * (here - load_wide(x - 1)) + kHighFloatWeightsV * (load_wide(x + 1) - here);
    result[row][2] = low_w * (here - load_wide(x - kWide)) + high_w * (load_wide(x + kWide) - here);
  }
}

}  // namespace subvol::internal
