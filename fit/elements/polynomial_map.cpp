// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/elements/polynomial_map.h"

#include "subvol/base/error.h"
#include "subvol/base/parallel_errors.h"
#include "subvol/fit/elements/pattern_table.h"
#include "subvol/fit/elements/quadrature.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <utility>

namespace subvol {

using namespace internal;
namespace {

/// Number of Legendre modes that represent Fourier modes up to `count` to rounding: coefficients decay faster than any
/// power beyond i pi / 2.
int series_length(Basis basis, int count) {
  return basis == Basis::legendre || count == 0 ? count
                                                : static_cast<int>(std::ceil(count * std::numbers::pi / 2)) + 24;
}

/// c(j - 1, i - 1) = (phi_i', (phi^L_j)'), j = 1 .. `series_length`.
Eigen::MatrixXd series_matrix(Basis basis, int count) {
  const int length = series_length(basis, count);
  if (basis == Basis::legendre) return Eigen::MatrixXd::Identity(length, count);
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(length, count);
  const LineRule rule = gauss_rule(length + count + 16);
  for (std::size_t q = 0; q < rule.points.size(); ++q) {
    const double x = rule.points[q], t = 1 - 2 * x;
    double legendre = t, before = 1;  // P_j, P_{j-1}
    for (int j = 1; j <= length; ++j) {
      const double slope = std::sqrt(2 * j + 1.0) * legendre * rule.weights[q];
      for (int i = 1; i <= count; ++i)
        if (mode_parity(i) == mode_parity(j))
          matrix(j - 1, i - 1) += slope * std::numbers::sqrt2 * std::cos(i * std::numbers::pi * x);
      const double next = ((2 * j + 1) * t * legendre - j * before) / (j + 1);
      before = legendre;
      legendre = next;
    }
  }
  return matrix;
}

/// Upper bounds of |phi^L_j| on [0, 1], and of |phi^L_j(x) / (1 - x)|, which is V_c,j at l_c = x.
double largest_mode(int j) { return 1 / std::sqrt(2 * j + 1.0); }
double largest_vertex_factor(int j) { return std::sqrt(2 * j + 1.0); }

int num_dimensions(EntityShape shape) {
  return shape == EntityShape::edge ? 1 : shape == EntityShape::triangle || shape == EntityShape::quad ? 2 : 3;
}

/// The lowest order of an entity that has the mode (`ModeIndex`).
int order_of_mode(EntityShape shape, const ModeIndex& m) {
  switch (shape) {
    case EntityShape::edge: return m.i + 1;
    case EntityShape::triangle: return m.i + m.j + 1;
    case EntityShape::quad: return std::max(m.i, m.j) + 1;
    case EntityShape::tet: return m.i + m.j + m.k + 1;
    case EntityShape::prism: return std::max(m.i + m.j, m.k) + 1;
    case EntityShape::hex:
    case EntityShape::pyramid: break;
  }
  return std::max({m.i, m.j, m.k}) + 1;
}

/// Upper bound of a Legendre mode's magnitude over the cells.
double largest_value(EntityShape shape, const ModeIndex& m) {
  switch (shape) {
    case EntityShape::edge: return largest_mode(m.i);
    case EntityShape::quad: return largest_mode(m.i) * largest_mode(m.j);
    case EntityShape::hex: return largest_mode(m.i) * largest_mode(m.j) * largest_mode(m.k);
    case EntityShape::triangle: return largest_mode(m.i) * largest_vertex_factor(m.j);
    case EntityShape::prism: return largest_mode(m.i) * largest_vertex_factor(m.j) * largest_mode(m.k);
    case EntityShape::tet:
    case EntityShape::pyramid: break;
  }
  return largest_mode(m.i) * largest_vertex_factor(m.j) * largest_vertex_factor(m.k);
}

/// `series_matrix` for every order up to that of a space.
class SeriesMatrices {
 public:
  explicit SeriesMatrices(const ElementSpace& space) {
    for (int order = 1; order <= space.max_order(); ++order)
      matrices_.push_back(series_matrix(space.basis(), order - 1));
  }
  const Eigen::MatrixXd& operator[](int order) const { return matrices_[static_cast<std::size_t>(order - 1)]; }

