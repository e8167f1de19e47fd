// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/lagrange_cells.h"

#include "subvol/base/error.h"
#include "subvol/fit/elements/pattern_table.h"
#include "subvol/io/node_points.h"

#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <string>
#include <utility>

namespace subvol::internal {
namespace {

/// Largest difference between the curves that two cells give a common edge or face, as a share of a cell's extent: far
/// above the rounding of files of single precision (6e-8), far below what a curve is made for.
constexpr double kMostSharedCurveGap = 1e-6;

/// Maps values at the nodes of one kind and order to coefficients of the modes of a cell.
class Interpolation {
 public:
  Interpolation(const ElementSpace& space, std::size_t pattern, NodeOrdering ordering, NodeSpacing spacing)
      : order_(space.pattern_order(pattern)), is_hex_(space.pattern_kind(pattern) == CellKind::hex) {
    const CellKind kind = space.pattern_kind(pattern);
    for (const LatticePoint& at : cell_lattice(kind, order_, ordering)) lattice_.push_back(at);
    if (is_hex_) {
      factor(line_values(space.basis(), spacing));
    } else {
      ShapeFunctions shapes(kind, space.basis(), order_);
      const auto modes = space.pattern_modes(pattern);
      const std::vector<Vec3> points = node_points(kind, order_, ordering, spacing);
      Eigen::MatrixXd values(lattice_.size(), modes.size());
      for (std::size_t q = 0; q < lattice_.size(); ++q) {
        shapes.set_point(points[q]);
        for (std::size_t a = 0; a < modes.size(); ++a) values(q, a) = shapes.value(modes[a]);
      }
      factor(values);
    }
  }

  std::size_t num_nodes() const { return lattice_.size(); }

  /// values: one row per node. Returns one row per mode, without the cell's signs.
  Eigen::MatrixX3d coefficients(const Eigen::MatrixX3d& values) const {
    return is_hex_ ? of_hex(values) : Eigen::MatrixX3d(factors_.solve(values));
  }

 private:
  void factor(const Eigen::MatrixXd& values) { factors_.compute(values); }

  /// N_a at the nodes of a line.
  Eigen::MatrixXd line_values(Basis basis, NodeSpacing spacing) const {
    const int n = order_ + 1;
    Eigen::MatrixXd result(n, n);
    std::array<double, kMaxOrder + 1> values, derivatives;
    const bool is_equal = spacing == NodeSpacing::equal;
    const std::vector<double> lobatto = is_equal ? std::vector<double>{} : lobatto_points(order_);
    for (int q = 0; q < n; ++q) {
      const double at = is_equal ? static_cast<double>(q) / order_ : lobatto[static_cast<std::size_t>(q)];
      line_functions(basis, order_, at, values.data(), derivatives.data());
      for (int a = 0; a < n; ++a) result(q, a) = values[static_cast<std::size_t>(a)];
    }
    return result;
  }

  /// A hex has the modes N_i N_j N_k, i fastest: the system is solved along one axis after another.
  Eigen::MatrixX3d of_hex(const Eigen::MatrixX3d& values) const {
    const int n = order_ + 1;
    const auto place = [n](int i, int j, int k) { return (k * n + j) * n + i; };
    Eigen::MatrixX3d grid(values.rows(), 3);
    for (std::size_t q = 0; q < lattice_.size(); ++q)
      grid.row(place(lattice_[q][0], lattice_[q][1], lattice_[q][2])) = values.row(static_cast<Eigen::Index>(q));
    Eigen::MatrixX3d line(n, 3);
    const std::array<int, 3> strides{1, n, n * n};
    for (const int stride : strides)
      for (int first = 0; first < n * n * n; ++first) {
        if (first / stride % n != 0) continue;
        for (int a = 0; a < n; ++a) line.row(a) = grid.row(first + a * stride);
        line = factors_.solve(line).eval();
        for (int a = 0; a < n; ++a) grid.row(first + a * stride) = line.row(a);
      }
    return grid;
  }

