// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/cell_reference.h"
#include "subvol/fit/elements/element_space.h"
#include "subvol/fit/elements/quadrature.h"
#include "subvol/fit/energies/distortion.h"
#include "subvol/fit/energies/volume_term.h"
#include "subvol/fit/simd/wide.h"
#include "subvol/fit/tuning/curved_tuning.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace subvol::internal {

struct CellGroup;

/// Mean distortion of a mesh of curved cells against ideal or given reference cells.
///
///   E_W(x) = 1/n sum_c sum_q w_cq e(J_cq(x)),   J_cq = dx/du(u_q) A_cq^-1       Paper: Eqs. 2-7
///
/// e is a distortion (`distortion.h`; Hencky unless another is set). A_cq is the derivative of the ideal cell's map
/// (edge length 1, stretched by h_c along its three coordinates) or a given reference. Nodes are those of an
/// `ElementSpace`: vertex positions and the coefficients of edge, face and cell modes. w_cq is the quadrature weight.
///
/// E_W is a mean, and e grows slowly toward inversion: a few places that are much worse than necessary hardly change
/// it. With an emphasis k > 0 points of poor shape weigh more, while the mean of all weights stays the same:
///
///   w_cq ~ w_q (1 + k_c max(0, 1 - s_cq / 0.6)^2),   s_cq = det J / (|J e1| |J e2| |J e3|) (at least 0)
///
/// s_cq is that of the nodes when k was set or the quadrature was last refined. k_c is k; in cells with refined
/// quadrature it is at least 4, doubled with each further refinement, up to 256. The 0.6 and the 4 are defaults of
/// `CurvedTuning`.
///
/// With a hinge of weight w_h > 0 and threshold t, low scaled Jacobians cost more, each point as much as any other, so
/// that corners and edges of cells count as much as their inside:
///
///   E_W += 1/n sum_c w_h / q_c sum_q max(0, t - s_cq)^2          q_c: number of points; s_cq is that of x
///
/// Eight cells of one kind and order are processed side by side. Hexes are sum-factorized: O(n^4) instead of O(n^6) for
/// n modes per direction; prisms and tets use the gradients of their modes at all points. The second derivative is kept
/// as 27 numbers per point (30 if stretches are coupled, 9 more with a hinge) and never assembled. The results have the
/// same bits for any number of threads. Only one caller at a time may use an object, const functions included: they
/// share a buffer.
class HighOrderEnergy final : public RegularizedTerm {
 public:
  /// space  must outlive the energy.
  /// ideal_lengths  h_c of each cell: three positive lengths in the mesh's unit, else InputError.
  /// points_per_direction  one number per cell, at least 2, else InputError.
  HighOrderEnergy(const ElementSpace& space, std::span<const Vec3> ideal_lengths,
                  std::span<const int> points_per_direction, QuadratureRule rule = QuadratureRule::trapezoidal);
  /// reference  kept and evaluated again by `densify`. InputError: a reference whose determinant is not positive.
  HighOrderEnergy(const ElementSpace& space, CellReference reference, std::span<const int> points_per_direction,
                  QuadratureRule rule = QuadratureRule::trapezoidal);
  ~HighOrderEnergy() override;

