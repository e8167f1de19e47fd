// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/certificate/certificate.h"
#include "fit/elements/element_space.h"

#include <memory>
#include <span>

namespace subvol {

/// Proves or disproves, cell by cell, that a high-order map is nowhere inverted.
///
/// Boxes of a cell are looked at through polynomial models of the map in Bernstein form, with bounds of what the models
/// leave out; `determinant_bound` decides them, or they are halved. Models of hexes are products of `LineModels`: exact
/// for legendre up to order 7, close for all others, and better with every halving. So are `SimplexModels`, of tets and
/// of the triangles of prisms. Rounding is bounded a priori, about 1e-13 of the product of the lengths of a hex of
/// order 4, 1e-11 of a tet of order 8: cells that are closer to inversion end undecided, never wrong. A witness is a
/// point where det J, computed from the shape functions themselves, is negative beyond its own rounding.
/// Paper: left open there for the Fourier basis (section 5).
///
/// Holds buffers: one object per thread.
class HighOrderCertifier {
 public:
  /// `space` must outlive it, and stay as it is. InputError: options out of range. max_depth above 12 (hexes) or 20
  /// counts as that.
  explicit HighOrderCertifier(const ElementSpace& space, const CertificateOptions& options = {});
  ~HighOrderCertifier();
  HighOrderCertifier(HighOrderCertifier&&) noexcept;

  /// coefficients  one per node of the space (asserted), any values: cells with one that is not finite, or so large or
  ///               small (beyond 1e+-50) that products overflow, end undecided.
  /// returns       as for linear cells: lower_bound > 0 exactly when valid, else -infinity; never a wrong `valid` or
  ///               `invalid`. Found by the whole cell it is close to the least det J, as double precision goes; by
  ///               parts, lower by a few per cent. Cost of a well-shaped hex at orders 1, 2, 4, 8: about 0.8, 1.7, 2.6,
  ///               20 us, of a tet 0.6, 0.9, 3, 40 us (fourier) or 0.6, 0.7, 1.5, 9 us; models first (`SimplexModels`).
  CellCertificate certify(std::span<const Vec3> coefficients, std::size_t cell);

 private:
  struct Buffers;
  const ElementSpace* space_;
  CertificateOptions options_;
  std::unique_ptr<Buffers> buffers_;
};

/// Certifies all cells. Parallel; the answer does not depend on the number of threads. InputError: options out of
/// range, or other than one coefficient per node.
CertificateSummary certify(const ElementSpace& space, std::span<const Vec3> coefficients,
                           const CertificateOptions& options = {});

}  // namespace subvol
