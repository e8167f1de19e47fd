// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/certificate/hex_matrices.h"
#include "subvol/fit/certificate/line_models.h"
#include "subvol/fit/elements/shape_functions.h"

#include <array>
#include <span>
#include <vector>

namespace subvol::internal {

/// A dyadic box of [0, 1]^3, and the models that replace N_i(u), N_j(v), N_k(w) on it.
struct HexPart {
  std::array<int, 3> levels{}, index{};  ///< per direction: side length 2^-level, and position
  std::array<int, 3> tiers{};            ///< per direction: number of the models, by ascending degree
};

/// Computes the Bernstein coefficients of the map of one high-order hex on its boxes: with N_k = sum_q b_kq B_q there,
///
///   X_opq = sum_i b_io sum_j b_jp sum_k b_kq a_ijk
///
/// Boxes at one place along w, or along w and v, share the first contractions. Along u and w, models have the lowest
/// degree requested; along v always degree kWide - 1, so that a row of coefficients is one vector.
///
/// In single precision, with b_kq = c_k + d_kq and c_k midway between the smallest and the largest b_kq:
///
///   W_q   = sum_k d_kq a_k                  M  = sum_k c_k a_k
///   V_pq  = sum_j (d_jp M_j + b_jp W_jq)    M' = sum_j c_j M_j
///   X_opq = sum_i (d_io M'_i + b_io V_ipq) + sum_i c_i M'_i
///
/// without the last sum, which is the point that the coefficients are relative to. Every term of the other sums
/// contains a deviation d, so everything that is rounded is small relative to the box. The rounding errors are bounded
/// by the same sums of absolute values, with max_q |d_kq|, max_q |b_kq| and |c_k|.
class HexContraction {
 public:
  static constexpr int kMostHexTiers = 2;   // models of two degrees (`model_degrees`)
  static constexpr int kRow = kWideFloats;  ///< rows are padded to a multiple of this

  HexContraction(Basis basis, int order);

  int num_tiers(int direction) const { return static_cast<int>(tiers_[direction].size()); }
  const LineModels& models(int direction, int tier) const { return *tiers_[direction][tier]; }
  const LineModels& models(const HexPart& part, int direction) const {
    return models(direction, part.tiers[direction]);
  }

  /// Sets the cell: its modes and their coefficients, relative to a nearby point. The array of modes must stay in place
  /// and unchanged until other modes are set.
  void set_cell(std::span<const LocalMode> modes, std::span<const Vec3> coefficients);
  /// Changes to the functions 1, x, N_2, ... in all directions, instead of N_0, N_1, N_2, ...: the function 1 needs no
  /// multiplication. Must be called before any contraction.
  void take_steps();
  /// Coordinate x, y or z of the a_ijk, each at k row() + j (order + 1) + i.
  const double* modes(int coordinate) const { return modes_.data() + coordinate * face_; }
  int row() const { return row_; }
  /// After `take_steps`: the sum of |a_ijk| times the bounds of 1, x, N_2, ...
  const Vec3& total() const { return total_; }

  /// Contracts in double precision; levels of the box are at most LineModels::kMaxLevel.
  void contract(const HexPart& part, HexCoefficients& result);
  /// Contracts in single precision and sets `result.precision`; for a cell whose `total` is within 1e-10 to 1e10.
  void contract(const HexPart& part, NarrowHexCoefficients& result);

 private:
  template <class Vector>
  using Vectors = std::vector<Vector, AlignedAllocator<Vector>>;

  /// State of the buffers: how many directions are contracted, from w on, and for which box.
  struct Contracted {
    int directions = 0;
    HexPart part;
    /// Discards what does not belong to the box `wanted`.
    void keep(const HexPart& wanted);
  };

  void set_modes(std::span<const LocalMode> modes);
  void contract_w(const HexPart& part);
  void contract_v(const HexPart& part);
  void narrow_modes();
  void contract_narrow_w(const HexPart& part);
  void contract_narrow_v(const HexPart& part);

  int n_, face_;                                         // functions per direction, and their square
  int lanes_, row_;                                      // n_ padded to a multiple of kWide, 3 face_ to one of kRow
  std::array<std::vector<const LineModels*>, 3> tiers_;  // per direction, by ascending degree; along v there is one
  LineModels::PerFunction bounds_;                       // of N_i
  AlignedDoubles lane_bounds_;

  // x, y and z are stored one after the other unless stated otherwise.
  AlignedDoubles modes_;                 // a_ijk at k row_ + j n + i
  const LocalMode* of_modes_ = nullptr;  // the modes that places_ and used_ are made for
  std::size_t num_modes_ = 0;
  std::vector<int> places_;    // position of each mode
  std::vector<int> used_;      // for each kRow numbers of a row: the first k from which on all are 0
  std::vector<int> all_used_;  // the same if all are used
  Vec3 total_;

  Contracted contracted_;
  AlignedDoubles after_w_;                // at q row_ + j n + i
  std::array<Vectors<Wide>, 3> after_v_;  // at i q1_w + q, lane p
  Vectors<Wide> no_more_;

  bool has_steps_ = false, has_narrow_modes_ = false;
  AlignedFloats narrow_modes_;  // a_ijk
  Contracted narrow_contracted_;
  AlignedFloats narrow_w_;                   // W at q row_ + j n + i, then M
  std::array<Vectors<Narrow>, 3> narrow_v_;  // V at i q1_w + q, lane p
  Vectors<Narrow> more_;                     // sum_j d_jp M_j at i, lane p
  Vectors<Narrow> no_narrow_more_;
  AlignedFloats middles_v_;  // M' at i
  // With d_k for max_q |d_kq|, b_j for max_p |b_jp|: s = sum_k d_k |a_k| at j n + i, then S = sum_k |c_k| |a_k|;
  // sum_j (d_j S_j + b_j s_j) at i; sum_j |c_j| S_j.
  AlignedFloats sizes_w_, sizes_v_, middle_sizes_v_;
};

}  // namespace subvol::internal
