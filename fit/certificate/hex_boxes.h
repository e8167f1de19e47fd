// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/certificate/hex_contraction.h"

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace subvol {

/// Coefficients of one precision; those that are no longer needed are kept for others.
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
  CoefficientsPool(const CoefficientsPool&) = delete;  // what is pooled knows where to go
  CoefficientsPool& operator=(const CoefficientsPool&) = delete;

  Pooled take();
  /// How many are in use.
  int num_taken() const { return num_made_ - static_cast<int>(spare_.size()); }

 private:
  std::vector<std::unique_ptr<Coefficients>> spare_;
  int num_made_ = 0;
};

/// Bernstein coefficients of the Jacobian dx/du of one high-order hex over its dyadic boxes, got by halving them in the
/// direction that pays most.
///
/// On a box each of N_i(u), N_j(v), N_k(w) is replaced by `LineModels` of its direction, of the least degree with small
/// errors by this cell's coefficients. The map's coefficients follow by `HexContraction`; or by halving those of the
/// box around it, where its models are good enough. `HexMatrices` makes J's of them. Parts of the cell have them in
/// single precision, relative to a point of their own: so errors are small beside the part, not the cell. The whole
/// cell has them in double precision, and so have parts where single precision is not good enough (`improve`), and
/// their parts.
class HexBoxes {
 public:
  struct Box : HexPart {
    int level = 0;  ///< halvings, of all directions
    /// What the models are of: this box, or one around it.
    std::array<int, 3> modelled_levels{}, modelled_index{};
    int halved = 0;     ///< how often the coefficients have been since
    double wanted = -1; ///< errors of a direction's models, share of the mean edges; < 0: small ones
    int split = 0;      ///< direction to be halved
    bool is_precise = true;  ///< coefficients are in double precision
    Mat3 near_l = Mat3::Zero();  ///< of `determinant_bound`: the last one for this box, or the one around it
    // Once looked at, one of them; few boxes keep them.
    CoefficientsPool<Wide>::Pooled coefficients;
    CoefficientsPool<Narrow>::Pooled narrow;
  };
  static constexpr int kLevelsPerDepth = 3, kMaxDepth = LineModels::kMaxLevel;

  HexBoxes(Basis basis, int order);

  /// Takes a cell by its modes and their coefficients, relative to a point nearby.
  void set_cell(std::span<const LocalMode> modes, std::span<const Vec3> coefficients);

  static Box root() { return {}; }
  static int num_corners() { return 8; }
  /// lowest: det of dx/du where it is least, as far as known: errors of models must be small beside it.
  std::array<Box, 2> children(Box box, double lowest);
  /// Goes over to double precision, where single precision does not serve the box that was looked at last, its errors
  /// matter beside `lowest`, or no parts will be looked at. False: none of these.
  bool improve(Box& box, double lowest, bool is_last);
  static Vec3 corner_point(const Box& box, int corner);

  /// Chooses the box's models, unless it has coefficients. Whether their errors are so large that no bound can be hoped
  /// for.
  bool is_hopeless(Box& box);
  /// Calls work(matrices) with the coefficients of J's, dx by the box's own coordinates, on a box whose models have
  /// been chosen: `HexMatrices` or `NarrowHexMatrices`.
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
  /// Number of the matrix at a corner of the box: J there, by the model.
  std::size_t corner_matrix(const Box& box, int corner) const;
  /// Bounds of the errors of J's entries: modelling, and rounding in double precision.
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
  static Mat3* near_l(Box& box) { return &box.near_l; }
  /// det of dx/du over that of the matrices.
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
  int q1(const Box& box, int direction) const { return contraction_.models(box, direction).degree() + 1; }
  /// The least tiers whose errors are small, of models of the box itself. The sum of their errors.
  double choose_models(Box& box);
  static bool has_coefficients(const Box& box) { return box.coefficients || box.narrow; }
  void find_coefficients(Box& box);
  void make_weights();
  const LineError& line_error(const Box& box, int direction) {
    const int level = box.modelled_levels[direction], zone = LineModels::zone(level, box.modelled_index[direction]);
    LineError& result = errors_[direction][level][box.tiers[direction]][zone];
    if (result.cell != cell_)
      find_line_error(contraction_.models(box, direction).level(level), zone, direction, result);
    return result;
  }
  void find_line_error(const LineModels::Level& line, int zone, int direction, LineError& result);
  /// Share of the mean edges that the errors of one direction's models have in `remainder`: they are multiplied with the
  /// growth of the directions before it. Without that factor boxes would keep models that no bound can be had with.
  double error_size(const Box& box, int direction) {
    double size = line_error(box, direction).size;
    for (int d = 0; d < direction; ++d) size *= line_error(box, d).growth;
    return size;
  }
  /// What errors of single precision do to J, share of the mean edges.
  double narrow_error_size(const Box& box) const;

  int n_;                                        // functions per direction
  int lanes_;                                    // to a multiple of kWide
  HexContraction contraction_;
  CoefficientsPool<Wide> pool_;
  CoefficientsPool<Narrow> narrow_pool_;
  HexMatrices matrices_;
  NarrowHexMatrices narrow_matrices_;
  Vec3 mean_edges_;                              // lengths of the linear part's mean columns
  Vec3 inverse_mean_edges_;
  // Bound of the sum over the other two numbers of a_ijk times their functions in that entry of J, for i >= 2; and of
  // that of a_1jk - a_0jk along u, in column u, for i = 1.
  double& weight(int direction, int i, int row, int column) {
    return weights_[static_cast<std::size_t>((direction * n_ + i) * kWeights + 3 * column + row)];
  }
  static constexpr int kWeights = 2 * kWide;  // a matrix, by columns, in whole vectors
  AlignedDoubles weights_;
  std::array<AlignedDoubles, 3> is_used_;        // by direction: 1 where they are not 0
  bool fits_single_ = true;                      // whether the cell's size is far from overflow there
  std::size_t cell_ = 0;                         // number of the current one, from 1
  using Zones = std::array<LineError, LineModels::kZones>;
  std::array<std::array<std::array<Zones, HexContraction::kMostTiers>, LineModels::kMaxLevel + 1>, 3> errors_;
  LineModels::PerFunction bounds_, slope_bounds_;  // of N_i and N_i'
  // In lanes: bounds of N_i from 2 on, of their slopes, ...
  AlignedDoubles mode_bounds_, mode_slope_bounds_, inverse_bounds_, inverse_slope_bounds_;
  AlignedDoubles sums_;                            // scratch of make_weights
};

}  // namespace subvol
