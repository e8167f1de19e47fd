// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/elements/point_tables.h"
#include "subvol/base/error.h"
#include "subvol/fit/elements/boundary_samples.h"
#include "tests/support/element_fixtures.h"
#include "tests/support/threads.h"

#include <catch2/catch.hpp>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

EntityOrders mixed_orders(const VolumeMesh& mesh, std::mt19937& random) {
  const MeshTopology topology(mesh);
  EntityOrders orders = EntityOrders::uniform(topology, 1);
  std::uniform_int_distribution<int> uniform(1, 6);
  for (auto* list : {&orders.edges, &orders.faces, &orders.cells})
    for (int& order : *list) order = uniform(random);
  orders.raise_borders(topology);
  return orders;
}

std::vector<Vec3> vectors(std::size_t n, PointSource& source) {
  std::vector<Vec3> result(n);
  for (Vec3& x : result) x = source.vector() - Vec3::Constant(0.5);
  return result;
}

double inner(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].dot(b[i]);
  return sum;
}

/// The largest difference of any weight, column by column.
double difference_of_weights(const PointTables& tables, const SparseMap& map) {
  double largest = 0;
  std::vector<Vec3> unit(map.num_cols, Vec3::Zero()), by_tables(map.num_rows()), by_map(map.num_rows());
  for (std::size_t j = 0; j < map.num_cols; ++j) {
    unit[j] = Vec3(1, -2, 4);
    tables.apply(unit, by_tables);
    map.apply(unit, by_map);
    for (std::size_t i = 0; i < map.num_rows(); ++i)
      largest = std::max(largest, (by_tables[i] - by_map[i]).cwiseAbs().maxCoeff());
    unit[j] = Vec3::Zero();
  }
  return largest / 4;
}

void compare(const ElementSpace& space, std::span<const CellPoint> points, PointSource& source) {
  const PointTables tables(space, points);
  const SparseMap map = point_map(space, points);
  REQUIRE(tables.num_rows() == points.size());
  REQUIRE(tables.num_cols() == space.num_nodes());
  CHECK(difference_of_weights(tables, map) < 1e-14);

  const std::vector<Vec3> x = vectors(map.num_cols, source), g = vectors(map.num_rows(), source);
  std::vector<Vec3> wx(g.size()), wg(x.size(), Vec3::Constant(7)), expected(x.size());
  tables.apply(x, wx);
  tables.apply_transposed(g, wg);
  CHECK(std::abs(inner(wx, g) - inner(x, wg)) <= 1e-13 * std::sqrt(inner(wx, wx) * inner(g, g)));
  transposed(map).apply(g, expected);
  for (std::size_t j = 0; j < x.size(); ++j) REQUIRE((wg[j] - expected[j]).norm() < 1e-12);
}

}  // namespace

TEST_CASE("tables of points are the map to them", "[elements]") {
  PointSource source(51);
  for (const Basis basis : kBothBases)
    for (const VolumeMesh& plain :
         {single_cell(CellKind::tet), single_cell(CellKind::prism), lattice(2, 2, 1), mixed_cells()}) {
      const VolumeMesh mesh = renumbered(plain, source.random());
      for (const int intervals : {1, 5, 12}) {
        const ElementSpace uniform(mesh, basis, 5), mixed(mesh, basis, mixed_orders(mesh, source.random()));
        compare(uniform, make_boundary_samples(uniform, intervals).points, source);
        compare(mixed, make_boundary_samples(mixed, intervals).points, source);
      }
    }
}

TEST_CASE("tables take points anywhere, and many of one face", "[elements]") {
  PointSource source(52);
  const ElementSpace space(mixed_cells(), Basis::legendre, 4);
  std::vector<CellPoint> points;
  for (int round = 0; round < 3; ++round)
    for (Index c = 0; c < static_cast<Index>(space.num_cells()); ++c) {
      for (int i = 0; i < 30; ++i) points.push_back({c, source.inside(space.kind(c))});
      for (const Vec3& corner : canonical_vertices(space.kind(c))) points.push_back({c, corner});
    }
  compare(space, points, source);
  compare(space, {}, source);
  const ElementSpace cube(single_cell(CellKind::hex), Basis::fourier, 3);
  compare(cube, make_boundary_samples(cube, 24).points, source);  // more points than a block has
}

TEST_CASE("faces that are sampled alike have one table", "[elements]") {
  const ElementSpace space(lattice(4, 4, 4), Basis::legendre, 3);
  const PointTables tables(space, make_boundary_samples(space, 6).points);
  // Faces of a hex start at one of four corners, its edges run one of two ways.
  CHECK(tables.num_tables() <= 6 * 4 + 12 * 2 + 8);
}

TEST_CASE("products with tables have the same bits for any number of threads", "[elements]") {
  PointSource source(53);
  const ElementSpace space(lattice(3, 3, 2), Basis::legendre, 4);
  const BoundarySamples samples = make_boundary_samples(space, 7);
  const PointTables tables(space, samples.points);
  const std::vector<Vec3> x = vectors(space.num_nodes(), source), g = vectors(samples.points.size(), source);
  const auto products = [&](int threads) {
    test::ThreadGuard guard;
    guard.use(threads);
    std::pair result(std::vector<Vec3>(g.size()), std::vector<Vec3>(x.size()));
    tables.apply(x, result.first);
    tables.apply_transposed(g, result.second);
    return result;
  };
  const auto one = products(1), two = products(2);
  CHECK(one == two);
}

TEST_CASE("tables refuse points outside and arrays of other sizes", "[elements]") {
  const ElementSpace space(single_cell(CellKind::tet), Basis::legendre, 2);
  CHECK_THROWS_AS(PointTables(space, std::vector<CellPoint>{{1, Vec3::Zero()}}), InputError);
  CHECK_THROWS_AS(PointTables(space, std::vector<CellPoint>{{0, Vec3(0.5, 0.5, 0.5)}}), InputError);
  const PointTables tables(space, std::vector<CellPoint>{{0, Vec3::Zero()}});
  std::vector<Vec3> nodes(space.num_nodes()), rows(1), none;
  CHECK_THROWS_AS(tables.apply(rows, nodes), InputError);
  CHECK_THROWS_AS(tables.apply(nodes, none), InputError);
  CHECK_THROWS_AS(tables.apply_transposed(nodes, rows), InputError);
}
