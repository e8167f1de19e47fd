// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/elements/element_space.h"
#include "subvol/base/error.h"
#include "subvol/fit/elements/high_order_mesh.h"
#include "subvol/fit/elements/map_projection.h"
#include "tests/support/element_fixtures.h"

#include <catch2/catch.hpp>

#include <cmath>
#include <map>
#include <set>
#include <vector>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

/// An edge or face of a cell, by its corners in cyclic order.
using Entity = std::vector<int>;

std::vector<Entity> entities(CellKind kind, int num_corners) {
  const CellTopology& topology = cell_topology(kind);
  std::vector<Entity> result;
  if (num_corners == 2)
    for (int e = 0; e < topology.num_edges; ++e) result.push_back({topology.edges[e][0], topology.edges[e][1]});
  else
    for (int f = 0; f < topology.num_faces; ++f)
      if (topology.face_sizes[f] == num_corners)
        result.emplace_back(topology.faces[f].begin(), topology.faces[f].begin() + num_corners);
  return result;
}

/// Two cells glued along an entity of each: corner i of the one on corner (shift +- i) of the other.
VolumeMesh glued(CellKind first, const Entity& on_first, CellKind second, const Entity& on_second) {
  VolumeMesh mesh = single_cell(first);
  const auto vertices = canonical_vertices(second);
  std::vector<Index> corners(vertices.size(), kNoIndex);
  for (std::size_t i = 0; i < on_first.size(); ++i) corners[on_second[i]] = on_first[i];
  for (std::size_t v = 0; v < corners.size(); ++v)
    if (corners[v] == kNoIndex) {
      corners[v] = static_cast<Index>(mesh.num_vertices());
      mesh.positions.push_back(vertices[v] + Vec3(3, 0, 0));
    }
  mesh.add_cell(second, corners);
  return mesh;
}

Vec3 point_on(CellKind kind, const Entity& entity, double s, double t) {
  const auto x = canonical_vertices(kind);
  if (entity.size() == 2) return (1 - s) * x[entity[0]] + s * x[entity[1]];
  if (entity.size() == 3) return (1 - s - t) * x[entity[0]] + s * x[entity[1]] + t * x[entity[2]];
  return (1 - t) * ((1 - s) * x[entity[0]] + s * x[entity[1]]) + t * ((1 - s) * x[entity[3]] + s * x[entity[2]]);
}

/// Largest difference between what the two cells make of their common entity.
double jump(const HighOrderMesh& mesh, CellKind first, const Entity& on_first, CellKind second,
            const Entity& on_second) {
  double largest = 0;
  for (const auto& [s, t] : {std::pair{0.13, 0.29}, std::pair{0.55, 0.08}, std::pair{0.31, 0.62}})
    largest = std::max(largest, (mesh.position(0, point_on(first, on_first, s, t)) -
                                 mesh.position(1, point_on(second, on_second, s, t)))
                                    .norm());
  return largest;
}

/// A polynomial of total degree `order` in three coordinates.
Vec3 polynomial(const Vec3& x, int order) {
  Vec3 sum = Vec3::Zero();
  for (int a = 0; a <= order; ++a)
    for (int b = 0; a + b <= order; ++b) {
      const int c = order - a - b;
      sum += Vec3(std::cos(a + 2.0 * b), std::sin(3.0 * a + c), std::cos(2.0 * c - b)) * std::pow(x[0], a) *
             std::pow(x[1], b) * std::pow(x[2], c) / (order + 1);
    }
  return sum + x;
}

/// Largest distance between a mesh and a map of its straight-sided positions, at points of every cell.
template <class Map>
double largest_error(const HighOrderMesh& mesh, const HighOrderMesh& straight, const Map& map, int num_points = 8) {
  PointSource source(17);
  double largest = 0;
  for (std::size_t c = 0; c < mesh.space.num_cells(); ++c)
    for (int i = 0; i < num_points; ++i) {
      const Vec3 p = source.inside(mesh.space.kind(c));
      largest = std::max(largest, (mesh.position(c, p) - map(straight.position(c, p))).norm());
    }
  return largest;
}

EntityOrders random_orders(const MeshTopology& topology, int largest, std::mt19937& random) {
  EntityOrders orders = EntityOrders::uniform(topology, 1);
  std::uniform_int_distribution<int> uniform(1, largest);
  for (auto* list : {&orders.edges, &orders.faces, &orders.cells})
    for (int& order : *list) order = uniform(random);
  orders.raise_borders(topology);
  return orders;
}

