// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/fit/features/quality_caps.h"
#include "subvol/fit/tuning/quality_tuning.h"
#include "subvol/mesh/volume_mesh.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace subvol::internal {

/// Interior angles of a mesh at the edges of its boundary: the sums of the angles of the cells around each. At 360
/// degrees, the two boundary faces of an edge fold onto each other outside the mesh, and beyond they cross, however
/// good the cells are.
///
/// An angle counts as a residual max(0, angle - limit) / (360 - limit), which is 1 where the faces meet. The limit of
/// an edge is 300 degrees, or halfway from a wanted angle to 360 if that is more (`want`).
class BoundaryFolds {
 public:
  /// The cell and corner numbers of one cell at an edge. Its angle is that from the face `before`, in which the edge
  /// runs from b to a, to the face `after`.
  struct Wedge {
    Index cell;
    std::int8_t a, b;                          ///< ends of the edge
    std::array<std::int8_t, 2> before, after;  ///< the other corners of the two faces; twice the same in a triangle
  };
  /// One side of an edge: how the residual changes with the corners of a cell there.
  struct Side {
    Index cell;
    std::array<std::int8_t, 4> corners;
    std::array<Vec3, 4> derivative;  ///< of the residual
  };
  struct Residual {
    double value;  ///< >= 0; if it is 0, the sides are not set
    std::array<Side, 2> sides;
  };

  /// mesh: passes `validate` except for unused vertices. Edges of four boundary faces and more are left out.
  /// least_limit: least limit of the angles, in degrees.
  explicit BoundaryFolds(const VolumeMesh& mesh, double least_limit = QualityTuning{}.least_fold_limit);
  /// The edges of another one of which all cells are among these, with their limits. cells: ascending; a cell gets its
  /// place in this list as its number.
  BoundaryFolds(const BoundaryFolds& whole, std::span<const Index> cells);

  /// Tells the angles that some edges should have (`EdgeCap::angle`). edges: ascending by their ends; those that are
  /// not at the boundary have no effect.
  void want(std::span<const EdgeCap> edges, const VolumeMesh& mesh);

  std::size_t size() const { return limits_.size(); }
  /// The cells at the two boundary faces of an edge.
  std::array<Index, 2> cells_of(std::size_t edge) const;
  /// The angle in degrees; above 360, faces cross. mesh: its positions are not read.
  double angle(std::size_t edge, const VolumeMesh& mesh, std::span<const Vec3> nodes) const;
  double limit(std::size_t edge) const { return limits_[edge]; }
  double residual(std::size_t edge, const VolumeMesh& mesh, std::span<const Vec3> nodes) const;
  /// Returns the residuals of all edges.
  std::vector<double> residuals(const VolumeMesh& mesh, std::span<const Vec3> nodes) const;
  Residual linearized(std::size_t edge, const VolumeMesh& mesh, std::span<const Vec3> nodes) const;

 private:
  void sort_by_first_cell();
  std::span<const Wedge> wedges(std::size_t edge) const {
    return {wedges_.data() + offsets_[edge], offsets_[edge + 1] - offsets_[edge]};
  }

  double least_limit_;
  std::vector<std::size_t> offsets_{0};
  std::vector<Wedge> wedges_;  ///< of each edge: first that at one boundary face, last that at the other
  std::vector<double> limits_;
  std::vector<Index> by_first_cell_;  ///< edges, by the cell of their first wedge
};

}  // namespace subvol::internal