 private:
  std::vector<Eigen::MatrixXd> matrices_;
};

/// The displacement of one edge, face or cell as a series of Legendre modes.
class EntitySeries {
 public:
  /// matrix: that of the entity's order. coefficients: those of the entity's modes, in the order of `for_each_mode`.
  EntitySeries(EntityShape shape, int order, const Eigen::MatrixXd& matrix, std::span<const Vec3> coefficients)
      : shape_(shape) {
    const int count = order - 1;
    if (coefficients.empty()) return;
    length_ = static_cast<int>(matrix.rows());
    const int dimensions = num_dimensions(shape);
    std::array<int, 3> sizes{count, dimensions > 1 ? count : 1, dimensions > 2 ? count : 1};
    values_.assign(static_cast<std::size_t>(sizes[0]) * sizes[1] * sizes[2], Vec3::Zero());
    std::size_t n = 0;
    for_each_mode(shape, order, [&](const ModeIndex& m) { values_[place(sizes, m)] = coefficients[n++]; });
    for (int axis = 0; axis < dimensions; ++axis) transform(matrix, axis, sizes);
    sizes_ = sizes;
  }

  /// Writes the coefficients for an order, in the order of `for_each_mode`.
  void write(int order, std::span<Vec3> coefficients) const {
    std::size_t n = 0;
    for_each_mode(shape_, order, [&](const ModeIndex& m) {
      coefficients[n++] = std::max({m.i, m.j, m.k}) <= length_ ? values_[place(sizes_, m)] : Vec3::Zero();
    });
  }

  /// dropped[p]: upper bound of the part of the displacement that an entity of order p cannot represent, p = 1 .. 16.
  std::array<double, kMaxOrder + 1> dropped() const {
    std::array<double, kMaxOrder + 1> result{};
    if (length_ == 0) return result;
    for (int k = 1; k <= sizes_[2]; ++k)
      for (int j = 1; j <= sizes_[1]; ++j)
        for (int i = 1; i <= sizes_[0]; ++i) {
          const ModeIndex m{i, num_dimensions(shape_) > 1 ? j : 0, num_dimensions(shape_) > 2 ? k : 0};
          const double size = values_[place(sizes_, m)].norm() * largest_value(shape_, m);
          const int enough = order_of_mode(shape_, m);
          for (int p = 1; p <= kMaxOrder && p < enough; ++p) result[p] += size;
        }
    return result;
  }

 private:
  static std::size_t place(const std::array<int, 3>& sizes, const ModeIndex& m) {
    return static_cast<std::size_t>((std::max(m.k, 1) - 1) * sizes[1] + std::max(m.j, 1) - 1) * sizes[0] + m.i - 1;
  }

  /// Replaces the modes along one axis by their series.
  void transform(const Eigen::MatrixXd& matrix, int axis, std::array<int, 3>& sizes) {
    std::array<int, 3> to = sizes;
    to[axis] = length_;
    std::vector<Vec3> result(static_cast<std::size_t>(to[0]) * to[1] * to[2], Vec3::Zero());
    const int stride_from = axis == 0 ? 1 : axis == 1 ? sizes[0] : sizes[0] * sizes[1];
    const int num_inner = stride_from;
    const int num_outer = static_cast<int>(values_.size()) / (num_inner * sizes[axis]);
    for (int outer = 0; outer < num_outer; ++outer)
      for (int i = 0; i < sizes[axis]; ++i)
        for (int j = 0; j < length_; ++j) {
          const double c = matrix(j, i);
          if (c == 0) continue;
          const Vec3* from = &values_[static_cast<std::size_t>(outer * sizes[axis] + i) * num_inner];
          Vec3* into = &result[static_cast<std::size_t>(outer * length_ + j) * num_inner];
          for (int inner = 0; inner < num_inner; ++inner) into[inner] += c * from[inner];
        }
    values_ = std::move(result);
    sizes = to;
  }

