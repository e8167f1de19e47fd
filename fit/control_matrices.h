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
  /// Room for `count` matrices; what they are is undefined. An entry may be written kWide - 1 numbers beyond its end as
  /// long as the next one is written later.
  void resize(std::size_t count) {
    count_ = count;
    stride_ = (count + kWide - 1) / kWide * kWide;
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
  Mat3 mean() const;

 private:
  double* data() { return reinterpret_cast<double*>(entries_.data()); }
  const double* data() const { return reinterpret_cast<const double*>(entries_.data()); }

  std::size_t count_ = 0, stride_ = 0;
  std::vector<Wide> entries_;  // for its alignment
};

/// A lower bound of det J over the box, > 0; or 0 if none is found.
///
///   S_b = sym(L J_b C) - diag(row sums of sym(|L| R C))
///   all S_b positive definite   =>   det J(u) >= min_b det S_b / (det L det C) > 0 for all u
///
/// since sym(L J C) - sum_b B_b S_b is positive semidefinite, det M >= det sym M where sym M > 0 (Ostrowski, Taussky)
/// and det^(1/3) is concave (Minkowski). C scales the columns of the mean matrix to length 1, L undoes its rotation;
/// any choice is sound. In the limit of small boxes nothing is lost but the square of the deviation from the mean.
///
/// remainder  R >= 0: bounds of the error of J's entries, and of the rounding errors in J_b's (each at least
///            16 units of roundoff of the entry). Entries at most 1e60 in size. Rounding here is accounted for.
double determinant_bound(const ControlMatrices& matrices, const Mat3& remainder);

}  // namespace subvol