/// A tet, prism and hex mesh whose cells are affine images of canonical ones.
VolumeMesh affine_cells() {
  VolumeMesh mesh = mixed_cells();
  for (Vec3& p : mesh.positions) p = 0.4 * Vec3(p[0] + 0.3 * p[1], p[1] - 0.2 * p[2], p[2] + 0.1 * p[0]);
  return mesh;
}

}  // namespace

TEST_CASE("node counts of one cell have their closed forms", "[elements]") {
  for (int p = 1; p <= kMaxOrder; ++p) {
    CHECK(ElementSpace(single_cell(CellKind::hex), Basis::fourier, p).num_nodes() == (p + 1.0) * (p + 1) * (p + 1));
    CHECK(ElementSpace(single_cell(CellKind::prism), Basis::fourier, p).num_nodes() ==
          (p + 1.0) * (p + 1) * (p + 2) / 2);
    CHECK(ElementSpace(single_cell(CellKind::tet), Basis::fourier, p).num_nodes() == (p + 1.0) * (p + 2) * (p + 3) / 6);
    CHECK(ElementSpace(lattice(2, 3, 1), Basis::fourier, p).num_nodes() == (2.0 * p + 1) * (3 * p + 1) * (p + 1));
  }
}

TEST_CASE("a hex of one order lists its functions in tensor order", "[elements]") {
  for (const int p : {1, 2, 5}) {
    const ElementSpace space(lattice(2, 2, 2), Basis::fourier, p);
    CHECK(space.num_patterns() == 1);
    const auto modes = space.modes(3);
    std::size_t at = 0;
    for (int k = 0; k <= p; ++k)
      for (int j = 0; j <= p; ++j)
        for (int i = 0; i <= p; ++i, ++at) {
          CHECK(modes[at].i == i);
          CHECK(modes[at].j == j);
          CHECK(modes[at].k == k);
        }
    CHECK(modes.size() == at);
  }
}

TEST_CASE("cells of one order and kind share few patterns", "[elements]") {
  PointSource source(23);
  std::map<CellKind, std::set<std::vector<LocalMode>>> patterns;
  for (int repeat = 0; repeat < 500; ++repeat)
    for (const CellKind kind : kAllKinds) {
      const ElementSpace space(renumbered(single_cell(kind), source.random()), Basis::fourier, 4);
      const auto modes = space.modes(0);
      CHECK(std::is_sorted(modes.begin(), modes.end()));
      CHECK(std::adjacent_find(modes.begin(), modes.end()) == modes.end());
      patterns[kind].insert({modes.begin(), modes.end()});
    }
  CHECK(patterns[CellKind::hex].size() == 1);
  CHECK(patterns[CellKind::prism].size() == 9);
  CHECK(patterns[CellKind::tet].size() == 12);
}

TEST_CASE("cells of all kinds agree on every edge and face they share, in every orientation", "[elements]") {
  constexpr double kTolerance = 1e-12;  // rounding of a thousand functions with coefficients of order one
  PointSource source(29);
  double largest = 0;
  std::size_t tried = 0;
  for (const CellKind first : kAllKinds)
    for (const CellKind second : kAllKinds)
      for (const int corners : {2, 3, 4})
        for (const Entity& on_first : entities(first, corners))
          for (const Entity& on_second : entities(second, corners))
            for (int turn = 0; turn < corners; ++turn)
              for (const bool mirrored : {false, true}) {
                if (corners == 2 && mirrored) continue;
                Entity turned(corners);
                for (int i = 0; i < corners; ++i)
                  turned[i] = on_second[((mirrored ? -i : i) + turn + corners) % corners];
                VolumeMesh mesh = renumbered(glued(first, on_first, second, turned), source.random());
                const Basis basis = kBothBases[tried % 2];
                const bool rarely = tried++ % 40 == 0;
                for (const int order : {2, 3, 4, 5, 6, 7, 8, 16}) {
                  if (order > 5 && !rarely) continue;
                  const ElementSpace space(mesh, basis, order);
                  largest = std::max(largest, jump(random_mesh(space, source), first, on_first, second, turned));
                }
                const ElementSpace space(mesh, basis, random_orders(MeshTopology(mesh), 6, source.random()));
                largest = std::max(largest, jump(random_mesh(space, source), first, on_first, second, turned));
                if (largest > kTolerance) {
                  CAPTURE(first, second, corners, turn, mirrored);
                  REQUIRE(largest <= kTolerance);
                }
              }
  CHECK(tried > 2000);
  INFO("largest jump " << largest);
  CHECK(largest <= kTolerance);
}

