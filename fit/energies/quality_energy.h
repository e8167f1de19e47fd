// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/element_rule.h"
#include "subvol/fit/energies/boundary_folds.h"
#include "subvol/fit/energies/cell_blocks.h"
#include "subvol/fit/energies/point_jacobians.h"
#include "subvol/fit/energies/volume_term.h"
#include "subvol/fit/features/quality_caps.h"
#include "subvol/fit/tuning/quality_tuning.h"
#include "subvol/mesh/volume_mesh.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace subvol::internal {

/// Weights of the terms of `QualityEnergy`. All are >= 0 and dimensionless.
struct QualityWeights {
  double cosine = 1;         ///< w_c: right angles, which is what the mean scaled Jacobian rises with
  double hinge = 50;         ///< w_h: no scaled Jacobian below the threshold
  double threshold = 0.3;    ///< t, at most 1: must lie well above the scaled Jacobian that is wanted
  double edge = 20;          ///< w_e: no edge dies. The scaled Jacobian does not see lengths
  double least_edge = 0.25;  ///< rho, as a share of the wanted length
  double twist = 0.3;        ///< w_p: faces are parallelograms
};

/// A least-squares energy that raises the scaled Jacobians of linear cells, the lowest ones most.
///
///   E = sum over cells of  w_c sum over corners a_q sum over i < j cos^2(d_i, d_j)
///                        + w_h sum over points  a_q omega max(0, t - s)^2
///                        + w_e sum over corners a_q omega sum over i max(0, 1 - |d_i| / (rho h_i))^2
///                        + w_p / (6 h^2) sum over quads |x_0 - x_1 + x_2 - x_3|^2
///     + w_h sum over edges of the boundary  omega f^2, if folds are forbidden
///
/// d_i  columns of the Jacobian in the coordinates of the ideal cell (`ElementRule`): edges, at the corners of a hex
/// s    scaled Jacobian det(d_1, d_2, d_3) / (|d_1| |d_2| |d_3|), as `measure_quality` samples it. In s and in the
///      cosines, lengths count as 5 % of the least h_i or more: as a d_i vanishes, its derivatives stay bounded
/// h_i  wanted lengths of the cell;  h: their geometric mean
/// t    the threshold, or the cap of the point if that is lower (`set_caps`)
/// a_q  1 / number of corners at the corners; 1/16, by default (`QualityTuning`), at other points: the midpoints of
///      edges, faces and cell, or more of them in cells that were refined (`densify`). A tet has one point only, which
///      stands for all and has a_q = 1. A pyramid has the points of its base, which stand for the rays to its apex, and
///      its four corners there
/// f    residual of a fold (`BoundaryFolds`); its Hessian is bounded by that of two faces that turn on their own
/// omega >= 1: emphasis of poor corners, cells and folds (`emphasize_poor`)
///
/// The energy is finite for inverted cells, too: nothing limits a step but `ruined`. The Hessian is that of
/// Gauss-Newton, 2 sum of the squared residuals' derivatives, which is positive semidefinite.
///
/// Cells run in parallel color by color, and sums are made in the order of the cells: the results have the same bits
/// for any number of threads. Nothing is allocated by the evaluations but one sum per cell.
class QualityEnergy final : public VolumeTerm {
 public:
  /// mesh     must outlive the energy; its positions are not read. InputError: as for `CellBlocks`.
  /// lengths  h_i of each cell: positive and finite, in the unit of the nodes, else InputError.
  QualityEnergy(const VolumeMesh& mesh, std::span<const Vec3> lengths, const QualityTuning& tuning = {});

  /// The energy of some cells of another one, with their lengths, caps and numbers of points, the weights, and no
  /// emphasis. part: a mesh of these cells in this order, which must outlive the energy.
  QualityEnergy(const QualityEnergy& whole, const VolumeMesh& part, std::span<const Index> cells);

  /// InputError: a weight that is negative or not finite, a threshold above 1.
  void set_weights(const QualityWeights& weights);

  /// Lowers the threshold t at points on these edges and at these vertices to the cap, and the goal of
  /// `emphasize_poor` to slightly less. Edges that are none of the mesh have no effect; replaces earlier caps.
  void set_caps(std::span<const EdgeCap> edges, std::span<const VertexCap> vertices);

  /// From then on, the boundary must not fold onto itself (`BoundaryFolds`).
  /// edges        angles that are wanted, as `set_caps`.
  /// least_edge   share of its wanted length below which an edge at a corner is poor: folds end where faces have shrunk
  ///              to slivers. 0: lengths do not matter.
  void forbid_folds(std::span<const EdgeCap> edges, double least_edge);

