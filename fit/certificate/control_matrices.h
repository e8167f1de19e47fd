// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/fit/simd/wide.h"

#include <array>
#include <cstddef>
#include <type_traits>
#include <vector>

namespace subvol::internal {

/// Entries [row][column] of as many matrices as a vector has lanes.
template <class Vector>
using MatrixOf = std::array<std::array<Vector, 3>, 3>;
using WideMatrix = MatrixOf<Wide>;

/// Single precision is not used if the bounds on the errors of L J_b in it exceed this. An entry's error is counted as
/// at least 0.5e-6 of the entry: so entries, and products of three of them, are far from overflow.
inline constexpr double kMostError = 1e4;
/// Coefficients and entries of L of this size or more are not stored in single precision.
inline constexpr double kMostNarrow = 1e20;
/// Single precision is not used if the longest column of the mean is at least this many times the shortest.
inline constexpr double kMostScale = 1e3;

/// Models may have errors of at most this share of the lowest det J, or of a good one if that is lower, with det J
/// relative to the cell's mean determinant.
inline constexpr double kModelErrorShare = 0.1;
/// Least error of models that is asked for, relative to the mean edges.
inline constexpr double kLeastModelError = 1e-9;

template <class Vector>
using NumberOf = std::remove_cvref_t<decltype(Vector{}[0])>;

/// Multiplies each matrix by l from the left.
template <class Vector>
void multiply(const Eigen::Matrix<NumberOf<Vector>, 3, 3>& l, MatrixOf<Vector>& matrices) {
  for (int c = 0; c < 3; ++c) {
    const Vector x = matrices[0][c], y = matrices[1][c], z = matrices[2][c];
    for (int r = 0; r < 3; ++r) matrices[r][c] = l(r, 0) * x + l(r, 1) * y + l(r, 2) * z;
  }
}

/// Coefficients J_b of a 3x3 matrix function on a box: J(u) = sum_b B_b(u) J_b + error, B_b >= 0, sum_b B_b = 1.
///
/// Entry (row, column) of all matrices is stored as one array of doubles. There must be at least kWide matrices.
class ControlMatrices {
 public:
  using Vector = Wide;  ///< vector of entries, as loaded

  /// Makes room for `count` matrices with undefined entries. Each array has room for kWide - 1 numbers beyond its end.
  void resize(std::size_t count) {
    count_ = count;
    stride_ = (count + 2 * kWide - 2) / kWide * kWide;
    if (entries_.size() < 9 * stride_ / kWide + 1) entries_.resize(9 * stride_ / kWide + 1);
  }
  std::size_t size() const { return count_; }
  double* entries(int row, int column) { return data() + (3 * row + column) * stride_; }
  const double* entries(int row, int column) const { return data() + (3 * row + column) * stride_; }
  /// Loads the entries of kWide matrices from number `first` on.
  void load(std::size_t first, WideMatrix& result) const {
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) result[r][c] = load_wide(entries(r, c) + first);
  }
  /// Numbers of the matrices to examine first: none.
  static std::array<std::size_t, 0> corners() { return {}; }
  /// Loads the matrices L J_b.
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
  /// Approximate mean: of matrices spread over all of them, and of the last ones.
  Mat3 mean() const;

 private:
  double* data() { return reinterpret_cast<double*>(entries_.data()); }
  const double* data() const { return reinterpret_cast<const double*>(entries_.data()); }

  std::size_t count_ = 0, stride_ = 0;
  std::vector<Wide> entries_;  // vectors, for their alignment
};

struct BoundOptions {
  /// For matrices that have both precisions: a bound may be found in single precision, which takes half as long; it may
  /// be lower by 1e-5 of its value or more.
  bool single_first = false;
  /// Examines the matrices at the corners before all others: for boxes that are unlikely to have a bound.
  bool corners_first = false;
};

/// Returns a lower bound > 0 of det J over the box, or 0 if none is found.
///
///   S_b = sym(L J_b D) - diag(row sums of sym(|L| R D))
///   all S_b positive definite   =>   det J(u) >= min_b det S_b / (det L det D) > 0 for all u
///
/// since sym(L J D) - sum_b B_b S_b is positive semidefinite, det M >= det sym M if sym M > 0 (Ostrowski, Taussky),
/// and det^(1/3) is concave (Minkowski). D scales the columns of the mean matrix M to length 1. The bound holds for any
/// L; in the limit of small boxes every L with sym(L M D) > 0 succeeds. How large a box can be decided depends on L:
///
///   L = D C^-T Q^T,   C = frame diag(c),   Q the rotation of M C's polar decomposition
///
/// that is, S_b > 0 means sym(Q^T J_b C) > 0. These L are tried in turn:
///   - `near_l`, the L that succeeded or failed last on the enclosing box: it decides half of the sub-boxes;
///   - the L whose c gives the columns of M C length 1;
///   - the L with c_j / c_i = v_ji / v_ij in the mean over pairs, where v_ij is how much component i (by Q) of column j
///     of J frame varies: both terms of each off-diagonal entry then have the same size;
///   - that L, turned up to three times toward a b whose S_b is not positive definite;
///   - the second of these L without the frame.
///
/// remainder  R >= 0: bounds on the error of J's entries plus the rounding errors in the J_b (for each entry, at least
///            16 units of roundoff of the entry; for HexMatrices and PrismMatrices also three units of the size of the
///            coefficients, times 2 q for their differences, since L is applied to the coefficients). Entries are at
///            most 1e60 in size. Rounding errors in this function are accounted for.
/// frame      regular: maps J to coordinates in which an undistorted cell has orthogonal columns.
/// options    see `BoundOptions`; ControlMatrices have no corners, and only PrismMatrices have both precisions.
/// near_l     optional, in/out, in coordinates along the same directions: the first L to try (zero: none); on return,
///            the last L that was tried.
/// Matrices   ControlMatrices, HexMatrices, NarrowHexMatrices or PrismMatrices (not const: they hold scratch memory).
///            For NarrowHexMatrices, R excludes single-precision errors, which they bound themselves.
template <class Matrices>
double determinant_bound(Matrices& matrices, const Mat3& remainder, const Mat3& frame, const BoundOptions& options = {},
                         Mat3* near_l = nullptr);

}  // namespace subvol::internal