TEST_CASE("affine maps are reproduced at every order, kind and basis", "[elements]") {
  const Mat3 matrix = (Mat3() << 1, 0.3, -0.2, 0.1, 0.8, 0.4, -0.5, 0.2, 1.3).finished();
  const auto affine = [&](const Vec3& x) -> Vec3 { return matrix * x + Vec3(3, -1, 2); };
  for (const Basis basis : kBothBases)
    for (const int order : {1, 2, 3, 5, 8}) {
      const VolumeMesh mesh = mixed_cells();
      const HighOrderMesh straight(ElementSpace(mesh, basis, order), mesh);
      VolumeMesh moved = mesh;
      for (Vec3& p : moved.positions) p = affine(p);
      CHECK(largest_error(HighOrderMesh(straight.space, moved), straight, affine) < 1e-13);
      const HighOrderMesh projected =
          project_map(straight.space, [&](std::size_t c, const Vec3& p) { return affine(straight.position(c, p)); });
      CHECK(largest_error(projected, straight, affine) < 1e-12);
      for (std::size_t c = 0; c < 4; ++c) {
        const Vec3 p(0.2, 0.3, 0.4);
        CHECK((projected.jacobian(c, p) - matrix * straight.jacobian(c, p)).norm() < 1e-11);
      }
    }
}

TEST_CASE("polynomial maps are reproduced by the legendre basis at every order and kind", "[elements][slow]") {
  PointSource source(31);
  for (int order = 1; order <= kMaxOrder; ++order)
    for (const CellKind kind : kAllKinds) {
      if (order > 8 && order < kMaxOrder && order % 4) continue;
      const VolumeMesh mesh = renumbered(single_cell(kind), source.random());
      const HighOrderMesh straight(ElementSpace(mesh, Basis::legendre, order), mesh);
      const auto map = [&](const Vec3& x) { return polynomial(x, order); };
      const HighOrderMesh projected =
          project_map(straight.space, [&](std::size_t c, const Vec3& p) { return map(straight.position(c, p)); });
      CAPTURE(order, kind);
      CHECK(largest_error(projected, straight, map) < 1e-12);
    }
  const VolumeMesh mesh = renumbered(affine_cells(), source.random());
  for (int order = 1; order <= 6; ++order) {
    const HighOrderMesh straight(ElementSpace(mesh, Basis::legendre, order), mesh);
    const auto map = [&](const Vec3& x) { return polynomial(x, order); };
    const HighOrderMesh projected =
        project_map(straight.space, [&](std::size_t c, const Vec3& p) { return map(straight.position(c, p)); });
    // Prisms of the mesh are affine over their triangles but hold a sloped quad: only total degree counts.
    CHECK(largest_error(projected, straight, map) < 1e-12);
  }
}

TEST_CASE("raising orders keeps the map, and lowering them again gives the first back", "[elements]") {
  PointSource source(37);
  for (const Basis basis : kBothBases)
    for (int repeat = 0; repeat < 10; ++repeat) {
      const VolumeMesh mesh = renumbered(mixed_cells(), source.random());
      const MeshTopology topology(mesh);
      const EntityOrders few = random_orders(topology, 5, source.random());
      EntityOrders more = random_orders(topology, 9, source.random());
      for (std::size_t e = 0; e < few.edges.size(); ++e) more.edges[e] = std::max(more.edges[e], few.edges[e]);
      for (std::size_t f = 0; f < few.faces.size(); ++f) more.faces[f] = std::max(more.faces[f], few.faces[f]);
      for (std::size_t c = 0; c < few.cells.size(); ++c) more.cells[c] = std::max(more.cells[c], few.cells[c]);
      const HighOrderMesh low = random_mesh(ElementSpace(mesh, basis, few), source);
      const HighOrderMesh high = low.with_orders(more);
      CHECK(high.space.num_nodes() >= low.space.num_nodes());
      for (std::size_t c = 0; c < mesh.num_cells(); ++c)
        for (int i = 0; i < 5; ++i) {
          const Vec3 p = source.inside(mesh.kinds[c]);
          CHECK((low.position(c, p) - high.position(c, p)).norm() < 1e-13);
          CHECK((low.jacobian(c, p) - high.jacobian(c, p)).norm() < 1e-12);
        }
      CHECK(high.with_orders(few).coefficients == low.coefficients);
    }
}

TEST_CASE("jacobians of a mesh are differences of its positions", "[elements]") {
  PointSource source(41);
  const ElementSpace space(mixed_cells(), Basis::fourier, 6);
  const HighOrderMesh mesh = random_mesh(space, source);
  constexpr double kStep = 1e-5;
  for (std::size_t c = 0; c < space.num_cells(); ++c) {
    const Vec3 p = 0.05 * Vec3::Ones() + 0.8 * source.inside(space.kind(c));
    Mat3 difference;
    for (int d = 0; d < 3; ++d)
      difference.col(d) =
          (mesh.position(c, p + kStep * Vec3::Unit(d)) - mesh.position(c, p - kStep * Vec3::Unit(d))) / (2 * kStep);
    CHECK((mesh.jacobian(c, p) - difference).norm() < 1e-5);
  }
}

