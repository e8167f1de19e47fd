// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/wide.h"
#include "subvol/types.h"

#include <cstddef>
#include <vector>

namespace subvol {

/// Coefficients J_b of a 3x3 matrix function on a box: J(u) = sum_b B_b(u) J_b + error, B_b >= 0, sum_b B_b = 1.
///
/// Entry (row, column) of all of them is one array of doubles; at least kWide matrices.
class ControlMatrices {
 public:
  /// Room for `count` matrices; what they are is undefined. An entry may be written kWide - 1 numbers beyond its end.
  void resize(std::size_t count) {
    count_ = count;
    stride_ = (count + 2 * kWide - 2) / kWide * kWide;
    if (entries_.size() < 9 * stride_ / kWide + 1) entries_.resize(9 * stride_ / kWide + 1);
  }
  std::size_t size() const { return count_; }
  double* entries(int row, int column) { return data() + (3 * row + column) * stride_; }
  const double* entries(int row, int column) const { return data() + (3 * row + column) * stride_; }
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
/// towards a b whose S_b is not positive definite; and tried last are the first ones without the frame.
///
/// remainder  R >= 0: bounds of the error of J's entries, and of the rounding errors in J_b's (each at least
///            16 units of roundoff of the entry). Entries at most 1e60 in size. Rounding here is accounted for.
/// frame      regular: takes J to coordinates in which a cell without distortion has orthogonal columns.
double determinant_bound(const ControlMatrices& matrices, const Mat3& remainder, const Mat3& frame = Mat3::Identity());

}  // namespace subvol