  int order_;
  bool is_hex_;
  std::vector<LatticePoint> lattice_;
  Eigen::PartialPivLU<Eigen::MatrixXd> factors_;  // for a hex: along one axis
};

/// Gives every cell its own vertices, at its first nodes: these orderings list the corners first.
VolumeMesh separate_cells(const CellView& cells) {
  VolumeMesh mesh;
  std::vector<Index> corners;
  for (std::size_t c = 0; c < cells.kinds.size(); ++c) {
    const auto num_corners = static_cast<std::size_t>(cell_topology(cells.kinds[c]).num_vertices);
    if (cells.offsets[c + 1] < cells.offsets[c] + num_corners)
      throw InputError("cell " + std::to_string(c) + ": expected at least its corners");
    corners.clear();
    for (std::size_t k = 0; k < num_corners; ++k) {
      const Index node = cells.nodes[cells.offsets[c] + k];
      if (node < 0 || static_cast<std::size_t>(node) >= cells.positions.size())
        throw InputError("cell " + std::to_string(c) + ": node " + std::to_string(node) + " has no point");
      corners.push_back(static_cast<Index>(mesh.positions.size()));
      mesh.positions.push_back(cells.positions[static_cast<std::size_t>(node)]);
    }
    mesh.add_cell(cells.kinds[c], corners);
  }
  return mesh;
}

EntityOrders orders_of_cells(const MeshTopology& topology, const CellView& cells) {
  EntityOrders result = EntityOrders::uniform(topology, 1);
  for (std::size_t c = 0; c < cells.num_cells(); ++c) {
    const int order = cells.order(c);
    if (order < 1 || order > kMaxOrder)
      throw InputError("cell " + std::to_string(c) + ": the order is " + std::to_string(order) + ", expected 1 to " +
                       std::to_string(kMaxOrder));
    result.cells[c] = order;
    for (const Index f : topology.cell_faces(c)) result.faces[f] = order;
    for (const Index e : topology.cell_edges(c)) result.edges[e] = order;
  }
  return result;
}

/// Calls visit(cell, its nodes' coefficients: one row per mode, without signs) for every cell.
template <class Visit>
void interpolate(const CellView& cells, NodeOrdering ordering, NodeSpacing spacing, const ElementSpace& space,
                 const Visit& visit) {
  const auto by_pattern = cells_by_pattern(space);
  for (std::size_t pattern = 0; pattern < by_pattern.size(); ++pattern) {
    if (by_pattern[pattern].empty()) continue;
    const Interpolation interpolation(space, pattern, ordering, spacing);
    const auto num_nodes = interpolation.num_nodes();
    Eigen::MatrixX3d values(num_nodes, 3);
    for (const Index c : by_pattern[pattern]) {
      const auto nodes = cells.cell(static_cast<std::size_t>(c));
      if (nodes.size() != num_nodes)
        throw InputError("cell " + std::to_string(c) + ": expected " + std::to_string(num_nodes) +
                         " nodes for its kind and order, found " + std::to_string(nodes.size()));
      for (std::size_t q = 0; q < num_nodes; ++q) {
        if (nodes[q] < 0 || static_cast<std::size_t>(nodes[q]) >= cells.positions.size())
          throw InputError("cell " + std::to_string(c) + ": node " + std::to_string(nodes[q]) + " has no point");
        values.row(static_cast<Eigen::Index>(q)) = cells.positions[static_cast<std::size_t>(nodes[q])];
      }
      visit(static_cast<std::size_t>(c), interpolation.coefficients(values));
    }
  }
}

/// Largest extent of a cell's nodes.
double extent(const CellView& cells, std::size_t c) {
  Vec3 low = cells.positions[cells.cell(c).front()], high = low;
  for (const Index node : cells.cell(c)) {
    low = low.cwiseMin(cells.positions[node]);
    high = high.cwiseMax(cells.positions[node]);
  }
  return (high - low).maxCoeff();
}

}  // namespace

HighOrderMesh polynomials_of(const CellView& cells, NodeOrdering ordering, NodeSpacing spacing) {
  if (ordering == NodeOrdering::rows) throw InputError("polynomials_of: expected cells whose corners come first");
  const VolumeMesh corners = separate_cells(cells);
  HighOrderMesh mesh(ElementSpace(corners, Basis::legendre, orders_of_cells(MeshTopology(corners), cells)), corners);
  const ElementSpace& space = mesh.space;
  interpolate(cells, ordering, spacing, space, [&](std::size_t c, const Eigen::MatrixX3d& found) {
    const auto into = space.nodes(c);
    const auto signs = space.signs(c);
    for (std::size_t a = 0; a < into.size(); ++a)
      if (static_cast<std::size_t>(into[a]) >= space.num_vertices())
        mesh.coefficients[into[a]] = signs[a] * found.row(static_cast<Eigen::Index>(a)).transpose();
  });
  return mesh;
}

HighOrderMesh joined_polynomials(const CellView& cells, const VolumeMesh& corners, int order, NodeOrdering ordering,
                                 NodeSpacing spacing) {
  HighOrderMesh mesh(ElementSpace(corners, Basis::legendre, order), corners);
  const ElementSpace& space = mesh.space;
  std::vector<Index> cell_of(space.num_nodes(), kNoIndex);  // the first cell that has told a coefficient
  interpolate(cells, ordering, spacing, space, [&](std::size_t c, const Eigen::MatrixX3d& found) {
    const auto into = space.nodes(c);
    const auto signs = space.signs(c);
    const double most = kMostSharedCurveGap * extent(cells, c);
    for (std::size_t a = 0; a < into.size(); ++a) {
      const Index node = into[a];
      if (static_cast<std::size_t>(node) < space.num_vertices()) continue;
      const Vec3 value = signs[a] * found.row(static_cast<Eigen::Index>(a)).transpose();
      if (cell_of[node] == kNoIndex) {
        mesh.coefficients[node] = value;
        cell_of[node] = static_cast<Index>(c);
      } else if (!((value - mesh.coefficients[node]).norm() <= most)) {
        throw InputError("cells " + std::to_string(cell_of[node]) + " and " + std::to_string(c) +
                         " have the same corners on an edge or face, but curve it differently: expected cells without "
                         "gaps between them");
      }
    }
  });
  return mesh;
}

}  // namespace subvol::internal
