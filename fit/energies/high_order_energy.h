// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/elements/cell_reference.h"
#include "fit/elements/element_space.h"
#include "fit/elements/quadrature.h"
#include "fit/energies/distortion.h"
#include "fit/energies/volume_term.h"
#include "fit/simd/wide.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace subvol {

struct CellGroup;

/// Mean distortion of a mesh of curved cells against ideal or given reference cells.
///
///   E_W(x) = 1/n sum_c sum_q w_cq e(J_cq(x)),   J_cq = dx/du(u_q) A_cq^-1       Paper: Eqs. 2-7
///
/// e is a distortion (`distortion.h`; Hencky's unless another is set), A_cq the derivative of the ideal cell's map:
/// edge length 1, stretched by h_c along its three coordinates, or a reference of its own. Nodes are those of an
/// `ElementSpace`: vertex positions and the coefficients of edge, face and cell modes. w_cq is the quadrature's weight.
/// E_W is a mean, and e grows slowly towards inversion: few places that are much worse than they need be matter little
/// to it. With an emphasis k > 0 points of poor shape weigh more, the mean of all weights staying what it was:
///
///   w_cq ~ w_q (1 + k_c max(0, 1 - s_cq / 0.6)^2),   s_cq = det J / (|J e1| |J e2| |J e3|) (at least 0)
///
/// with s_cq of the nodes when k was set, or cells were densified last; k_c is k, but in cells that were densified at
/// least 4, and twice as much each time, up to 256.
///
/// Eight cells of one kind and order are worked on side by side. Hexes are sum-factorised: O(n^4) instead of O(n^6) for
/// n modes per direction; prisms and tets use the gradients of their modes at all points. The second derivative is kept
/// as 27 numbers per point (30 where stretches are coupled) and never assembled. Same bits for any number of threads;
/// one caller at a time, const functions included, for they share a buffer.
class HighOrderEnergy final : public VolumeTerm {
 public:
  /// space  must outlive the energy.
  /// ideal_lengths  h_c of each cell: three positive lengths in the mesh's unit, else InputError.
  /// points_per_direction  of each cell; at least 2, else InputError.
  HighOrderEnergy(const ElementSpace& space, std::span<const Vec3> ideal_lengths,
                  std::span<const int> points_per_direction, QuadratureRule rule = QuadratureRule::trapezoidal);
  /// reference  kept and asked again by `densify`. InputError: a reference whose determinant is not positive.
  HighOrderEnergy(const ElementSpace& space, CellReference reference, std::span<const int> points_per_direction,
                  QuadratureRule rule = QuadratureRule::trapezoidal);
  ~HighOrderEnergy() override;

  double value(std::span<const Vec3> nodes) const override;
  double add_gradient(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient) const override;
  double linearize(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient) override;
  /// H is kept in single precision: entries are good to 1e-6 of the largest.
  void multiply(std::span<const Vec3> in, std::span<Vec3> out) const override;
  /// Of the diagonal that the mean of the second derivative over every cell's points gives. Every column of the map
  /// must have at most one entry for it to be that of M^T H M; else what couples several nodes is left out.
  void add_diagonal_blocks(const SparseMap& map, const SparseMap& map_transposed,
                           std::span<Mat3> diagonal) const override;
  double max_step(std::span<const Vec3> nodes, std::span<const Vec3> direction, double limit = 1) const override;
  bool stiffen(std::span<const Vec3> nodes, std::span<const Vec3> direction, double t) override;
  bool stiffen(std::span<const Index> cells) override;
  /// Number of quadrature points of all cells.
  std::size_t num_points() const;
  /// Of each cell; more than it was made with where it was densified.
  std::span<const int> points_per_direction() const { return points_; }
  std::vector<Index> uncertified(std::span<const Vec3> nodes) const override;
  /// A curved cell that is certified at one length of a step, but not at twice it, may be all but inverted between its
  /// points, and then no direction goes on from there. With half of it, its least determinant is at least about half of
  /// what it was.
  bool keeps_off_inversion() const override { return true; }
  /// Cells that are in the way twice as dense, up to 25 points a direction, their points of poor shape heavier.
  void densify(std::span<const Index> cells, std::span<const Vec3> nodes) override;
  /// e, Hencky's to begin with.
  /// floor  least eigenvalue of its second derivative at a point; -infinity: it may be indefinite.
  void set_distortion(Distortion distortion, double floor = kHessianFloor);
  static constexpr double kMostEmphasis = 1024;
  /// k, by the shape that cells have at these nodes. InputError: not in [0, kMostEmphasis].
  void emphasize_poor(std::span<const Vec3> nodes, double emphasis);
  /// What cells that are densified reach, 256 at first; 0: nothing.
  void set_most_own_emphasis(double most) { most_own_emphasis_ = most; }

 private:
  template <bool kCoupled>
  double linearize_as(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient);
  template <bool kCoupled>
  void multiply_as(std::span<const Vec3> in) const;
  void rebuild_groups();
  void weigh_points(std::span<const Vec3> nodes);
  void fill_references(CellGroup& group) const;
  void find_incidences();
  void stiffen_point(CellGroup& group, std::size_t batch, std::size_t q, int lane);
  template <bool kBack, class Kernel, class PerPoint>
  double integrate(std::span<const Vec3> nodes, const Kernel& kernel, const PerPoint& per_point) const;
  double cell_share() const { return 1.0 / static_cast<double>(space_->num_cells()); }
  template <class PerPoint>
  void for_each_pair(std::span<const Vec3> nodes, std::span<const Vec3> direction, const PerPoint& per_point) const;
  template <class PerBatch>
  double sum_batches(PerBatch&& per_batch) const;
  void keep(const CellGroup& group, std::size_t batch, const std::vector<Wide>& coefficients) const;
  void gather_nodes(double scale, std::span<Vec3> out) const;

  const ElementSpace* space_;
  QuadratureRule rule_;
  std::vector<Mat3> inverse_ideal_;  ///< A^-1 of each cell, where cells have one for all their points
  CellReference reference_;
  std::vector<int> points_;
  const DistortionKernels* kernels_ = &kernels_of(Distortion::hencky);
  double floor_ = kHessianFloor;
  double emphasis_ = 0, most_own_emphasis_ = 256;
  std::vector<double> own_emphasis_;  ///< of each cell that was densified
  std::vector<CellGroup> groups_;
  /// What every batch adds to its cells' modes, and where each node finds its parts: signed places, by node.
  mutable std::vector<double> local_;
  std::vector<std::size_t> incidence_offsets_;
  std::vector<std::int64_t> incidences_;
};

}  // namespace subvol
