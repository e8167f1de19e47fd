// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/chebyshev.h"
#include "fit/shape_functions.h"
#include "fit/simplex_polynomials.h"

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

namespace subvol {

/// Polynomial models of what prism functions are on their triangle, and of tet functions, over parts of the simplex.
///
///   E_edge,i V_vertex,j V_3,k = sum_alpha b_alpha B_alpha + error          B_alpha: Bernstein polynomials of the part
///
/// A function is a product of barycentric coordinates and of `mode_kernels`. The product of the kernels' Chebyshev
/// expansions, over the intervals that their arguments take on the part, is cut behind the total degree that is left.
/// Legendre: exact over the whole simplex, and no other part has models. Fourier: of a fixed degree, so that errors
/// fall with a power of the part's size; bounds of those of value and gradient (by canonical coordinates, each
/// component) come with them.
///
/// Parts come about by halving: they are numbered from 1, the whole, and the halves of n are 2n and 2n + 1. There are
/// models after every `halvings_between` halvings, `most_halvings` at most.
class SimplexModels {
 public:
  struct Function {
    double value_bound, gradient_bound;  ///< of the function itself
    double error, gradient_error;
    double largest_coefficient, rounding;  ///< bounds of |b_alpha| and of the b_alpha's own errors
  };
  struct Part {
    std::vector<Function> functions;   ///< by `slot`
    std::vector<double> coefficients;  ///< b_alpha at slot stride() + alpha, in the order of `index`; unused ones are 0
  };

  /// kind: prism (its triangle) or tet. Shared by all threads, made when first asked for.
  static const SimplexModels& get(CellKind kind, Basis basis, int order);

  const SimplexIndex& index() const { return index_; }
  /// A multiple of kWide, at least index().size().
  std::size_t stride() const { return stride_; }
  /// The functions' place in a part. mode.k of a prism is not looked at.
  std::size_t slot(const LocalMode& mode) const { return slots_[slot_address(mode)]; }

  int halvings_between() const { return index_.dimension(); }
  int most_halvings() const { return most_halvings_; }
  /// Models over part `number`, at a multiple of `halvings_between` halvings. Kept once made, while there is room, for
  /// all threads. Cost of fourier tets at orders 2, 4, 8: about 0.05, 1, 50 ms; of prisms less.
  /// vertices: of the part, canonical; always the same for one number.
  std::shared_ptr<const Part> part(std::uint32_t number, std::span<const Vec3> vertices) const;

 private:
  class Kernels;

  SimplexModels(CellKind kind, Basis basis, int order);
  std::size_t slot_address(const LocalMode& mode) const;
  Part make_part(std::uint32_t number, std::span<const Vec3> vertices) const;

  CellKind kind_;
  Basis basis_;
  int order_;
  SimplexIndex index_;
  std::size_t stride_;
  int most_halvings_;
  ChebyshevExpansion expansion_;
  std::vector<LocalMode> modes_;  // by slot
  std::vector<int> slots_;        // by slot_address
  mutable std::mutex mutex_;
  mutable std::map<std::uint32_t, std::shared_ptr<const Part>> stored_;  // by number
};

}  // namespace subvol