  double value(std::span<const Vec3> nodes) const override;
  double add_gradient(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient) const override;
  double linearize(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient) override;
  /// H is kept in single precision: entries are accurate to 1e-6 of the largest.
  void multiply(std::span<const Vec3> in, std::span<Vec3> out) const override;
  /// Approximation: H is built from the mean of the second derivative over each cell's points, and blocks between
  /// different nodes are left out. The latter changes nothing if every column of the map has at most one entry.
  void add_diagonal_blocks(const SparseMap& map, const SparseMap& map_transposed,
                           std::span<Mat3> diagonal) const override;
  double max_step(std::span<const Vec3> nodes, std::span<const Vec3> direction, double limit = 1) const override;
  bool stiffen(std::span<const Vec3> nodes, std::span<const Vec3> direction, double t) override;
  bool stiffen(std::span<const Index> cells) override;
  /// Total number of quadrature points of all cells.
  std::size_t num_points() const;
  /// Quadrature points per direction of each cell, including refinements by `densify`.
  std::span<const int> points_per_direction() const { return points_; }
  std::vector<Index> uncertified(std::span<const Vec3> nodes) const override;
  void set_regularization(double epsilon) override;
  /// Multiplies the weights w_cq of the cells' points. InputError also with an emphasis, whose weights depend on nodes.
  void set_weights(std::span<const double> weights) override;
  void least_determinants(std::span<const Vec3> nodes, std::span<double> least) const override;
  std::vector<Index> not_certified(std::span<const Vec3> nodes) const override;
  /// True: a curved cell that is certified after a step, but not after twice that step, may be nearly inverted between
  /// its points, and then no direction leads on from there. After half the step, its least determinant is still at
  /// least about half of what it was.
  bool keeps_off_inversion() const override { return true; }
  /// Refines these cells (n -> 2 n - 1 points per direction, up to 25) and emphasizes points of poor shape in them.
  void densify(std::span<const Index> cells, std::span<const Vec3> nodes) override;
  /// Makes the cells part of a mesh of so many cells: n above.
  void count_as_part(std::size_t num_cells) { num_cells_ = static_cast<double>(num_cells); }
  /// Sets e, initially Hencky.
  /// floor  least eigenvalue of its second derivative at a point; -infinity: it may be indefinite.
  void set_distortion(Distortion distortion, double floor = kHessianFloor);
  static constexpr double kMostHighOrderEmphasis = 1024;  // largest k allowed; lifts end at 512 (`kEmphases`)
  /// Sets k and weighs points by their shapes at these nodes. InputError: k is not in [0, kMostHighOrderEmphasis].
  void emphasize_poor(std::span<const Vec3> nodes, double emphasis);
  /// Sets w_h and t. InputError: a weight that is negative or not finite, a threshold above 1.
  void set_hinge(double weight, double threshold);
  /// Sets the largest k_c that repeated quadrature refinement leads to, initially 256; 0: refinement adds no emphasis.
  void set_most_own_emphasis(double most) { most_own_emphasis_ = most; }
  /// Sets the numbers of refinements, emphasis and stiffening.
  void set_tuning(const CurvedTuning& tuning) { tuning_ = tuning; }

 private:
  bool is_coupled() const { return epsilon_ > 0 || kernels_->coupled; }
  bool has_emphasis() const;
  template <bool kBack, class PerPoint>
  double integrate(std::span<const Vec3> nodes, int derivatives, const PerPoint& per_point) const;
  template <bool kCoupled>
  double linearize_as(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient);
  template <bool kCoupled>
  void multiply_as(std::span<const Vec3> in) const;
  void rebuild_groups();
  void weigh_points(std::span<const Vec3> nodes);
  void fill_references(CellGroup& group) const;
  void find_incidences();
  void freeze_hinge(CellGroup& group, std::size_t batch, std::size_t q, const DistortionBatch& at, double weight) const;
  double hinge_weight_at(const CellGroup& group) const;
  void stiffen_point(CellGroup& group, std::size_t batch, std::size_t q, int lane);
  template <bool kBack, class Kernel, class PerPoint>
  double integrate_with(std::span<const Vec3> nodes, const Kernel& kernel, const PerPoint& per_point) const;
  double cell_share() const { return 1.0 / num_cells_; }
  template <class PerPoint>
  void for_each_pair(std::span<const Vec3> nodes, std::span<const Vec3> direction, const PerPoint& per_point) const;
  template <class PerBatch>
  double sum_batches(PerBatch&& per_batch) const;
  void keep(const CellGroup& group, std::size_t batch, const std::vector<Wide>& coefficients) const;
  void gather_nodes(double scale, std::span<Vec3> out) const;

  const ElementSpace* space_;
  QuadratureRule rule_;
  double num_cells_;                 ///< n
  std::vector<Mat3> inverse_ideal_;  ///< A^-1 of each cell; empty with a `reference_`
  CellReference reference_;
  std::vector<int> points_;
  const DistortionKernels* kernels_ = &kernels_of(Distortion::hencky);
  double floor_ = kHessianFloor;
  double epsilon_ = 0;                ///< of the regularized barrier; 0: that of `kernels_`
  std::vector<double> cell_weights_;  ///< empty: all cells weigh the same
  CurvedTuning tuning_;
  double emphasis_ = 0, most_own_emphasis_ = 256;
  double hinge_weight_ = 0, hinge_threshold_ = 0;
  std::vector<double> own_emphasis_;  ///< per cell: emphasis by quadrature refinement; 0: not refined
  std::vector<CellGroup> groups_;
  /// Contributions of every batch to the modes of its cells. `incidences_` lists, node by node, their signed places.
  mutable std::vector<double> local_;
  std::vector<std::size_t> incidence_offsets_;
  std::vector<std::int64_t> incidences_;
};

}  // namespace subvol::internal
