// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/subdivision/sparse_map.h"

#include <span>
#include <vector>

namespace subvol::internal {

/// An energy of the shapes of the cells of a finite element mesh, as a function of its nodes y: their distortion E_W
/// (paper: Eqs. 2, 3, 7), or what raises their scaled Jacobians (`QualityEnergy`).
///
/// Dimensionless, >= 0; never NaN for finite nodes. Nodes at which it is +infinity are infeasible: for distortions,
/// those at which a determinant is not positive at a quadrature point.
class VolumeTerm {
 public:
  virtual ~VolumeTerm() = default;

  virtual double value(std::span<const Vec3> nodes) const = 0;

  /// Adds scale * dE/dy to `gradient` and returns the value. If the nodes are infeasible, nothing is added.
  virtual double add_gradient(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient) const = 0;

  /// Like `add_gradient`, and keeps scale times a positive definite approximation H of the second derivative for the
  /// two functions below. The nodes must be feasible; otherwise it returns +infinity and leaves gradient and H
  /// unspecified.
  virtual double linearize(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient) = 0;
  /// out = H in.
  virtual void multiply(std::span<const Vec3> in, std::span<Vec3> out) const = 0;
  /// Adds the 3x3 diagonal blocks of M^T H M, or an approximation that serves as a preconditioner.
  virtual void add_diagonal_blocks(const SparseMap& map, const SparseMap& map_transposed,
                                   std::span<Mat3> diagonal) const = 0;

  /// Returns the largest t in (0, limit] of a geometric sequence such that the nodes stay feasible on the way from y to
  /// y + t d, from feasible ones: of distortions, every determinant at the quadrature points keeps at least a tenth of
  /// its value. Terms that are finite everywhere return the limit.
  virtual double max_step(std::span<const Vec3> nodes, std::span<const Vec3> direction, double limit = 1) const = 0;

  /// Makes H stiffer at the points that do not admit the step from y to y + t d (see `max_step`), so that the next
  /// direction leaves these points nearly as they are and the rest may move on. Returns false if nothing was changed.
  virtual bool stiffen(std::span<const Vec3> /*nodes*/, std::span<const Vec3> /*direction*/, double /*t*/) {
    return false;
  }

  /// Makes H stiffer at all points of these cells (ascending), which a step would leave uncertified. Returns false if
  /// nothing was changed.
  virtual bool stiffen(std::span<const Index> /*cells*/) { return false; }

  /// Returns the cells that are not certified, i.e. not proved to have det J > 0 everywhere, ascending.
  virtual std::vector<Index> uncertified(std::span<const Vec3> nodes) const = 0;
  /// Returns the energy of each cell, whose sum is `value`. Only for terms that the Levenberg-Marquardt method
  /// minimizes.
  virtual std::vector<double> cell_values(std::span<const Vec3> nodes) const { return {value(nodes)}; }
  /// Returns the cells that a step from one state to another ruins, ascending, so that it must be shortened at their
  /// vertices. None for terms that limit steps by `max_step`.
  virtual std::vector<Index> ruined(std::span<const Vec3> /*before*/, std::span<const Vec3> /*after*/) const {
    return {};
  }
  /// Returns the nodes of these cells, possibly with repetitions. Needed by minimizers that shorten steps there.
  virtual std::vector<Index> nodes_of(std::span<const Index> /*cells*/) const { return {}; }
  /// If true, a step that had to be shortened to keep all cells certified is halved once more.
  virtual bool keeps_off_inversion() const { return false; }
  /// Refines the quadrature of these cells, because they are inverted between their points. From then on the weights of
  /// points may depend on the shape of the cells at these nodes.
  /// InputError: there is no such cell.
  virtual void densify(std::span<const Index> cells, std::span<const Vec3> nodes) = 0;
};

/// A volume term that can also be minimized from inverted cells. With a regularization epsilon > 0 its density is that
/// of `regularized_barrier.h`, which is finite everywhere, so that minimizing it untangles the cells. Steps are then
/// not limited, and `uncertified` returns nothing.
class RegularizedTerm : public VolumeTerm {
 public:
  /// epsilon  0 (initially): the distortion's own barrier; > 0: the regularized one. InputError: negative or not
  ///          finite.
  virtual void set_regularization(double epsilon) = 0;
  /// Sets the weights of the cells; only ratios matter. InputError: another number of weights, or a weight that is not
  /// positive and finite.
  virtual void set_weights(std::span<const double> weights) = 0;
  /// Writes the least determinant at each cell's quadrature points to `least`, which must have one entry per cell (else
  /// InputError).
  virtual void least_determinants(std::span<const Vec3> nodes, std::span<double> least) const = 0;
  /// Returns the cells that are not certified, ascending, with and without a regularization.
  virtual std::vector<Index> not_certified(std::span<const Vec3> nodes) const = 0;
};

}  // namespace subvol::internal
