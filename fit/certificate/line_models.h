// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/basis.h"
#include "subvol/fit/simd/wide.h"

#include <algorithm>
#include <array>
#include <mutex>
#include <vector>

namespace subvol::internal {

/// Polynomial models of the functions N_0 .. N_order of `line_functions` over the dyadic intervals of [0, 1].
///
///   N_i(x) = sum_o b_io B_o(t) + error,   x = (index + t) / 2^level,   B_o the Bernstein polynomials of `degree`
///
/// with bounds on the errors of N_i and N_i'. The model of N_i' is its Chebyshev expansion truncated at degree - 1; it
/// is exact if N_i is a polynomial of `degree` or less. Coefficients are accurate to 4 units of roundoff of the
/// largest.
class LineModels {
 public:
  static constexpr int kMostModelDegree = 8, kMaxLevel = 12;  // bisections of the line
  static constexpr int kStride = 16;  ///< distance from one function's coefficients to the next; unused entries are 0
  using PerFunction = std::array<double, (kMaxOrder + 1 + 7) / 8 * 8>;  ///< padded with zeros to whole vectors

  /// Bounds on |N - model| and |N' - model'|.
  struct Errors {
    PerFunction value{}, slope{};
  };
  /// Zones of a level's intervals by their distance to the ends of [0, 1], near which Legendre polynomials change
  /// fastest: zone 0 is the intervals at the ends, zone 1 those next to them, and so on; the last zone is all others.
  static constexpr int kZones = 4;
  static int zone(int level, int index) { return std::min({index, (1 << level) - 1 - index, kZones - 1}); }

  /// Values stored after the deviations of one function: c, the largest |deviation|, |c|, the largest |b|.
  enum Deviations { kMiddle, kLargestDeviation, kMiddleSize, kLargest };
  static_assert(kMostModelDegree + 1 + kLargest < kStride);

  /// The models of all intervals of one level.
  struct Level {
    std::array<Errors, kZones> errors;  ///< by zone
    PerFunction largest_coefficient{};  ///< max_o |b_io|
    bool exact = true;                  ///< true if there are no errors
    AlignedDoubles coefficients;        ///< b_io at (index (order + 1) + i) kStride + o
    // For single precision: the same coefficients, and their two parts, c_i midway between the smallest and the largest
    // b_io over o, and b_io - c_i. All have one unit of roundoff (of either precision) more error than the
    // coefficients.
    AlignedFloats narrow_coefficients;  ///< b_io, stored like `coefficients`
    /// b_io - c_i, stored like `coefficients`; then, from entry degree + 1 on, the values of `Deviations`.
    AlignedFloats deviations;
  };

  /// Returns the models of a basis, an order of 1 .. kMaxOrder and a degree of 1 .. kMostModelDegree. They are made
  /// once for all threads, each level when it is first requested. Cost of a level: about 10 us times 2^level at
  /// order 8.
  static const LineModels& get(Basis basis, int order, int degree);

  int order() const { return order_; }
  int degree() const { return degree_; }
  /// Bounds on |N_i| and |N_i'| over [0, 1].
  const PerFunction& bounds() const { return bounds_; }
  const PerFunction& slope_bounds() const { return slope_bounds_; }
  const Level& level(int l) const;
  const double* coefficients(const Level& level, int index) const {
    return level.coefficients.data() + static_cast<std::size_t>(index) * (order_ + 1) * kStride;
  }
  const float* narrow_coefficients(const Level& level, int index) const {
    return level.narrow_coefficients.data() + static_cast<std::size_t>(index) * (order_ + 1) * kStride;
  }
  const float* deviations(const Level& level, int index) const {
    return level.deviations.data() + static_cast<std::size_t>(index) * (order_ + 1) * kStride;
  }

 private:
  LineModels(Basis basis, int order, int degree);
  Level make_level(int l) const;
  double* coefficients(Level& level, int index, int i) const {
    return level.coefficients.data() + (static_cast<std::size_t>(index) * (order_ + 1) + i) * kStride;
  }
  void model_corner_functions(int l, Level& level) const;
  void model_modes(int l, Level& level) const;
  void fill_single_precision(Level& level) const;

  Basis basis_;
  int order_, degree_;
  PerFunction bounds_{}, slope_bounds_{};
  mutable std::array<Level, kMaxLevel + 1> levels_;
  mutable std::array<std::once_flag, kMaxLevel + 1> made_;
};

}  // namespace subvol::internal
