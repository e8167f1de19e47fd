// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/cell_reference.h"
#include "subvol/fit/elements/element_rule.h"
#include "subvol/fit/energies/cell_blocks.h"
#include "subvol/fit/energies/distortion.h"
#include "subvol/fit/energies/volume_term.h"
#include "subvol/mesh/volume_mesh.h"

#include <array>
#include <span>
#include <vector>

namespace subvol::internal {

/// Mean distortion of a mesh of linear cells against ideal or given reference cells.
///
///   E_W(x) = sum_c w_c sum_q w_q e(J_cq(x)),   sum_c w_c = sum_q w_q = 1       Paper: Eqs. 2, 3, 7
///
/// e is a distortion (`distortion.h`; Hencky unless another is set). J_cq is the Jacobian of cell c at quadrature point
/// q with respect to its ideal cell, which is that of edge length 1 (`element_rule.h`) stretched by h_c along its three
/// coordinates (for a hex, the box of edges h_c), or with respect to a given reference. E_W is dimensionless, >= 0, and
/// +infinity if a determinant is not positive at a point.
///
/// Cells run in parallel color by color (no two cells of one color share a vertex), those of a color in fixed order:
/// the results have the same bits for any number of threads. The evaluations allocate only one partial sum per 8 cells,
/// and `add_gradient` a copy of the gradient.
class VolumeEnergy final : public RegularizedTerm {
 public:
  /// mesh  must outlive the energy; its positions are not read. InputError: more pairs of vertices that share a cell
  ///       than an Index can number (a hex mesh of about 8e7 vertices).
  /// ideal_lengths  h_c of each cell: three positive lengths in the mesh's unit, else InputError. All cells weigh the
  ///                same.
  /// points_per_direction  >= 2; 2: corners only.
  VolumeEnergy(const VolumeMesh& mesh, std::span<const Vec3> ideal_lengths, int points_per_direction);
  /// reference  kept and evaluated again by `densify`. All cells weigh the same, so that small ones keep their shape
  ///            too.
  /// InputError: a reference whose determinant is not positive.
  VolumeEnergy(const VolumeMesh& mesh, CellReference reference, int points_per_direction);

  double value(std::span<const Vec3> nodes) const override;
  double add_gradient(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient) const override;
  double linearize(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient) override;
  void multiply(std::span<const Vec3> in, std::span<Vec3> out) const override;
  void add_diagonal_blocks(const SparseMap& map, const SparseMap& map_transposed,
                           std::span<Mat3> diagonal) const override;
  double max_step(std::span<const Vec3> nodes, std::span<const Vec3> direction, double limit = 1) const override;
  std::vector<Index> uncertified(std::span<const Vec3> nodes) const override;
  void densify(std::span<const Index> cells, std::span<const Vec3> nodes = {}) override;

  /// Sets e, initially Hencky.
  /// floor  least eigenvalue of its second derivative at a point; -infinity: it may be indefinite.
  void set_distortion(Distortion distortion, double floor = kHessianFloor);
  void set_regularization(double epsilon) override;
  /// Sets w_c.
  void set_weights(std::span<const double> weights) override;
  void least_determinants(std::span<const Vec3> nodes, std::span<double> least) const override;
  std::vector<Index> not_certified(std::span<const Vec3> nodes) const override;

  /// Adds scale * dE/dx to `gradient` and scale times the positive definite Hessian (clamped, see `distortion.h`) to
  /// `hessian`, a matrix of this mesh's `pattern()`. The nodes must be feasible; otherwise it returns +infinity and
  /// leaves both arguments unspecified.
  double add_hessian(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient, BlockSparse& hessian) const;

  /// Returns a zero matrix with one block per pair of nodes that share a cell.
  BlockSparse pattern() const { return blocks_.zero_matrix(); }

 private:
  /// Cells of one kind and rule; `batches` hold kSimdLanes of them, the last one of each color padded with repeats.
  struct Group {
    ElementRule rule;
    std::vector<std::array<Index, kSimdLanes>> batches;
    std::vector<int> active;                 ///< number of cells in each batch without padding
    std::vector<std::size_t> color_offsets;  ///< first batch of each color, and the number of batches
    /// Change from the ideal to the reference shape, A_ideal A^-1, per batch and point, row by row, each entry in
    /// kSimdLanes lanes; empty: ideal cells.
    std::vector<double> to_reference;
    const double (*reference(std::size_t batch, std::size_t q) const)[kSimdLanes] {
      return reinterpret_cast<const double(*)[kSimdLanes]>(to_reference.data() +
                                                           9 * kSimdLanes * (batch * rule.num_points() + q));
    }
  };

  struct BatchState;

  template <class Kernel, class PerPoint>
  void for_points(const Group& group, std::size_t b, const BatchState& state, Kernel& kernel,
                  void (Kernel::*evaluate)(int), const PerPoint& per_point) const;
  template <class Kernel>
  double value_of(std::span<const Vec3> nodes) const;
  template <class Kernel>
  double gradient_of(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient) const;
  template <class Kernel>
  double hessian_of(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient, BlockSparse& hessian) const;
  void rebuild_groups();
  void fill_references(Group& group) const;
  void gather(const Group& group, std::size_t batch, std::span<const Vec3> nodes, double (*x)[3][kSimdLanes]) const;
  template <class PerBatch>
  double sum_batches(PerBatch&& per_batch) const;

  const VolumeMesh* mesh_;
  std::size_t num_nodes_;
  std::vector<Vec3> inverse_lengths_;
  std::vector<double> weights_;
  const DistortionKernels* kernels_ = &kernels_of(Distortion::hencky);
  double epsilon_ = 0, floor_ = kHessianFloor;
  CellReference reference_;  ///< empty: ideal cells
  std::vector<int> points_;  ///< points per direction of each cell
  std::vector<int> colors_;
  std::vector<Group> groups_;
  CellBlocks blocks_;
  BlockSparse hessian_;
};

}  // namespace subvol::internal
