// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/certificate/hex_contraction.h"

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace subvol::internal {

/// Pool of coefficients in one precision, which keeps those no longer needed for reuse.
template <class Vector>
class CoefficientsPool {
 public:
  using Coefficients = HexCoefficientsOf<Vector>;
  struct Return {
    CoefficientsPool* pool = nullptr;
    void operator()(Coefficients* coefficients) const { pool->spare_.emplace_back(coefficients); }
  };
  using Pooled = std::unique_ptr<Coefficients, Return>;

  CoefficientsPool() = default;
  CoefficientsPool(const CoefficientsPool&) = delete;  // pooled coefficients point to their pool
  CoefficientsPool& operator=(const CoefficientsPool&) = delete;

  Pooled take();
  /// Number of coefficients in use.
  int num_taken() const { return num_made_ - static_cast<int>(spare_.size()); }

 private:
  std::vector<std::unique_ptr<Coefficients>> spare_;
  int num_made_ = 0;
};

/// Bernstein coefficients of the Jacobian dx/du of one high-order hex over its dyadic boxes, computed by bisecting them
/// in the most profitable direction.
///
/// On a box, each of N_i(u), N_j(v), N_k(w) is replaced by the `LineModels` of its direction that have the lowest
/// degree with small errors for this cell's coefficients. The map's coefficients follow by `HexContraction`; or by
/// bisecting those of the enclosing box if its models are accurate enough. `HexMatrices` computes J's coefficients from
/// them. Sub-boxes have coefficients in single precision, relative to a point of their own, so that errors are small
/// relative to the sub-box, not the cell. The whole cell has them in double precision, and so have sub-boxes for which
/// single precision is not accurate enough (`improve`), and their sub-boxes.
class HexBoxes {
 public:
  struct Box : HexPart {
    int level = 0;  ///< number of bisections, over all directions
    /// The box that the models are made for: this one, or an enclosing one.
    std::array<int, 3> modeled_levels{}, modeled_index{};
    int halved = 0;          ///< number of bisections of the coefficients since then
    double wanted = -1;      ///< largest error of a direction's models, relative to the mean edges; < 0: the default
    int split = 0;           ///< direction of the next bisection
    bool is_precise = true;  ///< true if coefficients are in double precision
    Mat3 near_l = Mat3::Zero();  ///< L of `determinant_bound`: the last one for this box, or the enclosing one
    // One of these is set once the box has been examined; few boxes keep theirs.
    CoefficientsPool<Wide>::Pooled coefficients;
    CoefficientsPool<Narrow>::Pooled narrow;
  };
  // Three bisections, one in each direction, make a depth. There are no models of deeper parts.
  static constexpr int kLevelsPerDepth = 3, kMostHexDepth = LineModels::kMaxLevel;
  static constexpr int max_depth() { return kMostHexDepth; }

  HexBoxes(Basis basis, int order);

  /// Sets the cell: its modes and their coefficients, relative to a nearby point.
  void set_cell(std::span<const LocalMode> modes, std::span<const Vec3> coefficients);

  static Box root() { return {}; }
  static int num_corners() { return 8; }
  /// lowest: least det of dx/du known so far (-infinity: unknown); model errors must be small relative to it.
  std::array<Box, 2> children(Box box, double lowest);
  /// Switches the box that was examined last to double precision if single precision cannot serve it, if its errors
  /// matter relative to `lowest`, or if it will not be bisected (`is_last`). Returns false if none of these holds.
  bool improve(Box& box, double lowest, bool is_last);
  static Vec3 corner_point(const Box& box, int corner);

  /// Chooses the box's models unless it has coefficients. Returns true if their errors are so large that no bound can
  /// be expected.
  bool is_hopeless(Box& box);
  /// Calls work(matrices) with the coefficients of J, the derivative of x with respect to the box's own coordinates:
  /// `HexMatrices` or `NarrowHexMatrices`. The box's models must have been chosen.
  template <class Work>
  void with_matrices(Box& box, const Work& work) {
    if (!has_coefficients(box)) find_coefficients(box);
    if (box.is_precise) {
      matrices_.set(*box.coefficients);
      work(matrices_);
    } else {
      narrow_matrices_.set(*box.narrow);
      work(narrow_matrices_);
    }
  }
  /// Number of the matrix at a corner of the box: J there, according to the model.
  std::size_t corner_matrix(const Box& box, int corner) const;
  /// Bounds on the errors of J's entries: from modeling, and from rounding in double precision.
  Mat3 remainder(const Box& box);
  /// Chooses the direction along which, as far as known, J varies most and model errors are largest. Frees the
  /// coefficients if many boxes hold some.
  void choose_split(Box& box);
  /// True if no sub-box can be decided either. Here it is always false: models improve with every level.
  static bool is_stuck(const Box&) { return false; }
  /// About the mean of det dx/du over the cell.
  double mean_determinant() const { return mean_edges_.prod(); }
  /// The frame for `determinant_bound`.
  static Mat3 frame(const Box&) { return Mat3::Identity(); }
  static Mat3* near_l(Box& box) { return &box.near_l; }
  /// Ratio of det dx/du to the determinant of the matrices.
  static double determinant_scale(const Box& box) { return parts(box.level); }

 private:
  /// 2^level, faster than std::ldexp.
  static double parts(int level) { return static_cast<double>(std::uint64_t{1} << level); }
  /// Effect on J of modeling the functions of one direction.
  struct LineError {
    std::size_t cell = 0;  ///< number of the cell that this belongs to
    Mat3 entries;          ///< bounds on the errors if the other directions' functions are exact
    double size = 0;       ///< their sum, relative to the mean edges
    // For the functions that the cell uses, relative to the bounds of |N| and |N'|:
    double growth = 1;     ///< bounds of |model| and |model'|
    double inflation = 1;  ///< largest coefficients
  };
  int q1(const Box& box, int direction) const { return contraction_.models(box, direction).degree() + 1; }
  /// Chooses the lowest tiers with small errors, for models of the box itself. Returns the sum of their errors.
  double choose_models(Box& box);
  static bool has_coefficients(const Box& box) { return box.coefficients || box.narrow; }
  void find_coefficients(Box& box);
  struct RowSums;
  /// Makes the weights and `is_used_`, row by row of J, from its `RowSums`.
  void make_weights();
  void sum_modes(int row, int first, const RowSums& sums);
  void make_mode_weights_along_u(int row, int first, const RowSums& sums);
  void sum_steps(int row, const RowSums& sums);
  void make_other_weights(int row, const RowSums& sums);
  const LineError& line_error(const Box& box, int direction) {
    const int level = box.modeled_levels[direction], zone = LineModels::zone(level, box.modeled_index[direction]);
    LineError& result = errors_[direction][level][box.tiers[direction]][zone];
    if (result.cell != cell_)
      find_line_error(contraction_.models(box, direction).level(level), zone, direction, result);
    return result;
  }
  void find_line_error(const LineModels::Level& line, int zone, int direction, LineError& result);
  /// Errors of one direction's models as they enter `remainder`, relative to the mean edges: they are multiplied by the
  /// growth of the directions before it. Without that factor, boxes would keep models that admit no bound.
  double error_size(const Box& box, int direction) {
    double size = line_error(box, direction).size;
    for (int d = 0; d < direction; ++d) size *= line_error(box, d).growth;
    return size;
  }
  /// Effect of single-precision errors on J, relative to the mean edges.
  double narrow_error_size(const Box& box) const;

  int n_;      // functions per direction
  int lanes_;  // n_ rounded up to a multiple of kWide
  HexContraction contraction_;
  CoefficientsPool<Wide> pool_;
  CoefficientsPool<Narrow> narrow_pool_;
  HexMatrices matrices_;
  NarrowHexMatrices narrow_matrices_;
  Vec3 mean_edges_;  // lengths of the linear part's mean columns
  Vec3 inverse_mean_edges_;
  // For i >= 2: bound, in that entry of J, of the sum over the other two indices of a_ijk times their functions. For
  // i = 1: the bound of the same sum of a_1jk - a_0jk along u, in column u.
  double& weight(int direction, int i, int row, int column) {
    return weights_[static_cast<std::size_t>((direction * n_ + i) * kWeights + 3 * column + row)];
  }
  static constexpr int kWeights = 2 * kWide;  // a matrix, column by column, padded to whole vectors
  AlignedDoubles weights_;
  std::array<AlignedDoubles, 3> is_used_;  // by direction: 1 for functions with nonzero weights
  bool fits_single_ = true;                // false if the cell's size may overflow or underflow there
  std::size_t cell_ = 0;                   // number of the current cell, from 1
  using Zones = std::array<LineError, LineModels::kZones>;
  std::array<std::array<std::array<Zones, HexContraction::kMostHexTiers>, LineModels::kMaxLevel + 1>, 3> errors_;
  LineModels::PerFunction bounds_, slope_bounds_;  // of N_i and N_i'
  // In lanes: bounds of N_i from i = 2 on, of their slopes, and the inverses of both.
  AlignedDoubles mode_bounds_, mode_slope_bounds_, inverse_bounds_, inverse_slope_bounds_;
  AlignedDoubles sums_;  // RowSums
};

}  // namespace subvol::internal
