// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/control_matrices.h"
#include "fit/line_models.h"
#include "fit/shape_functions.h"

#include <array>
#include <span>
#include <vector>

namespace subvol {

/// Bernstein coefficients of the Jacobian dx/du of one high-order hex over its dyadic boxes.
///
/// On a box each of N_i(u), N_j(v), N_k(w) is replaced by its `LineModels`; the map's coefficients follow by three
/// contractions, of which the boxes of one split share the first two, and J's by differences.
class HexBoxes {
 public:
  /// A cube of side 2^-level.
  struct Box {
    int level = 0;
    std::array<int, 3> index{0, 0, 0};
  };
  static constexpr int kNumChildren = 8, kLevelsPerDepth = 1, kMaxDepth = LineModels::kMaxLevel;

  HexBoxes(Basis basis, int order);

  /// Takes a cell by its modes and their coefficients, relative to a point nearby.
  void set_cell(std::span<const LocalMode> modes, std::span<const Vec3> coefficients);

  static Box root() { return {}; }
  static int num_corners() { return 8; }
  static std::array<Box, kNumChildren> children(const Box& box, double lowest = 0);
  /// Models are as good as their level allows.
  static bool improve(Box&, double) { return false; }
  static Vec3 corner_point(const Box& box, int corner);

  /// J's coefficients on a box; valid until the next call. Boxes in the order of `children` cost least.
  const ControlMatrices& matrices(const Box& box);
  /// Number of the matrix at a corner of the box: J there, by the model.
  std::size_t corner_matrix(const Box& box, int corner) const;
  /// Bounds of the errors of J's entries: modelling and rounding.
  const Mat3& remainder(const Box& box);
  /// Whether the modelling error is so large that no bound can be hoped for.
  bool is_hopeless(const Box& box);
  /// Whether no part of the box can be decided either: models get better with every level.
  static bool is_stuck(const Box&) { return false; }
  /// det of dx/du over that of `matrices`.
  static double determinant_scale(const Box&) { return 1; }

 private:
  void contract_w(int level, int index);
  void contract_v(int level, int index);
  void contract_u(int level, int index);
  void differences(int level);
  Mat3 make_remainder(int level) const;

  const LineModels& models_;
  int n_, q1_;                                   // functions and coefficients per direction
  Box current_;                                  // what the buffers hold
  int contracted_ = 0;                           // and how many of its directions, from w on, are done
  std::array<std::vector<double>, 3> modes_;     // x, y, z of a_ijk at (k n + j) n + i
  std::array<std::vector<double>, 3> absolute_;  // |a_ijk|
  std::array<std::vector<double>, 3> after_w_;   // at (o_w n + j) n + i
  std::array<std::vector<double>, 3> after_v_;   // at (i q1 + o_w) q1 + o_v
  std::array<std::vector<double>, 3> control_;   // at (o_u q1 + o_w) q1 + o_v, behind a margin of q1^2
  std::array<std::vector<double>, 3> below_, above_;  // per direction: o and q - o at each control point
  ControlMatrices matrices_;
  Vec3 mean_edges_;  // lengths of the linear part's mean columns
  std::array<Mat3, LineModels::kMaxLevel + 1> remainders_;
  std::array<bool, LineModels::kMaxLevel + 1> has_remainder_{};
};

}  // namespace subvol
