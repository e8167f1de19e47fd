// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/certificate/control_matrices.h"

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

namespace subvol::internal {

/// The `ControlMatrices` J_b of a map from a triangle times [0, 1], given by Bernstein coefficients: of any degree over
/// the triangle (numbered by `SimplexIndex`), of degree kWide - 1 along w.
///
/// Coefficient (alpha, w) is lane w of vector number alpha; matrix (alpha, w) is number alpha kWide + w. Columns are
/// differences of coefficients, with the degree raised to that of the map again; with e_c the unit exponents,
///
///   J_b = sum_c alpha_c (X_{alpha - e_c + e_i} - X_{alpha - e_c + e_0}),  i = 1, 2;   w as in `HexMatrices`
class PrismMatrices {
 public:
  using Vector = Wide;
  PrismMatrices();
  ~PrismMatrices();
  PrismMatrices(PrismMatrices&&) noexcept;

  /// Makes room for coefficients, to be written next. degree: over the triangle, 1 .. SimplexTables::kMostTableDegree.
  void resize(int degree);
  Wide* coordinate(int row) { return x_[row].data(); }

  std::size_t size() const { return static_cast<std::size_t>(count_) * kWide; }
  Mat3 operator[](std::size_t b) const;
  /// Numbers of the first matrices along the upright edges.
  std::array<std::size_t, 3> corners() const;
  /// Loads the entries of kWide matrices from number `first`, a multiple of kWide, on.
  void load(std::size_t first, WideMatrix& result) const { load(x_, first, result); }
  /// Mean over the box for columns u and v, over the upright sides for column w.
  Mat3 mean() const;

  /// Loads the matrices L J_b.
  class Product {
   public:
    explicit Product(const PrismMatrices& matrices) : matrices_(&matrices) {}
    void load(std::size_t first, WideMatrix& result) const { matrices_->load(matrices_->product_, first, result); }

   private:
    const PrismMatrices* matrices_;
  };
  /// The result is valid until the next call.
  Product times(const Mat3& l);

  /// Loads the L J_b in single precision, computed from L (X_b - X_m), where X_m is the middle coefficient.
  class NarrowProduct {
   public:
    using Vector = Narrow;
    explicit NarrowProduct(const PrismMatrices& matrices) : matrices_(&matrices) {}
    void load(std::size_t first, MatrixOf<Narrow>& result) const {
      matrices_->load(matrices_->narrow_product_, first, result);
    }
    /// Bounds on the errors of the entries, by rows. If one exceeds kMostError, nothing may be loaded.
    const Vec3& errors() const { return matrices_->narrow_errors_; }

   private:
    const PrismMatrices* matrices_;
  };
  /// The result is valid until the next call.
  NarrowProduct narrow_product(const Mat3& l);

 private:
  /// Tables for the coefficients over a triangle of one degree.
  struct Triangle;

  template <class Lanes>
  void load(const std::array<std::vector<Lanes>, 3>& x, std::size_t first, MatrixOf<Lanes>& result) const;
  void make_narrow();

  int degree_ = 0, count_ = 0;
  std::vector<std::unique_ptr<const Triangle>> triangles_;  // by degree
  const Triangle* triangle_ = nullptr;
  std::array<std::vector<Wide>, 3> x_, product_;
  bool is_narrowed_ = false;
  std::array<std::vector<Narrow>, 3> narrow_, narrow_product_;
  Vec3 narrow_sizes_, narrow_errors_;
};

}  // namespace subvol::internal