  EntityShape shape_;
  int length_ = 0;
  std::array<int, 3> sizes_{};
  std::vector<Vec3> values_;
};

/// The lists of entities of a space.
enum class Which { edge, face, cell };

/// Calls visit(which, number in its list, shape, order, first node) for every edge, then face, then cell.
template <class Visit>
void for_each_entity(const ElementSpace& space, const Visit& visit) {
  const MeshTopology& topology = space.topology();
  const EntityOrders& orders = space.orders();
  for (std::size_t e = 0; e < topology.num_edges(); ++e)
    visit(Which::edge, e, EntityShape::edge, orders.edges[e], space.edge_nodes(e));
  for (std::size_t f = 0; f < topology.num_faces(); ++f)
    visit(Which::face, f, space.face_shape(f), orders.faces[f], space.face_nodes(f));
  for (std::size_t c = 0; c < topology.num_cells(); ++c)
    visit(Which::cell, c, entity_shape(space.kind(c)), orders.cells[c], space.cell_nodes(c));
}

template <class Orders>
auto& list_of(Which which, Orders& orders) {
  return which == Which::edge ? orders.edges : which == Which::face ? orders.faces : orders.cells;
}

EntityOrders entity_limits(const ElementSpace& space, const OrderLimits& limits) {
  const MeshTopology& topology = space.topology();
  EntityOrders result = EntityOrders::uniform(topology, kMaxOrder);
  for (std::size_t c = 0; c < topology.num_cells(); ++c) {
    const int limit = limits.of(space.kind(c));
    result.cells[c] = limit;
    for (const Index f : topology.cell_faces(c)) result.faces[f] = std::min(result.faces[f], limit);
    for (const Index e : topology.cell_edges(c)) result.edges[e] = std::min(result.edges[e], limit);
  }
  return result;
}

EntityOrders raised(const ElementSpace& space, const EntityOrders& limits, int raise) {
  EntityOrders result = space.orders();
  for (const Which which : {Which::edge, Which::face, Which::cell}) {
    std::vector<int>& orders = list_of(which, result);
    for (std::size_t n = 0; n < orders.size(); ++n)
      orders[n] = std::min(list_of(which, limits)[n], orders[n] > 1 ? orders[n] + raise : 1);
  }
  result.lower_interiors(space.topology());
  return result;
}

/// Bounds on the parts of the map that orders drop, entity by entity.
class DroppedParts {
 public:
  DroppedParts(const HighOrderMesh& mesh, const SeriesMatrices& matrices) : space_(mesh.space) {
    for_each_entity(space_, [&](Which which, std::size_t, EntityShape shape, int order, std::size_t first) {
      const std::size_t size = static_cast<std::size_t>(num_modes(shape, order));
      list(which).push_back(
          EntitySeries(shape, order, matrices[order], {mesh.coefficients.data() + first, size}).dropped());
    });
  }

  /// The largest sum over the entities of one cell.
  double bound(const EntityOrders& orders) const {
    const MeshTopology& topology = space_.topology();
    double largest = 0;
    for (std::size_t c = 0; c < topology.num_cells(); ++c) {
      double sum = cells_[c][orders.cells[c]];
      for (const Index f : topology.cell_faces(c)) sum += faces_[f][orders.faces[f]];
      for (const Index e : topology.cell_edges(c)) sum += edges_[e][orders.edges[e]];
      largest = std::max(largest, sum);
    }
    return largest;
  }

 private:
  using Bounds = std::vector<std::array<double, kMaxOrder + 1>>;
  Bounds& list(Which which) { return which == Which::edge ? edges_ : which == Which::face ? faces_ : cells_; }