TEST_CASE("a map to points gives the positions there", "[elements]") {
  PointSource source(43);
  for (const Basis basis : kBothBases) {
    const ElementSpace space(mixed_cells(), basis, 5);
    const HighOrderMesh mesh = random_mesh(space, source);
    std::vector<CellPoint> points;
    for (Index c = 0; c < 4; ++c) {
      for (int i = 0; i < 20; ++i) points.push_back({c, source.inside(space.kind(c))});
      for (const Vec3& corner : canonical_vertices(space.kind(c))) points.push_back({c, corner});
    }
    const SparseMap map = point_map(space, points);
    const std::vector<Vec3> positions = map.apply(mesh.coefficients);
    for (std::size_t i = 0; i < points.size(); ++i)
      CHECK((positions[i] - mesh.position(points[i].cell, points[i].point)).norm() < 1e-12);
    CHECK(map.row_size(map.num_rows() - 1) == 1);
  }
}

TEST_CASE("a smooth map is met at the rate of the basis", "[elements]") {
  // Coefficients of sines fall with the third power of their number, so what is left with the second; polynomials
  // converge exponentially.
  const auto smooth = [](const Vec3& x) -> Vec3 {
    return x + 0.1 * Vec3(std::sin(2 * x[1] + x[2]), std::cos(x[0] * x[2]), std::exp(0.5 * x[0]));
  };
  for (const CellKind kind : kAllKinds) {
    const VolumeMesh mesh = single_cell(kind);
    std::array<std::array<double, 2>, 2> errors;
    for (int b = 0; b < 2; ++b)
      for (int i = 0; i < 2; ++i) {
        const HighOrderMesh straight(ElementSpace(mesh, kBothBases[b], i ? 8 : 4), mesh);
        errors[b][i] = largest_error(
            project_map(straight.space, [&](std::size_t c, const Vec3& p) { return smooth(straight.position(c, p)); }),
            straight, smooth, 2000);
      }
    CAPTURE(kind, errors[0][0], errors[0][1], errors[1][0], errors[1][1]);
    CHECK(std::log2(errors[0][0] / errors[0][1]) > 1.8);
    CHECK(errors[1][0] / errors[1][1] > 1e4);
  }
}

TEST_CASE("what cannot be a space or a mesh of it is refused", "[elements]") {
  const VolumeMesh mesh = mixed_cells();
  const MeshTopology topology(mesh);
  CHECK_THROWS_AS(ElementSpace(mesh, Basis::fourier, 0), InputError);
  CHECK_THROWS_AS(ElementSpace(mesh, Basis::fourier, kMaxOrder + 1), InputError);
  EntityOrders orders = EntityOrders::uniform(topology, 2);
  orders.faces[0] = 3;
  CHECK_THROWS_AS(ElementSpace(mesh, Basis::fourier, orders), InputError);
  orders.raise_borders(topology);
  CHECK_NOTHROW(ElementSpace(mesh, Basis::fourier, orders));
  orders.cells[0] = 4;
  CHECK_THROWS_AS(ElementSpace(mesh, Basis::fourier, orders), InputError);
  orders.raise_borders(topology);
  const ElementSpace space(mesh, Basis::fourier, orders);
  orders.cells.pop_back();
  CHECK_THROWS_AS(space.with_orders(orders), InputError);
  CHECK_THROWS_AS(orders.raise_borders(topology), InputError);
  CHECK_THROWS_AS(HighOrderMesh(space, std::vector<Vec3>(3)), InputError);
  CHECK_THROWS_AS(HighOrderMesh(space, single_cell(CellKind::hex)), InputError);
  CHECK_THROWS_AS(node_numbers_in(space, ElementSpace(mesh, Basis::legendre, 2)), InputError);
  CHECK_THROWS_AS(node_numbers_in(space, ElementSpace(lattice(1, 1, 1), Basis::fourier, 2)), InputError);
  CHECK_THROWS_AS(point_map(space, std::vector<CellPoint>{{7, Vec3::Zero()}}), InputError);
  CHECK_THROWS_AS(point_map(space, std::vector<CellPoint>{{3, Vec3(0.5, 0.5, 0.5)}}), InputError);
  CHECK_THROWS_AS(point_map(space, std::vector<CellPoint>{{0, Vec3(0.5, std::nan(""), 0.5)}}), InputError);
  CHECK_THROWS_AS(project_map(space, [](std::size_t, const Vec3&) -> Vec3 { return Vec3::Constant(INFINITY); }),
                  InputError);
}
