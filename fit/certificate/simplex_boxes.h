// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/certificate/control_matrices.h"
#include "fit/certificate/line_models.h"
#include "fit/certificate/prism_matrices.h"
#include "fit/certificate/simplex_models.h"

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace subvol {

/// Bernstein coefficients of the Jacobian of one high-order tet or prism over its parts, got by halving longest sides.
///
/// Over the simplex (a prism's triangle) the map is modelled by `SimplexModels` of the lowest tier whose errors, by
/// this cell's coefficients, are small; anew for a part where errors of the last ones matter. Parts between follow by
/// de Casteljau. Along a prism's w each part has `LineModels` of its own. Jacobians are by local coordinates: along
/// the part's sides. What they are made of differs: `TetBoxes`, `PrismBoxes`.
class SimplexBoxes {
 public:
  /// Sums over the functions with one N_k along w (tets: all of them) of what `SimplexModels::Function` says of them,
  /// times the sizes of their coefficients.
  struct Layer {
    Vec3 value_bound = Vec3::Zero(), gradient_bound = Vec3::Zero(), error = Vec3::Zero(), gradient_error = Vec3::Zero();
    Vec3 largest_coefficient = Vec3::Zero(), rounding = Vec3::Zero();
  };
  struct Box {
    int level = 0;                    ///< halvings
    std::array<Vec3, 4> vertices{};   ///< of the simplex, canonical; a prism's triangle has w = 0
    int halvings = 0;                 ///< of the simplex
    std::uint32_t part = 1;           ///< number of the simplex
    int w_level = 0, w_index = 0;     ///< of a prism
    int tier = -1;                    ///< of the models that `control` comes from; -1: none is close enough
    int modelled = 0;                 ///< halvings of the part that they are of
    std::shared_ptr<const std::vector<Layer>> layers;  ///< what they leave out
    AlignedDoubles control;           ///< at alpha lanes_ + row num_layers_ + k
  };
  static constexpr int kLevelsPerDepth = 3, kMaxDepth = 20;

  void set_cell(std::span<const LocalMode> modes, std::span<const Vec3> coefficients);
  Box root();
  /// lowest: det of dx/du where it is least, as far as known. New models are taken where the old ones' errors matter.
  std::array<Box, 2> children(Box box, double lowest);
  /// Takes models of a higher tier where the errors of those there are matter. False: there are none.
  bool improve(Box& box, double lowest, bool is_last);
  /// Boxes are halved along their longest sides.
  static void choose_split(Box&) {}
  Vec3 corner_point(const Box& box, int corner) const;

  Mat3 remainder(const Box& box) const;
  /// Whether the modelling error is so large that no bound can be hoped for.
  bool is_hopeless(const Box& box) const;
  /// About the mean of det of dx/du over the cell.
  double mean_determinant() const { return mean_edges_.prod(); }
  /// Of `determinant_bound`.
  Mat3 frame(const Box& box) const;
  static Mat3* near_l(Box&) { return nullptr; }  // parts have sides of other directions
  double determinant_scale(const Box& box) const;

 protected:
  SimplexBoxes(CellKind kind, Basis basis, int order);
  /// Whether the last models of the simplex are too far from the map to prove anything near the mean of these matrices.
  template <class Matrices>
  bool is_stuck(const Box& box, const Matrices& matrices) {
    return has_last_models(box) && is_stuck_at(box, matrices.mean());
  }
  const SimplexTables& tables(const Box& box) const { return simplex_.tables(box.tier); }

 private:
  void set_modes(std::span<const LocalMode> modes);
  bool has_last_models(const Box& box) const { return box.halvings >= simplex_.most_halvings() && box.tier >= 0; }
  bool is_stuck_at(const Box& box, const Mat3& mean);
  /// Columns are the sides of a part.
  Mat3 sides(const Box& box) const;
  /// Takes models of the box's simplex: of the lowest tier from `least_tier` on with errors, measured by the mean
  /// edges, up to `wanted`; else of the highest, or none where that is hopeless and parts of it will have their own.
  void take_models(Box& box, double wanted, int least_tier);
  struct Weighted {
    const double* model;
    std::size_t step;  // between its vectors
    Vec3 coefficient;
  };
  /// Control points, `count` vectors of them from the first one on: models by their coefficients. control: where those
  /// of the layer start.
  template <int count>
  void store_sums(std::span<const Weighted> models, std::size_t first, double* control) const;
  int choose_tier(const Box& box, const SimplexModels::Part& part, double wanted, int least_tier) const;
  double wanted_error(double lowest) const;
  bool models_matter(const Box& box, double lowest) const;
  /// What of the errors of the simplex's models stays with every part, by canonical coordinates.
  Mat3 lasting_error(const Box& box) const;
  double by_mean_edges(const Mat3& error) const {
    return error.colwise().sum().cwiseQuotient(mean_edges_.transpose()).sum();
  }
  /// The errors of all models, by canonical coordinates.
  Mat3 modelling_error(const Box& box) const;
  /// Of `matrices`.
  Mat3 rounding_error(const Box& box) const;
  /// Both hold the control points of the whole, and those of one half each when done.
  void halve_control(const SimplexHalving& halving, AlignedDoubles& low, AlignedDoubles& high) const;

  CellKind kind_;
  const SimplexModels& simplex_;

 protected:
  const LineModels& line_;  // along w
  int num_layers_;
  std::size_t lanes_;       // numbers per control point: a multiple of SimplexTables::kLanes

 private:
  double small_error_;      // share of the mean edges
  int num_modes_ = 0, highest_ = 0;  // of the coefficients that are not 0: how many, and the highest order i + j + k
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
    Eigen::RowVector3d gradient;  // about the mean
  };
  std::span<const LocalMode> of_modes_;         // what the next two are of
  std::vector<Place> places_;                   // where each mode goes
  std::vector<LinearMode> linear_modes_;
  std::vector<std::vector<Term>> layer_terms_;  // by the number of N_k along w; a tet's are all in one layer
  Vec3 mean_edges_;                             // lengths of the linear part's mean columns
  std::shared_ptr<const SimplexModels::Part> whole_;  // what the whole simplex has been asked for
  std::vector<SimplexModels::Models> whole_models_;   // by tier
  std::vector<Weighted> used_;                        // scratch of take_models
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
  /// Number of the matrix at a corner of the box: J there, by the model.
  std::size_t corner_matrix(const Box& box, int corner) const;
  /// Whether no model is good enough for a box whose matrices are there.
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
  /// Number of the matrix at a corner of the box whose matrices are there: J there, by the model.
  std::size_t corner_matrix(const Box& box, int corner) const;
  /// Whether no model is good enough for a box whose matrices are there.
  bool is_stuck(const Box& box) { return SimplexBoxes::is_stuck(box, matrices_); }

 private:
  PrismMatrices& matrices(const Box& box);

  PrismMatrices matrices_;
};

}  // namespace subvol
