// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/simd/wide.h"
#include "subvol/base/types.h"

#include <array>
#include <cstddef>
#include <type_traits>
#include <vector>

namespace subvol {

/// Entries [row][column] of as many matrices as a vector has lanes.
template <class Vector>
using MatrixOf = std::array<std::array<Vector, 3>, 3>;
using WideMatrix = MatrixOf<Wide>;

/// Bounds of the errors of L J_b in single precision beyond this one say that it does not serve. At least half a
/// millionth of an entry is counted as its error: so entries are far from overflow, as are products of three of them.
inline constexpr double kMostError = 1e4;
/// Coefficients and entries of L from this size on are not kept in single precision.
inline constexpr double kMostNarrow = 1e20;
/// From this ratio of the mean's longest and shortest column on, no bound is looked for in single precision.
inline constexpr double kMostScale = 1e3;

template <class Vector>
using NumberOf = std::remove_cvref_t<decltype(Vector{}[0])>;

/// l times each of them.
template <class Vector>
void multiply(const Eigen::Matrix<NumberOf<Vector>, 3, 3>& l, MatrixOf<Vector>& matrices) {
  for (int c = 0; c < 3; ++c) {
    const Vector x = matrices[0][c], y = matrices[1][c], z = matrices[2][c];
    for (int r = 0; r < 3; ++r) matrices[r][c] = l(r, 0) * x + l(r, 1) * y + l(r, 2) * z;
  }
}

/// Coefficients J_b of a 3x3 matrix function on a box: J(u) = sum_b B_b(u) J_b + error, B_b >= 0, sum_b B_b = 1.
///
/// Entry (row, column) of all of them is one array of doubles; at least kWide matrices.
class ControlMatrices {
 public:
  using Vector = Wide;  ///< of entries as they are loaded

  /// Room for `count` matrices; what they are is undefined. An entry may be written kWide - 1 numbers beyond its end.
  void resize(std::size_t count) {
    count_ = count;
    stride_ = (count + 2 * kWide - 2) / kWide * kWide;
    if (entries_.size() < 9 * stride_ / kWide + 1) entries_.resize(9 * stride_ / kWide + 1);
  }
  std::size_t size() const { return count_; }
  double* entries(int row, int column) { return data() + (3 * row + column) * stride_; }
  const double* entries(int row, int column) const { return data() + (3 * row + column) * stride_; }
  /// Entries of kWide matrices from number `first` on.
  void load(std::size_t first, WideMatrix& result) const {
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) result[r][c] = load_wide(entries(r, c) + first);
  }
  /// Numbers of some to look at first: none.
  static std::array<std::size_t, 0> corners() { return {}; }
  /// Lets the matrices L J_b be loaded.
  class Product {
   public:
    Product(const ControlMatrices& matrices, const Mat3& l) : matrices_(&matrices), l_(l) {}
    void load(std::size_t first, WideMatrix& result) const {
      matrices_->load(first, result);
      multiply(l_, result);
    }

   private:
    const ControlMatrices* matrices_;
    Mat3 l_;
  };
  Product times(const Mat3& l) const { return {*this, l}; }
  Mat3 operator[](std::size_t b) const {
    Mat3 result;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) result(r, c) = entries(r, c)[b];
    return result;
  }
  /// About the mean: of some that are spread over all, and the last ones.
  Mat3 mean() const;

 private:
  double* data() { return reinterpret_cast<double*>(entries_.data()); }
  const double* data() const { return reinterpret_cast<const double*>(entries_.data()); }

  std::size_t count_ = 0, stride_ = 0;
  std::vector<Wide> entries_;  // for its alignment
};

struct BoundOptions {
  /// Of matrices that have both precisions: a bound may be found in single precision, which takes half as long, and be
  /// lower by 1e-5 of it or more.
  bool single_first = false;
  /// Matrices at corners are looked at before all others at once: for boxes of which no bound is likely.
  bool corners_first = false;
};

/// A lower bound of det J over the box, > 0; or 0 if none is found.
///
///   S_b = sym(L J_b D) - diag(row sums of sym(|L| R D))
///   all S_b positive definite   =>   det J(u) >= min_b det S_b / (det L det D) > 0 for all u
///
/// since sym(L J D) - sum_b B_b S_b is positive semidefinite, det M >= det sym M where sym M > 0 (Ostrowski, Taussky)
/// and det^(1/3) is concave (Minkowski). D scales the columns of the mean matrix M to length 1. Any L is sound; in the
/// limit of small boxes every L with sym(L M D) > 0 serves, and how large boxes can be decided depends on it:
///
///   L = D C^-T Q^T,   C = frame diag(c),   Q the rotation of M C's polar decomposition
///
/// that is, S_b > 0 means sym(Q^T J_b C) > 0. Tried one after the other are the c that make M C's columns 1; those with
/// c_j / c_i = v_ji / v_ij in the mean over pairs, where v_ij is how much component i (by Q) of column j of J frame
/// varies, for the terms of each entry off the diagonal are of one size then. Then that L is turned, up to three times,
/// towards a b whose S_b is not positive definite; and tried last are the first ones without the frame. Before all of
/// them comes what served the box around, or failed there last: half of the parts are decided by that.
///
/// remainder  R >= 0: bounds of the error of J's entries, and of the rounding errors in J_b's (each at least
///            16 units of roundoff of the entry; with HexMatrices and PrismMatrices also three units of the
///            coefficients' size, times 2 q for their differences, as L is taken to the coefficients). Entries at most
///            1e60 in size. Rounding here is accounted for.
/// frame      regular: takes J to coordinates in which a cell without distortion has orthogonal columns.
/// options    Ways to it: ControlMatrices have no corners, and only PrismMatrices have both precisions.
/// near_l     unless null: an L to begin with, by coordinates of the same directions, or 0 for none; then the last one
///            that was tried.
/// Matrices   ControlMatrices, HexMatrices, NarrowHexMatrices or PrismMatrices (not const: they keep what is worked
///            with). Of NarrowHexMatrices, R says nothing of single precision, whose errors they know.
template <class Matrices>
double determinant_bound(Matrices& matrices, const Mat3& remainder, const Mat3& frame,
                         const BoundOptions& options = {}, Mat3* near_l = nullptr);

}  // namespace subvol
