// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/hex_matrices.h"
#include "fit/line_models.h"
#include "fit/shape_functions.h"

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace subvol {

/// Coefficients that are no longer needed, for others.
using SpareCoefficients = std::vector<std::unique_ptr<HexCoefficients>>;
struct ReturnToSpare {
  SpareCoefficients* spare = nullptr;
  void operator()(HexCoefficients* coefficients) const { spare->emplace_back(coefficients); }
};
using PooledCoefficients = std::unique_ptr<HexCoefficients, ReturnToSpare>;

/// Bernstein coefficients of the Jacobian dx/du of one high-order hex over its dyadic boxes, got by halving them in the
/// direction that pays most.
///
/// On a box each of N_i(u), N_j(v), N_k(w) is replaced by `LineModels` of its direction: along u and w of the least
/// degree with small errors by this cell's coefficients, along v always of degree kWide - 1, so that a row of
/// coefficients is one `Wide`. The map's coefficients follow by three contractions, of which boxes of one place along
/// w, or v and w, share the first ones; or by halving those of the box around it, where its models are good enough.
/// `HexMatrices` makes J's of them.
class HexBoxes {
 public:
  struct Box {
    int level = 0;                         ///< halvings, of all directions
    std::array<int, 3> levels{}, index{};  ///< per direction: side 2^-level, and place
    std::array<int, 3> tiers{};            ///< of the models, by ascending degree
    /// What the models are of: this box, or one around it.
    std::array<int, 3> modelled_levels{}, modelled_index{};
    int halved = 0;     ///< how often the coefficients have been since
    double wanted = -1; ///< errors of a direction's models, share of the mean edges; < 0: small ones
    int split = 0;      ///< direction to be halved
    PooledCoefficients coefficients;  ///< once looked at; few boxes keep them
  };
  static constexpr int kLevelsPerDepth = 3, kMaxDepth = LineModels::kMaxLevel;

  HexBoxes(Basis basis, int order);
  HexBoxes(const HexBoxes&) = delete;  // boxes know where their coefficients go
  HexBoxes& operator=(const HexBoxes&) = delete;

  /// Takes a cell by its modes and their coefficients, relative to a point nearby.
  void set_cell(std::span<const LocalMode> modes, std::span<const Vec3> coefficients);

  static Box root() { return {}; }
  static int num_corners() { return 8; }
  /// lowest: det of dx/du where it is least, as far as known: errors of models must be small beside it.
  std::array<Box, 2> children(Box box, double lowest);
  /// Models are chosen before a box is looked at.
  static bool improve(Box&, double) { return false; }
  static Vec3 corner_point(const Box& box, int corner);

  /// Chooses the box's models, unless it has coefficients. Whether their errors are so large that no bound can be hoped
  /// for.
  bool is_hopeless(Box& box);
  /// The coefficients of J's, dx by the box's own coordinates, on a box whose models have been chosen; valid until the
  /// next call, and as long as the box has its coefficients.
  HexMatrices& matrices(Box& box);
  /// Number of the matrix at a corner of the box: J there, by the model.
  std::size_t corner_matrix(const Box& box, int corner) const;
  /// Bounds of the errors of J's entries: modelling and rounding.
  Mat3 remainder(const Box& box);
  /// The direction along which J varies most, as far as looked at, and errors of models are largest. Takes the
  /// coefficients, where many boxes have some.
  void choose_split(Box& box);
  /// Whether no part of the box can be decided either: models get better with every level.
  static bool is_stuck(const Box&) { return false; }
  /// About the mean of det of dx/du over the cell.
  double mean_determinant() const { return mean_edges_.prod(); }
  /// Of `determinant_bound`.
  static Mat3 frame(const Box&) { return Mat3::Identity(); }
  /// det of dx/du over that of `matrices`.
  static double determinant_scale(const Box& box) { return parts(box.level); }

 private:
  /// 2^level; std::ldexp takes longer.
  static double parts(int level) { return static_cast<double>(std::uint64_t{1} << level); }
  /// What modelling the functions of one direction does to J.
  struct LineError {
    std::size_t cell = 0;  ///< number of the cell that this is of
    Mat3 entries;          ///< bounds of the errors, where the other directions' functions are exact
    double size = 0;       ///< of these, share of the mean edges
    // Of the functions that the cell uses, over the bounds of |N| and |N'|:
    double growth = 1;     ///< bounds of |model| and |model'|
    double inflation = 1;  ///< largest coefficients
  };
  const LineModels& models(const Box& box, int direction) const { return *tiers_[direction][box.tiers[direction]]; }
  int q1(const Box& box, int direction) const { return models(box, direction).degree() + 1; }
  PooledCoefficients new_coefficients();
  /// Whether the buffers hold the same functions of a direction.
  bool shares(const Box& box, int direction) const;
  void set_modes(std::span<const LocalMode> modes);
  void make_weights();
  void take_steps();
  const LineError& line_error(const Box& box, int direction);
  double error_size(const Box& box, int direction) {
    return line_error(box, direction).size;
  }
  void contract_w(const Box& box);
  void contract_v(const Box& box);
  void contract_u(const Box& box, HexCoefficients& result);

  static constexpr int kMostTiers = 2;

  int n_;                                        // functions per direction
  int lanes_, row_;                              // n_ and its square, to a multiple of kWide
  std::array<std::vector<const LineModels*>, 3> tiers_;  // per direction, by ascending degree; along v there is one
  std::array<int, 3> contracted_levels_{}, contracted_index_{}, contracted_tiers_{};  // what the buffers hold
  int contracted_ = 0;                           // and how many of its directions, from w on: 2 at the most
  SpareCoefficients spare_;
  int num_coefficients_ = 0;                     // that were made
  std::array<AlignedDoubles, 3> modes_;          // x, y, z of a_ijk, then by 1, x, N_2, ..., at k row_ + j n + i
  const LocalMode* of_modes_ = nullptr;          // and for which modes,
  std::size_t num_modes_ = 0;
  std::vector<int> places_;                      // where each of them is
  std::vector<int> used_;                        // of every kWide numbers j n + i: first k from where on all are 0
  std::vector<int> all_used_;                    // n_ for every kWide numbers of a row
  std::array<AlignedDoubles, 3> after_w_;        // at o_w row_ + j n + i
  std::array<std::vector<Wide>, 3> after_v_;     // at i q1_w + o_w, lane o_v
  HexMatrices matrices_;
  Vec3 mean_edges_;                              // lengths of the linear part's mean columns
  Vec3 inverse_mean_edges_;
  // i >= 2: bound of the sum over the other two numbers of a_ijk times their functions in that entry of J.
  double& weight(int direction, int i, int row, int column) {
    return weights_[static_cast<std::size_t>((direction * n_ + i) * kWeights + 3 * column + row)];
  }
  static constexpr int kWeights = 2 * kWide;  // a matrix, by columns, in whole vectors
  AlignedDoubles weights_;
  std::array<AlignedDoubles, 3> is_used_;        // by direction: 1 where they are not 0
  Vec3 total_;                                   // sum of |a_ijk| times the bounds of 1, x, N_2, ...
  std::size_t cell_ = 0;                         // number of the current one, from 1
  using Zones = std::array<LineError, LineModels::kZones>;
  std::array<std::array<std::array<Zones, kMostTiers>, LineModels::kMaxLevel + 1>, 3> errors_;
  LineModels::PerFunction bounds_, slope_bounds_;  // of N_i and N_i'
  // In lanes: bounds of all N_i; from 2 on, of these, of their slopes, ...
  AlignedDoubles lane_bounds_, mode_bounds_, mode_slope_bounds_, inverse_bounds_, inverse_slope_bounds_;
  AlignedDoubles sums_;                            // scratch of make_weights
};

}  // namespace subvol
