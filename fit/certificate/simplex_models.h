// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/certificate/chebyshev.h"
#include "subvol/fit/certificate/simplex_tables.h"
#include "subvol/fit/elements/shape_functions.h"
#include "subvol/fit/simd/wide.h"

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

namespace subvol::internal {

/// Polynomial models of tet functions, and of the triangle's part of prism functions, over parts of the simplex.
///
///   E_edge,i V_vertex,j V_3,k = sum_alpha b_alpha B_alpha + error          B_alpha: Bernstein polynomials of the part
///
/// A function is a product of barycentric coordinates and of `mode_kernels`. The kernels' Chebyshev expansions, over
/// the intervals that their arguments take on the part, are multiplied, and the product is truncated at the total
/// degree that the coordinates leave. There are models of several degrees, the *tiers*: low ones cost little and
/// suffice if coefficients are small.
/// Legendre: models are exact from degree i + j + k + 1 on over the whole simplex, and no other part has models.
/// Fourier: errors fall with a power of the part's size; bounds on those of the value and of the gradient (each
/// component, in canonical coordinates) come with the models. A model that would be no better than 0 is 0.
///
/// Parts result from bisection and are numbered: the whole is 1, and the halves of n are 2n and 2n + 1. There are
/// models after every `halvings_between` bisections, up to `most_halvings`.
///
/// Models are made when they are first requested, up to the requested order i + j + k, and kept for all threads. If
/// those of one kind, basis and order take more than 200 MB, all but the whole simplex's are dropped; the latter take
/// at most 16 MB per tier. Cost of all of them at the highest tier, for Fourier tets of orders 2, 4, 8, 12: about 0.05,
/// 1, 50, 400 ms; less for prisms. Fourier tets above order 12 with coefficients of all orders are impractical: the
/// models of one part take seconds, and those of many parts exceed the memory limit. Straight-sided ones are
/// unaffected.
class SimplexModels {
 public:
  static constexpr int kMostSimplexTiers = kWide;

  /// Data of the functions over a part that need no models; all by slot.
  struct Part {
    struct Function {
      double value_bound, gradient_bound;                                ///< of the function itself
      bool is_left_out(int tier) const { return left_out >> tier & 1; }  ///< true if its model is 0
      std::uint8_t left_out;
    };
    std::vector<Function> functions;
    /// Errors of the models. That of a value is at 2 kMostSimplexTiers slot + tier, and that of its gradient follows
    /// kMostSimplexTiers entries later.
    std::vector<double> errors;
    double error(std::size_t slot, int tier) const { return errors[2 * kMostSimplexTiers * slot + tier]; }
    double gradient_error(std::size_t slot, int tier) const {
      return errors[2 * kMostSimplexTiers * slot + kMostSimplexTiers + tier];
    }
  };
  /// Models of the functions of one order i + j + k, in one tier, over one part.
  struct Batch {
    struct Size {
      double largest_coefficient, rounding;  ///< bounds on |b_alpha| and on the errors of the b_alpha
    };
    std::size_t first = 0;    ///< slot of the first function
    std::vector<Size> sizes;  ///< by slot - first
    /// b_alpha in the order of the tier's index, kWide at a time: the first ones of all functions, then the next ones.
    AlignedDoubles coefficients;
    /// Address of b_alpha. The others up to a multiple of kWide follow it; b_{alpha + kWide} is `step` further on.
    std::size_t address(std::size_t slot, std::size_t alpha) const {
      return alpha / kWide * step() + kWide * (slot - first) + alpha % kWide;
    }
    std::size_t step() const { return kWide * sizes.size(); }
  };
  using Models = std::array<std::shared_ptr<const Batch>, kMaxOrder>;  ///< by order i + j + k

  /// kind: prism (its triangle) or tet. Shared by all threads and made when first requested.
  static const SimplexModels& get(CellKind kind, Basis basis, int order);

  /// Tiers ascend from the lowest degree on; there are at most kMostSimplexTiers.
  int num_tiers() const { return static_cast<int>(tiers_.size()); }
  const SimplexTables& tables(int tier) const { return *tiers_[tier]; }
  bool is_exact() const { return basis_ == Basis::legendre; }
  int dimension() const { return tiers_[0]->index.dimension(); }

  /// Slot of a function. For prisms, mode.k is ignored. Slots ascend with the function's order.
  std::size_t slot(const LocalMode& mode) const { return slots_[slot_address(mode)]; }
  /// The order i + j + k, for prisms i + j: 0 .. order - 1.
  int own_order(const LocalMode& mode) const { return mode.i + mode.j + (kind_ == CellKind::tet ? mode.k : 0); }

  int halvings_between() const { return dimension(); }
  int most_halvings() const { return most_halvings_; }

  /// Returns the data of a part.
  /// number  of the part, at a multiple of `halvings_between` bisections.
  /// vertices  of the part, in canonical coordinates; always the same for one number.
  std::shared_ptr<const Part> part(std::uint32_t number, std::span<const Vec3> vertices) const;
  /// Adds the missing models of orders up to `order`. Those already in `models` must belong to this part and tier.
  void add_models(std::uint32_t number, std::span<const Vec3> vertices, const Part& part, int tier, int order,
                  Models& models) const;

 private:
  class Expansions;
  class Kernels;
  struct Stored {
    std::shared_ptr<const Part> part;
    std::array<Models, kMostSimplexTiers> models;
  };

  SimplexModels(CellKind kind, Basis basis, int order);
  std::size_t slot_address(const LocalMode& mode) const;
  std::vector<int> bubble(const LocalMode& mode) const;
  Part make_part(std::uint32_t number, std::span<const Vec3> vertices) const;
  Batch make_batch(int own_order, int tier, const Part& part, Kernels& kernels,
                   const std::array<std::array<double, 4>, 4>& barycentric) const;
  void count(std::size_t bytes) const;

  CellKind kind_;
  Basis basis_;
  int order_;
  std::vector<const SimplexTables*> tiers_;
  int most_halvings_;
  ChebyshevExpansion expansion_;
  std::vector<LocalMode> modes_;                          // by slot
  std::array<std::size_t, kMaxOrder + 1> first_slots_{};  // of each order
  std::vector<int> slots_;                                // by slot_address
  mutable std::mutex mutex_, making_;                     // guards what is stored; serializes making it
  mutable std::map<std::uint32_t, Stored> stored_;        // by number
  mutable std::size_t stored_bytes_ = 0;
};

}  // namespace subvol::internal
