// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/control_matrices.h"
#include "fit/line_models.h"
#include "fit/simplex_models.h"

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace subvol {

/// Bernstein coefficients of the Jacobian of one high-order tet or prism over its parts, got by halving longest sides.
///
/// Over the simplex (a prism's triangle) the map is modelled by `SimplexModels`, anew where there are some for a part;
/// parts between follow by de Casteljau. Along a prism's w each part has `LineModels` of its own. Jacobians are by local
/// coordinates: along the part's sides.
class SimplexBoxes {
 public:
  struct Box {
    int level = 0;                    ///< halvings
    std::array<Vec3, 4> vertices{};   ///< of the simplex, canonical; a prism's triangle has w = 0
    int halvings = 0;                 ///< of the simplex
    std::uint32_t part = 1;           ///< number of the simplex
    int w_level = 0, w_index = 0;     ///< of a prism
    std::shared_ptr<const SimplexModels::Part> models;  ///< of the part that `control` comes from
    Mat3 lasting = Mat3::Zero();      ///< what of their errors stays with every part, by canonical coordinates
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
  /// Whether the last models of the simplex are too far from the map to prove anything near the box's mean.
  bool is_stuck(const Box& box);
  double determinant_scale(const Box& box) const;

 private:
  /// Columns are the sides of a part.
  Mat3 sides(const Box& box) const;
  /// Takes the models of the box's simplex.
  void take_models(Box& box) const;
  /// Halves the side from vertex a to b of the models' control points.
  void halve_control(const Box& box, int a, int b, std::array<Box, 2>& halves) const;

  CellKind kind_;
  const SimplexModels& simplex_;
  const LineModels& line_;  // along w
  int num_layers_, w_controls_;
  std::span<const LocalMode> modes_;
  std::span<const Vec3> coefficients_;
  std::vector<std::size_t> slots_;            // of the modes, in the models of a part
  SimplexIndex lower_;                        // degree - 1
  std::vector<std::array<int, 4>> raised_;    // per index of lower_: with one exponent more
  std::vector<std::array<int, 4>> reduced_;   // per index: in lower_ with one exponent less, or -1
  std::vector<double> contracted_;
  ControlMatrices matrices_, mean_;
};

}  // namespace subvol
