// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/certificate/control_matrices.h"

#include <array>
#include <cstddef>
#include <memory>
#include <type_traits>

namespace subvol {

/// Bernstein coefficients X_b of a map on [0, 1]^3: degree num_u - 1 along u, kWide - 1 along v and num_w - 1 along w.
///
/// Coefficient (u, v, w) is lane v of vector u num_w + w.
template <class Vector>
class HexCoefficientsOf {
 public:
  static constexpr int kMost = kWide;  ///< num_u and num_w; at least 2
  static constexpr int kMargin = kWide;

  void resize(int num_u, int num_w) { num_u_ = num_u, num_w_ = num_w; }
  int num_u() const { return num_u_; }
  int num_w() const { return num_w_; }
  int num_vectors() const { return num_u_ * num_w_; }
  /// x, y or z; kMargin vectors on either side are there to be read, and finite.
  Vector* coordinate(int row) { return x_[row].data() + kMargin; }
  const Vector* coordinate(int row) const { return x_[row].data() + kMargin; }

  /// Of what is in single precision, by rows: bounds of its errors, which come from that, and of its size when it was
  /// made. Halves are as large but for their roundings.
  struct Precision {
    Vec3 errors = Vec3::Zero(), sizes = Vec3::Zero();
  };
  Precision precision;

  /// What was of the whole is of the lower half of a direction from here on, and `high` of the other one (de
  /// Casteljau): a mean of up to kWide coefficients, by exact weights.
  void halve(int direction, HexCoefficientsOf& high);

 private:
  int num_u_ = 0, num_w_ = 0;
  alignas(WideFloats) std::array<std::array<Vector, kMost * kMost + 2 * kMargin>, 3> x_{};
};
using HexCoefficients = HexCoefficientsOf<Wide>;
/// In single precision, relative to a point nearby.
using NarrowHexCoefficients = HexCoefficientsOf<Narrow>;

/// The `ControlMatrices` J_b of such a map, made as they are asked for.
///
/// Matrix (u, v, w) is number (u num_w + w) kWide + v. Its columns are differences of coefficients, raised to the
/// map's degree q again:
///
///   J_b = o (X_b - X_below) + (q - o) (X_above - X_b),   o the place of b along the column's direction
///
/// L J_b are those of L X_b: so L costs three products per coefficient instead of nine.
template <class Lanes>
class HexMatricesOf {
 public:
  using Vector = Lanes;
  using Coefficients = HexCoefficientsOf<Vector>;

  /// Of these coefficients, which must stay, from here on.
  void set(const Coefficients& coefficients);

  std::size_t size() const { return static_cast<std::size_t>(of_->num_vectors() * kWide); }
  /// Numbers of the first matrices along v at the sides along u and w: where J is often furthest from its mean.
  std::array<std::size_t, 4> corners() const {
    const std::size_t row = static_cast<std::size_t>(num_w_ * kWide);
    return {0, row - kWide, size() - row, size() - kWide};
  }
  Mat3 operator[](std::size_t b) const;
  /// Entries of kWide matrices from number `first`, a multiple of that, on.
  void load(std::size_t first, MatrixOf<Vector>& result) const { load(*of_, first, result); }
  /// About the mean: of columns u and w their means, of column v that over the sides along u and w.
  Mat3 mean() const;
  /// (direction, column): about the mean over the box of how much the entries of that column vary along the direction,
  /// summed over rows: by second differences, of some coefficients.
  Mat3 variation() const;

 protected:
  void load(const Coefficients& of, std::size_t first, MatrixOf<Vector>& result) const;

  using Number = NumberOf<Vector>;
  static constexpr int kMostVectors = Coefficients::kMost * Coefficients::kMost;
  /// What differences count.
  struct Weights {
    /// Each vector: o and q - o along u, and along w.
    std::array<std::array<Number, 4>, kMostVectors> of;
    alignas(WideFloats) std::array<std::array<float, kMostVectors * kWide>, 4> narrow;  ///< each coefficient
  };
  const Coefficients* of_ = nullptr;
  int num_u_ = 0, num_w_ = 0;         // of of_
  const Weights* weights_ = nullptr;  // for these

