// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/subdivision/sparse_map.h"

#include <span>
#include <vector>

namespace subvol {

/// The distortion E_W of the cells of a finite element mesh, as a function of its nodes y. Paper: Eqs. 2, 3, 7.
///
/// Dimensionless, >= 0, +infinity where a determinant is not positive at a quadrature point; never NaN for finite
/// nodes.
class VolumeTerm {
 public:
  virtual ~VolumeTerm() = default;

  virtual double value(std::span<const Vec3> nodes) const = 0;

  /// Adds scale * dE/dy to `gradient`; returns the value. Infeasible: nothing is added.
  virtual double add_gradient(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient) const = 0;

  /// The same, and keeps scale times a positive definite approximation H of the second derivative for the two functions
  /// below. The nodes must be feasible (else +infinity is returned and nothing may be made of the rest).
  virtual double linearize(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient) = 0;
  /// out = H in.
  virtual void multiply(std::span<const Vec3> in, std::span<Vec3> out) const = 0;
  /// Adds the 3x3 diagonal blocks of M^T H M, or of an approximation that serves as preconditioner.
  virtual void add_diagonal_blocks(const SparseMap& map, const SparseMap& map_transposed,
                                   std::span<Mat3> diagonal) const = 0;

  /// The largest t in (0, limit] of a geometric sequence so that every determinant keeps at least a tenth of its value
  /// on the way from y to y + t d at the quadrature points. The nodes must be feasible.
  virtual double max_step(std::span<const Vec3> nodes, std::span<const Vec3> direction, double limit = 1) const = 0;

  /// Makes H stiffer where the way from y to y + t d would be too long for `max_step`, so that the next direction
  /// leaves those points nearly as they are and the rest may move on. False where nothing was changed, or cannot be.
  virtual bool stiffen(std::span<const Vec3> /*nodes*/, std::span<const Vec3> /*direction*/, double /*t*/) {
    return false;
  }

  /// The same for all points of these cells (ascending), with which a step would not be certified.
  virtual bool stiffen(std::span<const Index> /*cells*/) { return false; }

  /// Cells that are not proved to be nowhere inverted, ascending.
  virtual std::vector<Index> uncertified(std::span<const Vec3> nodes) const = 0;
  /// Whether a step that was cut back until all cells are certified again is to be half of that.
  virtual bool keeps_off_inversion() const { return false; }
  /// Gives these cells more quadrature points from now on, for they invert between those they have. Points may weigh
  /// otherwise from then on, by the shape of the cells at these nodes.
  /// InputError: there is no such cell.
  virtual void densify(std::span<const Index> cells, std::span<const Vec3> nodes) = 0;
};

}  // namespace subvol
