// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/bezier_cells.h"

#include "subvol/base/error.h"
#include "subvol/io/nodal_sides.h"

#include <Eigen/LU>

#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <utility>

namespace subvol::internal {

namespace {

/// Largest difference between the places that two cells give a common node, as a share of a cell's extent.
constexpr double kMostBezierNodeGap = 1e-6;

/// Exponents of the Bernstein polynomials of a simplex with up to three axes, without that of its first corner.
std::vector<LatticePoint> simplex_lattice(std::size_t num_axes, int order) {
  std::vector<LatticePoint> points;
  for (int k = 0; k <= (num_axes > 2 ? order : 0); ++k)
    for (int j = 0; j <= (num_axes > 1 ? order - k : 0); ++j)
      for (int i = 0; i + j + k <= order; ++i) points.emplace_back(i, j, k);
  return points;
}

/// Values of these polynomials (columns) at the points of the grid (rows).
Eigen::MatrixXd bernstein_values(const std::vector<LatticePoint>& lattice, int order) {
  const auto factorial = [](int n) { return std::tgamma(n + 1.0); };
  const auto size = static_cast<Eigen::Index>(lattice.size());
  Eigen::MatrixXd values(size, size);
  for (Eigen::Index a = 0; a < size; ++a) {
    const LatticePoint& exponents = lattice[static_cast<std::size_t>(a)];
    const int rest = order - exponents.sum();
    const double multinomial = std::round(factorial(order) / (factorial(rest) * factorial(exponents[0]) *
                                                              factorial(exponents[1]) * factorial(exponents[2])));
    for (Eigen::Index q = 0; q < size; ++q) {
      const LatticePoint& at = lattice[static_cast<std::size_t>(q)];
      double value = multinomial * std::pow((order - at.sum()) / static_cast<double>(order), rest);
      for (int axis = 0; axis < 3; ++axis) value *= std::pow(at[axis] / static_cast<double>(order), exponents[axis]);
      values(q, a) = value;
    }
  }
  return values;
}

/// The change between nodes and control points of one kind and order. A hex is a product of three lines and a prism
/// that of a triangle and a line: they are changed along one factor after another.
class BernsteinChange {
 public:
  BernsteinChange(CellKind kind, int order) {
    const std::vector<LatticePoint> lattice = cell_lattice(kind, order, NodeOrdering::vtk);
    for (const std::vector<int>& axes : factors_of(kind)) {
      const std::vector<LatticePoint> simplex = simplex_lattice(axes.size(), order);
      Factor& factor = factors_.emplace_back();
      factor.values = bernstein_values(simplex, order);
      factor.inverse.compute(factor.values);
      std::map<std::array<int, 3>, int> place_in_simplex;
      for (const LatticePoint& at : simplex) place_in_simplex.try_emplace(key_of(at), place_in_simplex.size());
      std::map<std::array<int, 3>, std::vector<int>> lines;  // by the coordinates of the other factors
      for (std::size_t q = 0; q < lattice.size(); ++q) {
        LatticePoint own(0, 0, 0), others = lattice[q];
        for (std::size_t i = 0; i < axes.size(); ++i) {
          own[static_cast<Eigen::Index>(i)] = lattice[q][axes[i]];
          others[axes[i]] = 0;
        }
        std::vector<int>& line = lines[key_of(others)];
        line.resize(simplex.size());
        line[static_cast<std::size_t>(place_in_simplex.at(key_of(own)))] = static_cast<int>(q);
      }
      for (auto& [key, line] : lines) factor.lines.push_back(std::move(line));
    }
  }

  /// One row for each point of the grid; changed in place.
  void to_control_points(Eigen::MatrixX3d& rows) const {
    for (const Factor& factor : factors_)
      for (const std::vector<int>& line : factor.lines)
        rows(line, Eigen::all) = Eigen::MatrixX3d(factor.inverse.solve(gather(rows, line)));
  }
  void to_nodes(Eigen::MatrixX3d& rows) const {
    for (const Factor& factor : factors_)
      for (const std::vector<int>& line : factor.lines)
        rows(line, Eigen::all) = (factor.values * gather(rows, line)).eval();
  }

