// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/elements/pattern_table.h"

#include "subvol/base/error.h"
#include "subvol/base/parallel_errors.h"

#include <cassert>
#include <optional>

namespace subvol::internal {

PatternTable::PatternTable(const ElementSpace& space, std::size_t pattern, std::span<const Vec3> points,
                           Derivatives derivatives)
    : pattern_(pattern) {
  if (pattern >= space.num_patterns())
    throw InputError("PatternTable: pattern " + std::to_string(pattern) + " of " +
                     std::to_string(space.num_patterns()));
  const auto modes = space.pattern_modes(pattern);
  const auto rows = static_cast<Eigen::Index>(points.size()), cols = static_cast<Eigen::Index>(modes.size());
  values_.resize(rows, cols);
  const bool with_derivatives = derivatives == Derivatives::first;
  if (with_derivatives)
    for (Table& table : derivatives_) table.resize(rows, cols);
  const auto tabulate = [&](Eigen::Index q, ShapeFunctions& shapes) {
    shapes.set_point(points[static_cast<std::size_t>(q)]);
    Vec3 gradient;
    for (Eigen::Index a = 0; a < cols; ++a) {
      values_(q, a) = shapes.value(modes[static_cast<std::size_t>(a)], gradient);
      if (with_derivatives)
        for (int d = 0; d < 3; ++d) derivatives_[d](q, a) = gradient[d];
    }
  };
  ParallelErrors errors;
#pragma omp parallel
  {
    std::optional<ShapeFunctions> shapes;
    errors.guard([&] { shapes.emplace(space.pattern_kind(pattern), space.basis(), space.pattern_order(pattern)); });
#pragma omp for schedule(static)
    for (Eigen::Index q = 0; q < rows; ++q) errors.guard([&] { tabulate(q, *shapes); });
  }
  errors.rethrow();
}

Eigen::MatrixX3d PatternTable::gathered(const HighOrderMesh& mesh, std::size_t c) const {
  assert(mesh.space.pattern(c) == pattern_);
  const auto nodes = mesh.space.nodes(c);
  const auto signs = mesh.space.signs(c);
  Eigen::MatrixX3d result(nodes.size(), 3);
  for (std::size_t a = 0; a < nodes.size(); ++a)
    result.row(static_cast<Eigen::Index>(a)) = signs[a] * mesh.coefficients[nodes[a]].transpose();
  return result;
}

// Lazy products compute every entry as a sum in one order, whatever the number of threads.
void PatternTable::positions(const HighOrderMesh& mesh, std::size_t c, std::span<Vec3> out) const {
  assert(out.size() == num_points());
  Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>> x(out.data()->data(), values_.rows(), 3);
  x.noalias() = values_.lazyProduct(gathered(mesh, c));
}

void PatternTable::jacobians(const HighOrderMesh& mesh, std::size_t c, std::span<Mat3> out) const {
  assert(out.size() == num_points() && derivatives_[0].rows() == values_.rows());
  const Eigen::MatrixX3d coefficients = gathered(mesh, c);
  for (int d = 0; d < 3; ++d) {
    const Eigen::MatrixX3d column = derivatives_[d].lazyProduct(coefficients);
    for (std::size_t q = 0; q < out.size(); ++q) out[q].col(d) = column.row(static_cast<Eigen::Index>(q)).transpose();
  }
}

std::vector<std::vector<Index>> cells_by_pattern(const ElementSpace& space) {
  std::vector<std::vector<Index>> cells(space.num_patterns());
  for (std::size_t c = 0; c < space.num_cells(); ++c) cells[space.pattern(c)].push_back(static_cast<Index>(c));
  return cells;
}

}  // namespace subvol::internal
