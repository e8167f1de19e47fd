// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/elements/map_projection.h"

#include "subvol/base/error.h"
#include "subvol/fit/elements/quadrature.h"

#include <Eigen/QR>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>

namespace subvol::internal {

namespace {

/// Least squares on a simplex, weighted by quadrature: `solver` maps the values at `points`, times `root_weights`, to
/// the coefficients of the modes.
struct SimplexFit {
  std::vector<Vec3> points;
  Eigen::VectorXd root_weights;
  Eigen::HouseholderQR<Eigen::MatrixXd> solver;  // keeps residuals small if the modes are nearly dependent

  Eigen::Index num_modes() const { return solver.cols(); }
};

/// Modes for dimension 1: phi_i; 2: E_01,i V_2,j; 3: the modes of a tet.
SimplexFit make_simplex_fit(Basis basis, int dimension, int order) {
  Quadrature rule;
  const int n = order + 2;
  if (dimension == 1) {
    const LineRule line = gauss_rule(n);
    for (const double x : line.points) rule.points.push_back(Vec3(x, 0, 0));
    rule.weights = line.weights;
  } else {
    rule = dimension == 2 ? make_triangle_quadrature(QuadratureRule::gauss_lobatto, n)
                          : make_quadrature(CellKind::tet, QuadratureRule::gauss_lobatto, n);
  }
  const EntityShape shape = std::array{EntityShape::edge, EntityShape::triangle, EntityShape::tet}[dimension - 1];
  const CellKind kind = std::array{CellKind::hex, CellKind::prism, CellKind::tet}[dimension - 1];
  ShapeFunctions functions(kind, basis, order);
  const auto num_points = static_cast<Eigen::Index>(rule.points.size());
  const Eigen::Index count = num_modes(shape, order);
  Eigen::MatrixXd values(num_points, count);
  const Eigen::VectorXd root = Eigen::Map<const Eigen::VectorXd>(rule.weights.data(), num_points).cwiseSqrt();
  for (Eigen::Index q = 0; q < num_points; ++q) {
    functions.set_point(rule.points[q]);
    Eigen::Index column = 0;
    for_each_mode(shape, order, [&](ModeIndex m) {
      const LocalMode mode = dimension == 1   ? edge_mode(kind, 0, 1, m.i).mode
                             : dimension == 2 ? triangle_mode(kind, 0, 1, 2, m.i, m.j).mode
                                              : cell_mode(kind, m);
      values(q, column++) = root[q] * functions.value(mode);
    });
  }
  return {std::move(rule.points), root, Eigen::HouseholderQR<Eigen::MatrixXd>(values)};
}

/// Fits the coefficients of one entity after another.
class Projector {
 public:
  Projector(const ElementSpace& space, const std::function<Vec3(std::size_t, const Vec3&)>& map)
      : mesh_(space, std::vector<Vec3>(space.num_nodes(), Vec3::Zero())), map_(map) {}

  HighOrderMesh run() {
    const ElementSpace& space = mesh_.space;
    const std::size_t num_cells = space.num_cells();
    for (std::size_t c = 0; c < num_cells; ++c) {
      const auto vertices = space.vertices(c);
      for (std::size_t v = 0; v < vertices.size(); ++v)
        mesh_.coefficients[vertices[v]] = asked(c, canonical_vertices(space.kind(c))[v]);
    }
    std::vector<char> done(space.topology().num_edges(), 0);
    for (std::size_t c = 0; c < num_cells; ++c)
      for (const Index e : space.topology().cell_edges(c))
        if (!done[e]) done[e] = 1, fit_edge(c, e);
    for (std::size_t f = 0; f < space.topology().num_faces(); ++f) fit_face(f);
    for (std::size_t c = 0; c < num_cells; ++c)
      fit(entity_shape(space.kind(c)), space.orders().cells[c], space.cell_nodes(c), c, Vec3::Zero(), Mat3::Identity());
    return std::move(mesh_);
  }

 private:
  Vec3 asked(std::size_t c, const Vec3& point) const {
    Vec3 x = map_(c, point);
    if (!x.allFinite()) throw InputError("project_map: the map is not finite at a point of cell " + std::to_string(c));
    return x;
  }

  const Vec3& corner(std::size_t c, Index vertex) const {
    const auto vertices = mesh_.space.vertices(c);
    return canonical_vertices(
        mesh_.space.kind(c))[std::find(vertices.begin(), vertices.end(), vertex) - vertices.begin()];
  }

