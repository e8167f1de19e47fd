// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/certificate/hex_matrices.h"
#include "fit/certificate/line_models.h"
#include "fit/elements/shape_functions.h"

#include <array>
#include <span>
#include <vector>

namespace subvol {

/// A dyadic part of [0, 1]^3, and which models of N_i(u), N_j(v), N_k(w) stand for them there.
struct HexPart {
  std::array<int, 3> levels{}, index{};  ///< per direction: side 2^-level, and place
  std::array<int, 3> tiers{};            ///< of the models, by ascending degree
};

/// Bernstein coefficients of the map of one high-order hex on its parts: with N_k = sum_q b_kq B_q there,
///
///   X_opq = sum_i b_io sum_j b_jp sum_k b_kq a_ijk
///
/// Parts of one place along w, or along w and v, share the first contractions. Along u and w models are of the least
/// degree asked for; along v always of degree kWide - 1, so that a row of coefficients is one vector.
///
/// In single precision, with b_kq = c_k + d_kq, c_k in the middle between the least b_kq and the largest:
///
///   W_q   = sum_k d_kq a_k                  M  = sum_k c_k a_k
///   V_pq  = sum_j (d_jp M_j + b_jp W_jq)    M' = sum_j c_j M_j
///   X_opq = sum_i (d_io M'_i + b_io V_ipq) + sum_i c_i M'_i
///
/// without the last sum, which is a point that the coefficients are relative to. Every term of the others has a
/// deviation d: so all that is rounded is small beside the part. What bounds it are the same sums over sizes, with
/// max_q |d_kq|, max_q |b_kq| and |c_k|.
class HexContraction {
 public:
  static constexpr int kMostTiers = 2;
  static constexpr int kRow = kWideFloats;  ///< rows are rounded up to so many numbers

  HexContraction(Basis basis, int order);

  int num_tiers(int direction) const { return static_cast<int>(tiers_[direction].size()); }
  const LineModels& models(int direction, int tier) const { return *tiers_[direction][tier]; }
  const LineModels& models(const HexPart& part, int direction) const {
    return models(direction, part.tiers[direction]);
  }

  /// Takes a cell by its modes and their coefficients, relative to a point nearby. Modes must stay where, and what,
  /// they are until others come.
  void set_cell(std::span<const LocalMode> modes, std::span<const Vec3> coefficients);
  /// By 1, x, N_2, ... in all directions, instead of N_0, N_1, N_2, ...: for 1 nothing must be multiplied. Comes before
  /// all contractions.
  void take_steps();
  /// x, y or z of a_ijk, at k row() + j (order + 1) + i.
  const double* modes(int coordinate) const { return modes_.data() + coordinate * face_; }
  int row() const { return row_; }
  /// After `take_steps`: sum of |a_ijk| times the bounds of 1, x, N_2, ...
  const Vec3& total() const { return total_; }

  /// In double precision; levels of the part up to LineModels::kMaxLevel.
  void contract(const HexPart& part, HexCoefficients& result);
  /// In single precision, with `result.precision`; for a cell whose `total` is within 1e-10 to 1e10.
  void contract(const HexPart& part, NarrowHexCoefficients& result);

 private:
  template <class Vector>
  using Vectors = std::vector<Vector, AlignedAllocator<Vector>>;

  /// What buffers hold: how many directions are contracted, from w on, and for which part.
  struct Contracted {
    int directions = 0;
    HexPart part;
    /// Forgets what is not of that part.
    void keep(const HexPart& wanted);
  };

  void set_modes(std::span<const LocalMode> modes);
  void contract_w(const HexPart& part);
  void contract_v(const HexPart& part);
  void narrow_modes();
  void contract_narrow_w(const HexPart& part);
  void contract_narrow_v(const HexPart& part);

  int n_, face_;                                         // functions per direction, and their square
  int lanes_, row_;                                      // n_ to a multiple of kWide, 3 face_ to one of kRow
  std::array<std::vector<const LineModels*>, 3> tiers_;  // per direction, by ascending degree; along v there is one
  LineModels::PerFunction bounds_;                       // of N_i
  AlignedDoubles lane_bounds_;

  // x, y and z are one after the other, so far as nothing else is said.
  AlignedDoubles modes_;                 // a_ijk at k row_ + j n + i
  const LocalMode* of_modes_ = nullptr;  // and for which modes,
  std::size_t num_modes_ = 0;
  std::vector<int> places_;              // where each of them is
  std::vector<int> used_;                // of every kRow numbers of a row: first k from where on all are 0
  std::vector<int> all_used_;            // the same where all are used
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
  AlignedFloats middles_v_;                  // M' at i
  // With d_k for max_q |d_kq|, b_j for max_p |b_jp|: s = sum_k d_k |a_k| at j n + i, then S = sum_k |c_k| |a_k|;
  // sum_j (d_j S_j + b_j s_j) at i; sum_j |c_j| S_j.
  AlignedFloats sizes_w_, sizes_v_, middle_sizes_v_;
};

}  // namespace subvol
