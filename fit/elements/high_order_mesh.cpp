// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/elements/high_order_mesh.h"

#include "subvol/base/error.h"
#include "subvol/subdivision/row_assembly.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace subvol {

using namespace internal;

namespace {

/// Value of a mode that counts as 0, and how far outside the cell canonical coordinates may be.
constexpr double kZeroWeight = 1e-15, kOutsideTolerance = 1e-9;

bool is_inside(CellKind kind, const Vec3& p) {
  const auto within = [](double x) { return x >= -kOutsideTolerance && x <= 1 + kOutsideTolerance; };  // false for NaN
  if (!within(p[0]) || !within(p[1]) || !within(p[2])) return false;
  if (kind == CellKind::tet) return within(p[0] + p[1] + p[2]);
  if (kind == CellKind::pyramid) return within(p[0] + p[2]) && within(p[1] + p[2]);
  return kind == CellKind::hex || within(p[0] + p[1]);
}

}  // namespace

HighOrderMesh::HighOrderMesh(ElementSpace s, std::vector<Vec3> c) : space(std::move(s)), coefficients(std::move(c)) {
  if (coefficients.size() != space.num_nodes())
    throw InputError("HighOrderMesh: " + std::to_string(coefficients.size()) + " coefficients for " +
                     std::to_string(space.num_nodes()) + " nodes");
}

HighOrderMesh::HighOrderMesh(ElementSpace s, const VolumeMesh& mesh)
    : space(std::move(s)), coefficients(space.num_nodes(), Vec3::Zero()) {
  if (mesh.num_vertices() != space.num_vertices())
    throw InputError("HighOrderMesh: a mesh of " + std::to_string(mesh.num_vertices()) + " vertices for a space of " +
                     std::to_string(space.num_vertices()));
  std::copy(mesh.positions.begin(), mesh.positions.end(), coefficients.begin());
}

Vec3 HighOrderMesh::position(std::size_t c, const Vec3& point) const {
  ShapeFunctions shapes(space.kind(c), space.basis(), space.pattern_order(space.pattern(c)));
  shapes.set_point(point);
  const auto modes = space.modes(c);
  const auto nodes = space.nodes(c);
  const auto signs = space.signs(c);
  Vec3 sum = Vec3::Zero();
  for (std::size_t a = 0; a < modes.size(); ++a) sum += signs[a] * shapes.value(modes[a]) * coefficients[nodes[a]];
  return sum;
}

Mat3 HighOrderMesh::jacobian(std::size_t c, const Vec3& point) const {
  ShapeFunctions shapes(space.kind(c), space.basis(), space.pattern_order(space.pattern(c)));
  shapes.set_point(point);
  const auto modes = space.modes(c);
  const auto nodes = space.nodes(c);
  const auto signs = space.signs(c);
  Mat3 sum = Mat3::Zero();
  Vec3 gradient;
  for (std::size_t a = 0; a < modes.size(); ++a) {
    shapes.value(modes[a], gradient);
    sum += signs[a] * coefficients[nodes[a]] * gradient.transpose();
  }
  return sum;
}

HighOrderMesh HighOrderMesh::with_orders(const EntityOrders& orders) const {
  ElementSpace to = space.with_orders(orders);
  const std::vector<Index> numbers = node_numbers_in(to, space);
  std::vector<Vec3> moved(to.num_nodes(), Vec3::Zero());
  for (std::size_t node = 0; node < numbers.size(); ++node)
    if (numbers[node] != kNoIndex) moved[numbers[node]] = coefficients[node];
  return {std::move(to), std::move(moved)};
}

VolumeMesh HighOrderMesh::straight_sided() const {
  VolumeMesh mesh;
  mesh.positions.assign(coefficients.begin(), coefficients.begin() + static_cast<std::ptrdiff_t>(space.num_vertices()));
  for (std::size_t c = 0; c < space.num_cells(); ++c) mesh.add_cell(space.kind(c), space.vertices(c));
  return mesh;
}

std::vector<Vec3> internal::moved(std::vector<Vec3> coefficients, std::size_t num_vertices, double scale,
                                  const Vec3& shift) {
  for (std::size_t i = 0; i < coefficients.size(); ++i)
    coefficients[i] = scale * coefficients[i] + (i < num_vertices ? shift : Vec3(0, 0, 0));
  return coefficients;
}

void require_inside(const char* function, const ElementSpace& space, std::span<const CellPoint> points) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto& [c, point] = points[i];
    if (c < 0 || static_cast<std::size_t>(c) >= space.num_cells() || !is_inside(space.kind(c), point))
      throw InputError(std::string(function) + ": point " + std::to_string(i) +
                       " does not lie in a cell of the mesh (cell " + std::to_string(c) + ')');
  }
}

SparseMap point_map(const ElementSpace& space, std::span<const CellPoint> points) {
  require_inside("point_map", space, points);
  return assemble_rows(points.size(), space.num_nodes(), [&](std::size_t i, RowBuilder& row) {
    const std::size_t c = points[i].cell;
    ShapeFunctions at(space.kind(c), space.basis(), space.pattern_order(space.pattern(c)));
    at.set_point(points[i].point);
    const auto modes = space.modes(c);
    const auto nodes = space.nodes(c);
    const auto signs = space.signs(c);
    for (std::size_t a = 0; a < modes.size(); ++a) {
      const double weight = signs[a] * at.value(modes[a]);
      if (std::abs(weight) > kZeroWeight) row.add(nodes[a], weight);
    }
  });
}

}  // namespace subvol
