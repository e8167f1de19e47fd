// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/control_matrices.h"
#include "fit/line_models.h"
#include "fit/simplex_models.h"

#include <array>
#include <span>
#include <vector>

namespace subvol {

/// Bernstein coefficients of the Jacobian of one high-order tet or prism over its parts, got by halving longest sides.
///
/// Over the simplex (a prism's triangle) the map is modelled once, by `SimplexModels`; parts follow by de Casteljau, so
/// what a fourier model leaves out stays, and cells closer to inversion than that stay undecided. Along a prism's w
/// each part has `LineModels` of its own. Jacobians are by local coordinates: along the part's sides.
class SimplexBoxes {
 public:
  struct Box {
    int level = 0;                    ///< halvings
    std::array<Vec3, 4> vertices{};   ///< of the simplex, canonical; a prism's triangle has w = 0
    int w_level = 0, w_index = 0;     ///< of a prism
    std::vector<double> control;      ///< at ((row num_layers) + k) index.size() + alpha
  };
  static constexpr int kLevelsPerDepth = 3;

  SimplexBoxes(CellKind kind, Basis basis, int order);

  void set_cell(std::span<const LocalMode> modes, std::span<const Vec3> coefficients);
  Box root() const;
  std::array<Box, 2> children(const Box& box) const;
  int num_corners() const { return kind_ == CellKind::tet ? 4 : 6; }
  Vec3 corner_point(const Box& box, int corner) const;

  const ControlMatrices& matrices(const Box& box);
  std::size_t corner_matrix(int corner) const;
  Mat3 remainder(const Box& box) const;
  bool is_hopeless(const Box&) const { return false; }
  /// Whether the model of the simplex is too far from the map to prove anything near the box's mean, however small.
  bool is_stuck(const Box& box);
  double determinant_scale(const Box& box) const;

 private:
  /// Columns are the sides of a part.
  Mat3 sides(const Box& box) const;

  CellKind kind_;
  const SimplexModels& simplex_;
  const LineModels& line_;  // along w
  int num_layers_, w_controls_;
  std::span<const LocalMode> modes_;
  std::span<const Vec3> coefficients_;
  std::vector<const SimplexModels::Function*> functions_;  // per mode
  Mat3 lasting_;  // what of the modelling errors stays with every part, by canonical coordinates
  SimplexIndex lower_;                        // degree - 1
  std::vector<std::array<int, 4>> raised_;    // per index of lower_: with one exponent more
  std::vector<std::array<int, 4>> reduced_;   // per index: in lower_ with one exponent less, or -1
  std::vector<double> contracted_;
  ControlMatrices matrices_, mean_;
};

}  // namespace subvol
