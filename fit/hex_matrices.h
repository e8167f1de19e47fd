// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/control_matrices.h"

#include <array>
#include <cstddef>
#include <memory>

namespace subvol {

/// Bernstein coefficients X_b of a map on [0, 1]^3: degree num_u - 1 along u, kWide - 1 along v and num_w - 1 along w.
///
/// Coefficient (u, v, w) is lane v of vector u num_w + w.
class HexCoefficients {
 public:
  static constexpr int kMost = kWide;  ///< num_u and num_w; at least 2
  static constexpr int kMargin = kWide;

  void resize(int num_u, int num_w) { num_u_ = num_u, num_w_ = num_w; }
  int num_u() const { return num_u_; }
  int num_w() const { return num_w_; }
  int num_vectors() const { return num_u_ * num_w_; }
  /// x, y or z; kMargin vectors on either side are there to be read, and finite.
  Wide* coordinate(int row) { return x_[row].data() + kMargin; }
  const Wide* coordinate(int row) const { return x_[row].data() + kMargin; }

  /// What was of the whole is of the lower half of a direction from here on, and `high` of the other one (de
  /// Casteljau): a mean of up to kWide coefficients, by exact weights.
  void halve(int direction, HexCoefficients& high);

 private:
  int num_u_ = 0, num_w_ = 0;
  std::array<std::array<Wide, kMost * kMost + 2 * kMargin>, 3> x_{};
};

/// The `ControlMatrices` J_b of such a map, made as they are asked for.
///
/// Matrix (u, v, w) is number (u num_w + w) kWide + v. Its columns are differences of coefficients, raised to the
/// map's degree q again:
///
///   J_b = o (X_b - X_below) + (q - o) (X_above - X_b),   o the place of b along the column's direction
///
/// L J_b are those of L X_b: so L costs three products per coefficient instead of nine.
class HexMatrices {
 public:
  /// Of these coefficients, which must stay, from here on.
  void set(const HexCoefficients& coefficients);

  std::size_t size() const { return static_cast<std::size_t>(of_->num_vectors() * kWide); }
  /// Numbers of the first matrices along v at the sides along u and w: where J is often furthest from its mean.
  std::array<std::size_t, 4> corners() const {
    const std::size_t row = static_cast<std::size_t>(num_w_ * kWide);
    return {0, row - kWide, size() - row, size() - kWide};
  }
  Mat3 operator[](std::size_t b) const;
  /// Entries of kWide matrices from number `first`, a multiple of that, on.
  void load(std::size_t first, WideMatrix& result) const { load(*of_, first, result); }
  /// About the mean: of columns u and w their means, of column v that over the sides along u and w.
  Mat3 mean() const;
  /// (direction, column): about the mean over the box of how much the entries of that column vary along the direction,
  /// summed over rows: by second differences, of some coefficients.
  Mat3 variation() const;

  /// Lets the matrices L J_b be loaded.
  class Product {
   public:
    explicit Product(const HexMatrices& matrices) : matrices_(&matrices) {}
    void load(std::size_t first, WideMatrix& result) const { matrices_->load(matrices_->product_, first, result); }

   private:
    const HexMatrices* matrices_;
  };
  /// Valid until the next call.
  Product times(const Mat3& l);

  /// The same in single precision: of L (X_b - the one in the middle).
  class NarrowProduct {
   public:
    using Vector = WideFloats;
    explicit NarrowProduct(const HexMatrices& matrices) : matrices_(&matrices) {}
    /// Entries of kWideFloats matrices from number `first`, a multiple of kWide, on.
    void load(std::size_t first, MatrixOf<WideFloats>& result) const;
    /// Bounds of the errors of entries, by rows. Where these are above kMostError, nothing can be loaded.
    const Vec3& errors() const { return matrices_->narrow_errors_; }

   private:
    const HexMatrices* matrices_;
  };
  /// For at least 2 vectors of coefficients; valid until the next call.
  NarrowProduct narrow_product(const Mat3& l);

 private:
  void make_narrow();
  /// Lanes one place up (down); the first (last) one stays.
  static Wide shifted_up(const Wide& x) { return __builtin_shufflevector(x, x, 0, 0, 1, 2, 3, 4, 5, 6); }
  static Wide shifted_down(const Wide& x) { return __builtin_shufflevector(x, x, 1, 2, 3, 4, 5, 6, 7, 7); }

  void load(const HexCoefficients& of, std::size_t first, WideMatrix& result) const {
    constexpr Wide kLowV{0, 1, 2, 3, 4, 5, 6, 7}, kHighV = kWide - 1 - kLowV;
    const std::size_t vector = first / kWide;
    const int num_w = of.num_w();
    const auto [low_u, high_u, low_w, high_w] = weights_->of[vector];
    for (int row = 0; row < 3; ++row) {
      const Wide* x = of.coordinate(row) + vector;
      const Wide here = *x, step = shifted_down(here) - here;
      result[row][0] = low_u * (here - x[-num_w]) + high_u * (x[num_w] - here);
      result[row][1] = kLowV * shifted_up(step) + kHighV * step;
      result[row][2] = low_w * (here - x[-1]) + high_w * (x[1] - here);
    }
  }

  static constexpr int kMostVectors = HexCoefficients::kMost * HexCoefficients::kMost,
                       kNarrowMargin = HexCoefficients::kMargin * kWide;
  /// What differences count.
  struct Weights {
    /// Each vector: o and q - o along u, and along w.
    std::array<std::array<double, 4>, kMostVectors> of;
    alignas(WideFloats) std::array<std::array<float, kMostVectors * kWide>, 4> narrow;  ///< each coefficient
  };
  const HexCoefficients* of_ = nullptr;
  int num_u_ = 0, num_w_ = 0;         // of of_
  const Weights* weights_ = nullptr;  // for these
  std::array<std::array<std::unique_ptr<const Weights>, HexCoefficients::kMost + 1>, HexCoefficients::kMost + 1>
      all_weights_;
  HexCoefficients product_;
  bool is_narrowed_ = false;
  // Coefficients less that in the middle, and the largest ones of these.
  alignas(WideFloats) std::array<std::array<float, kMostVectors * kWide>, 3> narrow_{};
  Vec3 narrow_sizes_;
  alignas(WideFloats) std::array<std::array<float, kMostVectors * kWide + 2 * kNarrowMargin>, 3> narrow_product_{};
  Vec3 narrow_errors_;
};

inline void HexMatrices::NarrowProduct::load(std::size_t first, MatrixOf<WideFloats>& result) const {
  constexpr WideFloats kLowV{0, 1, 2, 3, 4, 5, 6, 7, 0, 1, 2, 3, 4, 5, 6, 7}, kHighV = kWide - 1 - kLowV;
  const int next_u = matrices_->num_w_ * kWide;
  const auto& weights = matrices_->weights_->narrow;
  const WideFloats low_u = load_wide(weights[0].data() + first), high_u = load_wide(weights[1].data() + first),
                   low_w = load_wide(weights[2].data() + first), high_w = load_wide(weights[3].data() + first);
  for (int row = 0; row < 3; ++row) {
    const float* x = matrices_->narrow_product_[row].data() + kNarrowMargin + first;
    const WideFloats here = load_wide(x);
    result[row][0] = low_u * (here - load_wide(x - next_u)) + high_u * (load_wide(x + next_u) - here);
    result[row][1] = kLowV * (here - load_wide(x - 1)) + kHighV * (load_wide(x + 1) - here);
    result[row][2] = low_w * (here - load_wide(x - kWide)) + high_w * (load_wide(x + kWide) - here);
  }
}

}  // namespace subvol
