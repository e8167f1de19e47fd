// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/certificate/certificate.h"
#include "subvol/fit/elements/element_space.h"

#include <memory>
#include <span>

namespace subvol::internal {

/// Proves or refutes, cell by cell, that a high-order map is nowhere inverted.
///
/// Boxes of a cell are examined through polynomial models of the map in Bernstein form, with bounds on the models'
/// errors. `determinant_bound` decides a box, or the box is bisected. Models of hexes are products of `LineModels`:
/// exact for Legendre up to order 7, accurate for all others, and more so with every bisection. `SimplexModels` are
/// likewise, for tets and for the triangles of prisms. Rounding is bounded a priori, by about 1e-13 of the product of
/// the lengths of a hex of order 4 and 1e-11 for a tet of order 8: cells closer to inversion end undecided, never
/// wrong. A witness is a point where det J, computed from the shape functions themselves, is negative beyond its own
/// rounding error. The paper leaves this open for the Fourier basis (section 5).
///
/// Holds buffers: use one object per thread.
class HighOrderCertifier {
 public:
  /// `space` must outlive this object, and stay unchanged. InputError: options out of range; pyramids. A max_depth
  /// above 12 (hexes) or 20 (tets, prisms) is reduced to that.
  explicit HighOrderCertifier(const ElementSpace& space, const CertificateOptions& options = {});
  ~HighOrderCertifier();
  HighOrderCertifier(HighOrderCertifier&&) noexcept;

  /// coefficients  one per node of the space (asserted), with any values: cells with a non-finite one, or so large or
  ///               small (beyond 1e+-50) that products might overflow or underflow, end undecided.
  /// returns       as for linear cells, but lower_bound is -infinity unless valid; `valid` and `invalid` are never
  ///               wrong. A bound found on the whole cell is close to the least det J, within double precision; one
  ///               found on sub-boxes is lower by a few percent. Cost for a well-shaped hex at orders 1, 2, 4, 8: about
  ///               0.8, 1.7, 2.6, 20 us; for a tet 0.6, 0.9, 3, 40 us (Fourier) or 0.6, 0.7, 1.5, 9 us; plus making the
  ///               models once (`SimplexModels`).
  CellCertificate certify(std::span<const Vec3> coefficients, std::size_t cell);

 private:
  struct Buffers;
  const ElementSpace* space_;
  CertificateOptions options_;
  std::unique_ptr<Buffers> buffers_;
};

/// Certifies all cells. Parallel; the result does not depend on the number of threads. InputError: options out of
/// range; the number of coefficients is not that of the nodes.
CertificateSummary certify(const ElementSpace& space, std::span<const Vec3> coefficients,
                           const CertificateOptions& options = {});

}  // namespace subvol::internal