  /// State of the cells against a goal.
  struct State {
    double least = 1;           ///< least scaled Jacobian at the points of all cells; 1 without cells
    double least_share = 1;     ///< least share of the goal, or of the lower goal at caps, that a point has reached; at
                                ///< most 1, and at least -1 but at folds
    std::vector<Index> poor{};  ///< cells with a point below its goal, or at a fold, ascending
    std::vector<double> shares{};  ///< least share of each of these
  };
  /// The numbers here are those of `QualityTuning` by default. Multiplies the emphasis of corners below the goal by
  /// 2.5, and that of all other points of cells with one of them below; elsewhere it falls back by 3 % toward 1. At
  /// most 1000. The goal at a cap is lower than the cap by 0.02, but at least 0.01; shares of it count as -1 or more.
  /// If folds are forbidden, a fold reaches its goal halfway between its limit and 360 degrees, and a corner also needs
  /// edges of the least length.
  State emphasize_poor(std::span<const Vec3> nodes, double goal);
  /// Sets all emphasis to 1.
  void reset_emphasis();

  /// Writes the least scaled Jacobian of each cell over its points to `least`, one entry per cell (else InputError).
  void least_scaled_jacobians(std::span<const Vec3> nodes, std::span<double> least) const;

  /// Returns the cells, ascending, that are below the goal at the five points in each direction at which checks sample,
  /// though not at their own. Cells with caps are left out.
  std::vector<Index> poor_between_points(std::span<const Vec3> nodes, double goal) const;

  double value(std::span<const Vec3> nodes) const override;
  std::vector<double> cell_values(std::span<const Vec3> nodes) const override;
  double add_gradient(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient) const override;
  double linearize(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient) override;
  void multiply(std::span<const Vec3> in, std::span<Vec3> out) const override { hessian_.multiply(in, out); }
  void add_diagonal_blocks(const SparseMap& map, const SparseMap& map_transposed,
                           std::span<Mat3> diagonal) const override;
  double max_step(std::span<const Vec3>, std::span<const Vec3>, double limit = 1) const override { return limit; }
  std::vector<Index> uncertified(std::span<const Vec3> nodes) const override;
  /// Returns the cells whose least scaled Jacobian falls below 0.05 and to less than a half, or by 0.02 if it was not
  /// positive, ascending.
  std::vector<Index> ruined(std::span<const Vec3> before, std::span<const Vec3> after) const override;
  std::vector<Index> nodes_of(std::span<const Index> cells) const override;
  /// From then on, these cells have five points in each direction instead of three.
  void densify(std::span<const Index> cells, std::span<const Vec3> nodes = {}) override;

 private:
  /// The points of one kind of cell.
  struct Points {
    ElementRule rule;
    std::vector<int> corner;      ///< local vertex of each point that is a corner; -1 for the others
    std::vector<int> edge;        ///< local edge of each point inside one; -1 for the others
    std::vector<double> weights;  ///< a_q
    PointJacobians jacobians;
  };
  struct CellSums;

  static Points make_points(CellKind kind, int points_per_direction, double inner_weight);
  const Points& points_of(std::size_t cell) const {
    return points_[static_cast<std::size_t>(mesh_->kinds[cell])][dense_[cell]];
  }
  double emphasis(std::size_t cell, int corner) const {
    return corner >= 0 ? corner_emphasis_[mesh_->cell_offsets[cell] + corner] : cell_emphasis_[cell];
  }
  double cap(std::size_t cell, const Points& points, std::size_t q) const;
  template <bool kDerivatives>
  double evaluate(std::size_t cell, std::span<const Vec3> nodes, CellSums& sums) const;
  template <bool kHessian>
  double add_derivatives(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient,
                         BlockSparse* hessian) const;
  double least_scaled_jacobian(std::size_t cell, const Points& points, std::span<const Vec3> nodes) const;
  double fold_weight(std::size_t edge) const { return weights_.hinge * fold_emphasis_[edge]; }
  double add_fold_derivatives(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient,
                              BlockSparse* hessian) const;

  const VolumeMesh* mesh_;
  QualityTuning tuning_;
  std::vector<Vec3> lengths_;
  QualityWeights weights_;
  std::array<std::array<Points, 2>, kNumCellKinds> points_;  ///< by kind, with three and with five a direction
  std::vector<std::uint8_t> dense_;                          ///< per cell: 1 if it has five points a direction
  /// Caps of the corners of a cell, and of its edges.
  struct CellCaps {
    std::array<double, kMaxCellVertices> corners;
    std::array<double, kMaxCellEdges> edges;
  };
  std::vector<Index> caps_of_cell_;  ///< place in caps_, or kNoIndex; empty: no caps
  std::vector<CellCaps> caps_;
  std::vector<double> corner_emphasis_, cell_emphasis_;  ///< omega, per corner of each cell and per cell
  std::optional<BoundaryFolds> folds_;                   ///< empty: they are not forbidden
  std::vector<double> fold_emphasis_;                    ///< omega of each of its edges
  double live_edge_ = 0;                                 ///< share of its wanted length that an edge must have
  std::vector<Index> order_;                             ///< cells by color
  std::vector<std::size_t> color_offsets_;               ///< first cell of each color in order_, and their number
  CellBlocks blocks_;
  BlockSparse hessian_;
};

}  // namespace subvol::internal