  void fit_edge(std::size_t c, Index e) {
    const auto& [a, b] = mesh_.space.topology().edge(e);
    Mat3 axes = Mat3::Zero();
    axes.col(0) = corner(c, b) - corner(c, a);
    fit(EntityShape::edge, mesh_.space.orders().edges[e], mesh_.space.edge_nodes(e), c, corner(c, a), axes);
  }

  void fit_face(std::size_t f) {
    const std::size_t c = mesh_.space.topology().face_cells(static_cast<Index>(f))[0];
    const auto& frame = mesh_.space.face_frame(f);
    const EntityShape shape = mesh_.space.face_shape(f);
    Mat3 axes = Mat3::Zero();
    axes.col(0) = corner(c, frame[1]) - corner(c, frame[0]);
    axes.col(1) = corner(c, frame[shape == EntityShape::triangle ? 2 : 3]) - corner(c, frame[0]);
    fit(shape, mesh_.space.orders().faces[f], mesh_.space.face_nodes(f), c, corner(c, frame[0]), axes);
  }

  /// Fits one entity as a product of simplices; its frame (origin, axes) is in the coordinates of a cell.
  void fit(EntityShape shape, int order, std::size_t first_node, std::size_t c, const Vec3& origin, const Mat3& axes) {
    if (num_modes(shape, order) == 0) return;
    std::vector<int> dimensions;
    switch (shape) {
      case EntityShape::edge: dimensions = {1}; break;
      case EntityShape::triangle: dimensions = {2}; break;
      case EntityShape::quad: dimensions = {1, 1}; break;
      case EntityShape::tet: dimensions = {3}; break;
      case EntityShape::prism: dimensions = {2, 1}; break;
      case EntityShape::hex: dimensions = {1, 1, 1}; break;
      case EntityShape::pyramid: return;  // it has no modes
    }
    std::vector<Vec3> points = {Vec3::Zero()};  // the first simplex varies fastest
    int axis = 0;
    for (const int dimension : dimensions) {
      std::vector<Vec3> longer;
      for (const Vec3& p : simplex(dimension, order).points)
        for (const Vec3& rest : points) {
          longer.push_back(rest);
          for (int d = 0; d < dimension; ++d) longer.back()[axis + d] = p[d];
        }
      points = std::move(longer);
      axis += dimension;
    }
    std::vector<Vec3> values;
    for (const Vec3& p : points) {
      const Vec3 at = origin + axes * p;
      values.push_back(asked(c, at) - mesh_.position(c, at));
    }
    std::size_t inner = 1;
    for (const int dimension : dimensions) {
      values = solved(simplex(dimension, order), values, inner);
      inner *= static_cast<std::size_t>(simplex(dimension, order).num_modes());
    }
    std::copy(values.begin(), values.end(), mesh_.coefficients.begin() + static_cast<std::ptrdiff_t>(first_node));
  }

  /// Solves along one simplex: values (outer, points, inner) -> (outer, modes, inner).
  static std::vector<Vec3> solved(const SimplexFit& simplex, const std::vector<Vec3>& values, std::size_t inner) {
    const std::size_t num_points = simplex.points.size(), num_modes = static_cast<std::size_t>(simplex.num_modes());
    const std::size_t outer = values.size() / (num_points * inner);
    std::vector<Vec3> result(outer * num_modes * inner);
    Eigen::MatrixXd right(num_points, 3 * inner);
    for (std::size_t o = 0; o < outer; ++o) {
      for (std::size_t q = 0; q < num_points; ++q)
        for (std::size_t i = 0; i < inner; ++i)
          right.block<1, 3>(q, 3 * i) = simplex.root_weights[q] * values[(o * num_points + q) * inner + i].transpose();
      const Eigen::MatrixXd solution = simplex.solver.solve(right);
      for (std::size_t m = 0; m < num_modes; ++m)
        for (std::size_t i = 0; i < inner; ++i)
          result[(o * num_modes + m) * inner + i] = solution.block<1, 3>(m, 3 * i).transpose();
    }
    return result;
  }

  const SimplexFit& simplex(int dimension, int order) {
    const auto [at, added] = fits_.try_emplace({dimension, order});
    if (added) at->second = make_simplex_fit(mesh_.space.basis(), dimension, order);
    return at->second;
  }

  HighOrderMesh mesh_;
  const std::function<Vec3(std::size_t, const Vec3&)>& map_;
  std::map<std::pair<int, int>, SimplexFit> fits_;
};

}  // namespace

HighOrderMesh project_map(const ElementSpace& space, const std::function<Vec3(std::size_t, const Vec3&)>& map) {
  return Projector(space, map).run();
}

}  // namespace subvol::internal
