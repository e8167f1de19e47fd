// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/high_order_mesh.h"

#include <Eigen/Core>

#include <span>

namespace subvol::internal {

/// The shape functions of one pattern at fixed points: one small product evaluates a cell of that pattern there.
class PatternTable {
 public:
  enum class Derivatives { none, first };

  /// points: canonical coordinates inside the cell. InputError: the pattern does not exist.
  PatternTable(const ElementSpace& space, std::size_t pattern, std::span<const Vec3> points,
               Derivatives derivatives = Derivatives::none);

  std::size_t num_points() const { return static_cast<std::size_t>(values_.rows()); }

  /// Computes the positions of a cell of this pattern at the points, or dx/du (columns are derivatives with respect to
  /// u, v, w; requires Derivatives::first): num_points() entries. The cell's pattern and the sizes are asserted. Safe
  /// to call from several threads.
  void positions(const HighOrderMesh& mesh, std::size_t c, std::span<Vec3> out) const;
  void jacobians(const HighOrderMesh& mesh, std::size_t c, std::span<Mat3> out) const;

 private:
  using Table = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Eigen::MatrixX3d gathered(const HighOrderMesh& mesh, std::size_t c) const;

  std::size_t pattern_;
  Table values_;                      // points x modes
  std::array<Table, 3> derivatives_;  // with respect to u, v, w; or empty
};

/// The cells of every pattern, ascending.
std::vector<std::vector<Index>> cells_by_pattern(const ElementSpace& space);

}  // namespace subvol::internal
