// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/certificate/control_matrices.h"
#include "subvol/fit/certificate/line_models.h"
#include "subvol/fit/certificate/prism_matrices.h"
#include "subvol/fit/certificate/simplex_models.h"

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace subvol::internal {

/// Bernstein coefficients of the Jacobian of one high-order tet or prism over its boxes, computed by bisecting longest
/// sides.
///
/// Over the simplex (a prism's triangle), the map is replaced by `SimplexModels` of the lowest tier whose errors are
/// small for this cell's coefficients. A sub-box takes new models if the errors of the last ones matter; in between,
/// its control points follow by de Casteljau. Along a prism's w, each box has `LineModels` of its own. Jacobians are in
/// local coordinates, along the box's sides. `TetBoxes` and `PrismBoxes` compute them in different ways.
class SimplexBoxes {
 public:
  /// Sums over the functions with one N_k along w (tets: over all functions) of the bounds and errors in
  /// `SimplexModels`, times the absolute values of their coefficients.
  struct Layer {
    Vec3 value_bound = Vec3::Zero(), gradient_bound = Vec3::Zero(), error = Vec3::Zero(), gradient_error = Vec3::Zero();
    Vec3 largest_coefficient = Vec3::Zero(), rounding = Vec3::Zero();
  };
  struct Box {
    int level = 0;                   ///< number of bisections
    std::array<Vec3, 4> vertices{};  ///< of the simplex, in canonical coordinates; a prism's triangle has w = 0
    int halvings = 0;                ///< bisections of the simplex
    std::uint32_t part = 1;          ///< number of the simplex, as in `SimplexModels`
    int w_level = 0, w_index = 0;    ///< position along w, of a prism
    int tier = -1;                   ///< tier of the models that `control` comes from; -1: none is accurate enough
    int modeled = 0;                 ///< bisections of the simplex that these models are made for
    std::shared_ptr<const std::vector<Layer>> layers;  ///< bounds and errors of these models
    AlignedDoubles control;                            ///< control points: at alpha lanes_ + row num_layers_ + k
  };
  // Three bisections halve all edges. At the greatest depth, these have 1e-6 of their length.
  static constexpr int kLevelsPerDepth = 3, kMostSimplexDepth = 20;
  static constexpr int max_depth() { return kMostSimplexDepth; }

  void set_cell(std::span<const LocalMode> modes, std::span<const Vec3> coefficients);
  Box root();
  /// lowest: least det of dx/du known so far (-infinity: unknown). New models are taken if the old ones' errors matter.
  std::array<Box, 2> children(Box box, double lowest);
  /// Takes models of a higher tier if the errors of the current ones matter. Returns false if it takes none.
  bool improve(Box& box, double lowest, bool is_last);
  /// Does nothing: boxes are bisected along their longest sides.
  static void choose_split(Box&) {}
  Vec3 corner_point(const Box& box, int corner) const;

  Mat3 remainder(const Box& box) const;
  /// True if the modeling error is so large that no bound can be expected.
  bool is_hopeless(const Box& box) const;
  /// About the mean of det dx/du over the cell.
  double mean_determinant() const { return mean_edges_.prod(); }
  /// The frame for `determinant_bound`.
  Mat3 frame(const Box& box) const;
  static Mat3* near_l(Box&) { return nullptr; }  // sub-boxes have sides of other directions
  double determinant_scale(const Box& box) const;

 protected:
  SimplexBoxes(CellKind kind, Basis basis, int order);
  /// True if the last models of the simplex are too far from the map to prove anything near the mean of these matrices.
  template <class Matrices>
  bool is_stuck(const Box& box, const Matrices& matrices) {
    return has_last_models(box) && is_stuck_at(box, matrices.mean());
  }
  const SimplexTables& tables(const Box& box) const { return simplex_.tables(box.tier); }

 private:
  void set_modes(std::span<const LocalMode> modes);
  bool has_last_models(const Box& box) const { return box.halvings >= simplex_.most_halvings() && box.tier >= 0; }
  bool is_stuck_at(const Box& box, const Mat3& mean);
  /// Matrix whose columns are the sides of a box.
  Mat3 sides(const Box& box) const;
  /// Takes models of the box's simplex. Selects the lowest tier >= `least_tier` whose error, relative to the mean
  /// edges, is <= `wanted`; otherwise the highest tier, or none if even that is hopeless and sub-boxes will get their
  /// own models.
  void take_models(Box& box, double wanted, int least_tier);
  struct Weighted {
    const double* model;
    std::size_t step;  // numbers between its vectors
    Vec3 coefficient;
  };
  /// Computes `count` vectors of control points, from vector `first` on: the sums of models times their coefficients.
  /// control: start of the layer's control points.
  template <int count>
  void store_sums(std::span<const Weighted> models, std::size_t first, double* control) const;
  int choose_tier(const Box& box, const SimplexModels::Part& part, double wanted, int least_tier) const;
  double wanted_error(double lowest) const;
  bool models_matter(const Box& box, double lowest) const;
  /// Errors of the simplex's models that remain in every sub-box, in canonical coordinates.
  Mat3 lasting_error(const Box& box) const;
  double by_mean_edges(const Mat3& error) const {
    return error.colwise().sum().cwiseQuotient(mean_edges_.transpose()).sum();
  }
  /// Errors of all models, in canonical coordinates.
  Mat3 modeling_error(const Box& box) const;
  /// Rounding errors of `matrices`.
  Mat3 rounding_error(const Box& box) const;
  /// On entry, both hold the control points of the whole; on return, those of one half each.
  void halve_control(const SimplexHalving& halving, AlignedDoubles& low, AlignedDoubles& high) const;

  CellKind kind_;
  const SimplexModels& simplex_;

 protected:
  const LineModels& line_;  // along w
  int num_layers_;
  std::size_t lanes_;  // numbers per control point: a multiple of SimplexTables::kControlPointLanes

 private:
  double small_error_;               // default for the errors of models, relative to the mean edges
  int num_modes_ = 0, highest_ = 0;  // number of nonzero coefficients, and their highest order i + j + k
  struct Term {
    std::size_t slot;  // of the function, in the models of a part
    int order;
    Vec3 coefficient;
  };
  struct Place {
    int layer;
    std::size_t slot;
    int order;
  };
  struct LinearMode {
    std::size_t number;
    Eigen::RowVector3d gradient;  // approximate mean
  };
  std::span<const LocalMode> of_modes_;  // the modes that the next two are made for
  std::vector<Place> places_;            // layer, slot and order of each mode
  std::vector<LinearMode> linear_modes_;
  std::vector<std::vector<Term>> layer_terms_;        // by the number of N_k along w; a tet's are all in one layer
  Vec3 mean_edges_;                                   // lengths of the linear part's mean columns
  std::shared_ptr<const SimplexModels::Part> whole_;  // data of the whole simplex, once requested
  std::vector<SimplexModels::Models> whole_models_;   // models of the whole simplex, by tier
  std::vector<Weighted> used_;                        // scratch memory of take_models
  ControlMatrices mean_;
};

class TetBoxes : public SimplexBoxes {
 public:
  TetBoxes(Basis basis, int order) : SimplexBoxes(CellKind::tet, basis, order) {}
  static int num_corners() { return 4; }
  /// Calls work(matrices) with J's coefficients on a box with models.
  template <class Work>
  void with_matrices(const Box& box, const Work& work) {
    work(matrices(box));
  }
  /// Number of the matrix at a corner of the box: J there, according to the model.
  std::size_t corner_matrix(const Box& box, int corner) const;
  /// True if no model is accurate enough for the box whose matrices were computed last.
  bool is_stuck(const Box& box) { return SimplexBoxes::is_stuck(box, matrices_); }

 private:
  ControlMatrices& matrices(const Box& box);

  ControlMatrices matrices_;
};

class PrismBoxes : public SimplexBoxes {
 public:
  PrismBoxes(Basis basis, int order) : SimplexBoxes(CellKind::prism, basis, order) {}
  static int num_corners() { return 6; }
  /// Calls work(matrices) with J's coefficients on a box with models.
  template <class Work>
  void with_matrices(const Box& box, const Work& work) {
    work(matrices(box));
  }
  /// Number of the matrix at a corner of the box whose matrices were computed last: J there, according to the model.
  std::size_t corner_matrix(const Box& box, int corner) const;
  /// True if no model is accurate enough for the box whose matrices were computed last.
  bool is_stuck(const Box& box) { return SimplexBoxes::is_stuck(box, matrices_); }

 private:
  PrismMatrices& matrices(const Box& box);

  PrismMatrices matrices_;
};

}  // namespace subvol::internal