  const ElementSpace& space_;
  Bounds edges_, faces_, cells_;
};

}  // namespace

double sampled_distance(const HighOrderMesh& x, const HighOrderMesh& y, int samples_per_direction) {
  const std::size_t num_cells = x.space.num_cells();
  bool same_kinds = num_cells == y.space.num_cells();
  for (std::size_t c = 0; same_kinds && c < num_cells; ++c) same_kinds = x.space.kind(c) == y.space.kind(c);
  if (!same_kinds) throw InputError("sampled_distance: the meshes have other cells");
  std::map<std::pair<std::size_t, std::size_t>, std::vector<Index>> groups;
  for (std::size_t c = 0; c < num_cells; ++c)
    groups[{x.space.pattern(c), y.space.pattern(c)}].push_back(static_cast<Index>(c));
  std::vector<double> largest(num_cells, 0);
  for (const auto& [patterns, members] : groups) {
    const std::vector<Index>& cells = members;  // Clang before 16 cannot use a structured binding in a parallel region
    const Quadrature rule =
        make_quadrature(x.space.pattern_kind(patterns.first), QuadratureRule::trapezoidal, samples_per_direction);
    const PatternTable of_x(x.space, patterns.first, rule.points), of_y(y.space, patterns.second, rule.points);
    ParallelErrors errors;
#pragma omp parallel
    {
      std::vector<Vec3> at_x, at_y;
      const auto sample = [&](Index c) {
        at_x.resize(rule.points.size());
        at_y.resize(rule.points.size());
        of_x.positions(x, c, at_x);
        of_y.positions(y, c, at_y);
        for (std::size_t q = 0; q < at_x.size(); ++q) {
          const double distance = (at_x[q] - at_y[q]).norm();
          if (!(distance <= largest[c])) largest[c] = distance;
        }
      };
#pragma omp for schedule(static)
      for (std::size_t i = 0; i < cells.size(); ++i) errors.guard([&] { sample(cells[i]); });
    }
    errors.rethrow();
  }
  return num_cells ? *std::max_element(largest.begin(), largest.end()) : 0;
}

double vertex_diagonal(const HighOrderMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (std::size_t v = 0; v < mesh.space.num_vertices(); ++v) box.extend(mesh.coefficients[v]);
  return box.isEmpty() ? 0 : box.diagonal().norm();
}

PolynomialMap polynomial_map(const HighOrderMesh& mesh, const OrderLimits& limits, double wanted_distance) {
  for (const int limit : {limits.tet, limits.prism, limits.hex})
    if (limit < 1 || limit > kMaxOrder)
      throw InputError("polynomial_map: a limit is " + std::to_string(limit) + ", expected an order from 1 to " +
                       std::to_string(kMaxOrder));
  if (!(wanted_distance >= 0))
    throw InputError("polynomial_map: wanted_distance is " + std::to_string(wanted_distance) + ", expected 0 or more");
  const ElementSpace& space = mesh.space;
  const EntityOrders most = entity_limits(space, limits);
  EntityOrders orders = raised(space, most, 0);
  const bool is_legendre = space.basis() == Basis::legendre;
  if (is_legendre && orders == space.orders()) return {mesh, 0};
  const SeriesMatrices matrices(space);
  const DroppedParts dropped(mesh, matrices);
  double bound = dropped.bound(orders);
  for (int raise = 1; !is_legendre && bound > wanted_distance && raise < kMaxOrder; ++raise) {
    orders = raised(space, most, raise);
    bound = dropped.bound(orders);
  }
  const VolumeMesh corners = mesh.straight_sided();
  PolynomialMap result{{ElementSpace(corners, Basis::legendre, orders), corners}, bound};
  std::vector<Vec3>& coefficients = result.mesh.coefficients;
  const ElementSpace& into = result.mesh.space;
  for_each_entity(space, [&](Which which, std::size_t n, EntityShape shape, int order, std::size_t first) {
    const std::size_t target = which == Which::edge   ? into.edge_nodes(n)
                               : which == Which::face ? into.face_nodes(n)
                                                      : into.cell_nodes(n);
    const int target_order = list_of(which, orders)[n];
    const EntitySeries series(shape, order, matrices[order],
                              {mesh.coefficients.data() + first, static_cast<std::size_t>(num_modes(shape, order))});
    series.write(target_order,
                 {coefficients.data() + target, static_cast<std::size_t>(num_modes(shape, target_order))});
  });
  return result;
}

}  // namespace subvol