 private:
  struct Factor {
    Eigen::MatrixXd values;
    Eigen::PartialPivLU<Eigen::MatrixXd> inverse;
    std::vector<std::vector<int>> lines;  ///< points of the grid that differ in the axes of this factor only
  };

  static std::vector<std::vector<int>> factors_of(CellKind kind) {
    if (kind == CellKind::tet) return {{0, 1, 2}};
    if (kind == CellKind::prism) return {{0, 1}, {2}};
    return {{0}, {1}, {2}};
  }
  static Eigen::MatrixX3d gather(const Eigen::MatrixX3d& rows, const std::vector<int>& line) {
    return rows(line, Eigen::all);
  }

  std::vector<Factor> factors_;
};

/// The changes of all kinds and orders that occur.
class BernsteinChanges {
 public:
  const BernsteinChange& get(CellKind kind, int order) {
    const auto found = changes_.find({kind, order});
    if (found != changes_.end()) return found->second;
    return changes_.try_emplace({kind, order}, kind, order).first->second;
  }

 private:
  std::map<std::pair<CellKind, int>, BernsteinChange> changes_;
};

Eigen::MatrixX3d rows_of(const std::vector<Vec3>& positions, std::span<const Index> nodes) {
  Eigen::MatrixX3d rows(static_cast<Eigen::Index>(nodes.size()), 3);
  for (std::size_t q = 0; q < nodes.size(); ++q) rows.row(static_cast<Eigen::Index>(q)) = positions[nodes[q]];
  return rows;
}

}  // namespace

void nodes_to_control_points(std::vector<Vec3>& positions, const CellNodes& cells) {
  BernsteinChanges changes;
  std::vector<Vec3> result = positions;
  std::vector<std::uint8_t> is_done(positions.size());
  for (std::size_t c = 0; c < cells.kinds.size(); ++c) {
    if (cells.orders[c] < 2) continue;
    const auto nodes = cells.cell(c);
    Eigen::MatrixX3d rows = rows_of(positions, nodes);
    changes.get(cells.kinds[c], cells.orders[c]).to_control_points(rows);
    for (std::size_t q = num_corners(cells.kinds[c]); q < nodes.size(); ++q)
      if (!std::exchange(is_done[nodes[q]], 1)) result[nodes[q]] = rows.row(static_cast<Eigen::Index>(q));
  }
  positions = std::move(result);
}

void control_points_to_nodes(NodalMesh& mesh, std::span<const std::size_t> beziers) {
  if (beziers.empty()) return;
  BernsteinChanges changes;
  std::vector<Vec3> result = mesh.positions;
  std::vector<Index> cell_of(mesh.positions.size(), kNoIndex);  // the first cell that uses a point, as no corner
  std::size_t next = 0;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const bool is_bezier = next < beziers.size() && beziers[next] == c;
    next += is_bezier;
    if (mesh.orders[c] < 2) continue;
    const auto nodes = mesh.cell(c);
    Eigen::MatrixX3d rows = rows_of(mesh.positions, nodes);
    const double extent = (rows.colwise().maxCoeff() - rows.colwise().minCoeff()).maxCoeff();
    if (is_bezier) changes.get(mesh.kinds[c], mesh.orders[c]).to_nodes(rows);
    for (std::size_t q = num_corners(mesh.kinds[c]); q < nodes.size(); ++q) {
      const Index node = nodes[q];
      const Vec3 place = rows.row(static_cast<Eigen::Index>(q));
      if (cell_of[node] == kNoIndex) {
        cell_of[node] = static_cast<Index>(c);
        result[node] = place;
      } else if (!((place - result[node]).norm() <= kMostBezierNodeGap * extent)) {
        throw InputError("cells " + std::to_string(cell_of[node]) + " and " + std::to_string(c) + " share point " +
                         std::to_string(node) + ", but not the edge or face that it lies on");
      }
    }
  }
  mesh.positions = std::move(result);
}

}  // namespace subvol::internal