 private:
  std::array<std::array<std::unique_ptr<const Weights>, Coefficients::kMost + 1>, Coefficients::kMost + 1>
      all_weights_;
};

template <class Vector>
void HexMatricesOf<Vector>::load(const Coefficients& of, std::size_t first, MatrixOf<Vector>& result) const {
  constexpr Vector kLowV{0, 1, 2, 3, 4, 5, 6, 7}, kHighV = kWide - 1 - kLowV;
  const std::size_t vector = first / kWide;
  const int num_w = of.num_w();
  const auto [low_u, high_u, low_w, high_w] = weights_->of[vector];
  for (int row = 0; row < 3; ++row) {
    const Vector* x = of.coordinate(row) + vector;
    const Vector here = *x, step = shifted_down(here) - here;
    result[row][0] = low_u * (here - x[-num_w]) + high_u * (x[num_w] - here);
    result[row][1] = kLowV * shifted_up(step) + kHighV * step;
    result[row][2] = low_w * (here - x[-1]) + high_w * (x[1] - here);
  }
}

/// In double precision.
class HexMatrices : public HexMatricesOf<Wide> {
 public:
  /// Lets the matrices L J_b be loaded.
  class Product {
   public:
    explicit Product(const HexMatrices& matrices) : matrices_(&matrices) {}
    void load(std::size_t first, WideMatrix& result) const {
      matrices_->HexMatricesOf::load(matrices_->product_, first, result);
    }

   private:
    const HexMatrices* matrices_;
  };
  /// Valid until the next call.
  Product times(const Mat3& l);

 private:
  HexCoefficients product_;
};

/// In single precision.
class NarrowHexMatrices : public HexMatricesOf<Narrow> {
 public:
  /// Lets the matrices L J_b be loaded.
  class NarrowProduct {
   public:
    using Vector = WideFloats;
    explicit NarrowProduct(const NarrowHexMatrices& matrices) : matrices_(&matrices) {}
    /// Entries of kWideFloats matrices from number `first`, a multiple of kWide, on.
    void load(std::size_t first, MatrixOf<WideFloats>& result) const;
    /// Bounds of the errors of entries, by rows. Where these are above kMostError, nothing can be loaded.
    const Vec3& errors() const { return matrices_->errors_; }

   private:
    const NarrowHexMatrices* matrices_;
  };
  /// For at least 2 vectors of coefficients; valid until the next call.
  NarrowProduct narrow_product(const Mat3& l);
  /// By rows, bounds of the errors of J's entries: that times |L| bounds those of L J's, and of what is made of them.
  static Vec3 entry_errors(const NarrowHexCoefficients::Precision& precision);

 private:
  NarrowHexCoefficients product_;
  Vec3 errors_;
};

inline void NarrowHexMatrices::NarrowProduct::load(std::size_t first, MatrixOf<WideFloats>& result) const {
  constexpr WideFloats kLowV{0, 1, 2, 3, 4, 5, 6, 7, 0, 1, 2, 3, 4, 5, 6, 7}, kHighV = kWide - 1 - kLowV;
  const int next_u = matrices_->num_w_ * kWide;
  const auto& weights = matrices_->weights_->narrow;
  const WideFloats low_u = load_wide(weights[0].data() + first), high_u = load_wide(weights[1].data() + first),
                   low_w = load_wide(weights[2].data() + first), high_w = load_wide(weights[3].data() + first);
  for (int row = 0; row < 3; ++row) {
    const float* x = numbers(matrices_->product_.coordinate(row)) + first;
    const WideFloats here = load_wide(x);
    result[row][0] = low_u * (here - load_wide(x - next_u)) + high_u * (load_wide(x + next_u) - here);
    result[row][1] = kLowV * (here - load_wide(x - 1)) + kHighV * (load_wide(x + 1) - here);
    result[row][2] = low_w * (here - load_wide(x - kWide)) + high_w * (load_wide(x + kWide) - here);
  }
}

}  // namespace subvol
