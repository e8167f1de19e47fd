// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/elements/polynomial_map.h"

#include "subvol/base/error.h"
#include "subvol/export/lagrange_cells.h"
#include "subvol/export/lagrange_mesh.h"
#include "tests/support/element_fixtures.h"

#include <catch2/catch.hpp>

#include <cmath>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

constexpr OrderLimits kNoLimits{};
constexpr double kRounding = 1e-12;

/// Modes that fall off as those of fitted surfaces do: with the cube of their number.
HighOrderMesh smooth_mesh(const ElementSpace& space, const VolumeMesh& cells, PointSource& source) {
  HighOrderMesh mesh(space, cells);
  for (std::size_t i = space.num_vertices(); i < space.num_nodes(); ++i)
    mesh.coefficients[i] = 0.05 * (source.vector() - Vec3::Constant(0.5)) /
                           std::pow(1.0 + static_cast<double>(i - space.num_vertices()) / 20, 3);
  return mesh;
}

std::vector<int> largest_orders(const HighOrderMesh& mesh) { return lagrange_orders(mesh.space, kMaxOrder); }

}  // namespace

TEST_CASE("polynomial_map: a Legendre mesh within the limits is its own polynomial map", "[elements]") {
  PointSource source(1);
  const HighOrderMesh mesh = random_mesh(ElementSpace(mixed_cells(), Basis::legendre, 5), source);
  const PolynomialMap map = polynomial_map(mesh, {5, 5, 5}, 0);
  CHECK(map.distance_bound == 0);
  CHECK(map.mesh.coefficients == mesh.coefficients);
}

TEST_CASE("polynomial_map: the bound holds, and raised orders meet the distance asked for", "[elements][slow]") {
  PointSource source(2);
  const VolumeMesh cells = renumbered(mixed_cells(), source.random());
  for (int order = 1; order <= 8; ++order)
    for (const double wanted : {1e-1, 1e-3, 1e-6}) {
      CAPTURE(order, wanted);
      const HighOrderMesh mesh = smooth_mesh(ElementSpace(cells, Basis::fourier, order), cells, source);
      const PolynomialMap map = polynomial_map(mesh, kNoLimits, wanted);
      CHECK(map.mesh.space.basis() == Basis::legendre);
      CHECK(sampled_distance(mesh, map.mesh, 2 * order + 3) <= map.distance_bound + kRounding);
      if (order <= 4) CHECK(map.distance_bound <= wanted);
      if (order == 1) CHECK(map.distance_bound == 0);
    }
}

TEST_CASE("polynomial_map: orders end at the limits, which neighbors share", "[elements]") {
  PointSource source(3);
  const VolumeMesh cells = mixed_cells();
  for (const Basis basis : kBothBases) {
    const HighOrderMesh mesh = smooth_mesh(ElementSpace(cells, basis, 6), cells, source);
    const PolynomialMap map = polynomial_map(mesh, {.tet = 5, .prism = 2, .hex = 4}, 0);
    for (std::size_t c = 0; c < map.mesh.space.num_cells(); ++c) {
      const int limit = OrderLimits{.tet = 5, .prism = 2, .hex = 4}.of(map.mesh.space.kind(c));
      CHECK(largest_orders(map.mesh)[c] <= limit);
    }
    CHECK(map.distance_bound > 0);
    CHECK(sampled_distance(mesh, map.mesh, 15) <= map.distance_bound);
  }
}

TEST_CASE("polynomial_map: refused limits and distances", "[elements]") {
  PointSource source(4);
  const HighOrderMesh mesh = random_mesh(ElementSpace(mixed_cells(), Basis::fourier, 2), source);
  CHECK_THROWS_AS(polynomial_map(mesh, {.tet = 0}, 1), InputError);
  CHECK_THROWS_AS(polynomial_map(mesh, {.hex = kMaxOrder + 1}, 1), InputError);
  CHECK_THROWS_AS(polynomial_map(mesh, {}, -1), InputError);
  CHECK_THROWS_AS(polynomial_map(mesh, {}, std::nan("")), InputError);
  CHECK_THROWS_AS(
      sampled_distance(mesh, random_mesh(ElementSpace(single_cell(CellKind::hex), Basis::fourier, 2), source), 3),
      InputError);
}

TEST_CASE("lagrange_cells: the polynomials of Lagrange cells are the Legendre cells that they sample",
          "[export][slow]") {
  PointSource source(5);
  for (const CellKind kind : kAllKinds)
    for (int order = 1; order <= 12; ++order)
      for (const NodeOrdering ordering : {NodeOrdering::vtk, NodeOrdering::gmsh}) {
        if (ordering == NodeOrdering::gmsh && (order > 6 || (kind == CellKind::prism && order > 2))) continue;
        CAPTURE(cell_topology(kind).name, order, static_cast<int>(ordering));
        const HighOrderMesh mesh =
            random_mesh(ElementSpace(renumbered(single_cell(kind), source.random()), Basis::legendre, order), source);
        const std::vector<int> orders{order};
        const LagrangeMesh cells = lagrange_mesh(mesh, orders, ordering);
        const HighOrderMesh found = polynomials_of(
            {cells.positions, cells.kinds, cells.orders, cells.cell_offsets, cells.cell_nodes, {}}, ordering);
        // Points are rounded, and interpolation on regular grids amplifies that by up to 1e5 at order 12.
        CHECK(sampled_distance(mesh, found, 2 * order + 1) < 1e-9);
      }
}

TEST_CASE("lagrange_cells: cells that are cut short are refused", "[export]") {
  const VolumeMesh hex = single_cell(CellKind::hex);
  const std::vector<int> orders{2};
  const std::vector<std::size_t> offsets{0, 8};
  CHECK_THROWS_AS(polynomials_of({hex.positions, hex.kinds, orders, offsets, hex.cell_vertices, {}}, NodeOrdering::vtk),
                  InputError);
  std::vector<Index> nodes = hex.cell_vertices;
  nodes[3] = 8;
  CHECK_THROWS_AS(polynomials_of({hex.positions, hex.kinds, {}, offsets, nodes, {}}, NodeOrdering::vtk), InputError);
  CHECK_THROWS_AS(polynomials_of({hex.positions, hex.kinds, {}, offsets, hex.cell_vertices, {}}, NodeOrdering::rows),
                  InputError);
}
