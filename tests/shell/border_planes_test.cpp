// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/shell/border_planes.h"

#include "subvol/base/error.h"
#include "subvol/shell/curved_shell.h"
#include "subvol/shell/partial_surface.h"
#include "subvol/shell/shell.h"
#include "subvol/surface/boundary.h"
#include "tests/support/shell_fixtures.h"
#include "tests/support/surface_fixtures.h"

#include <catch2/catch.hpp>

#include <cmath>
#include <numbers>

using namespace subvol;
using namespace subvol::test;

namespace {

/// A pipe around the z axis, radius 1; its lower end lies in z = 0, its upper one in z = 2 + slope x.
PolygonMesh pipe(double slope, Faces faces = Faces::triangles) {
  constexpr int kAround = 16, kAlong = 4;
  return grid(
      kAround, kAlong, faces,
      [&](double i, double j) {
        const double angle = 2 * std::numbers::pi * i / kAround, x = std::cos(angle), y = std::sin(angle);
        return Vec3(x, y, j / kAlong * (2 + slope * x));
      },
      true);
}

/// Half of a pipe: its ends are half circles, its sides straight.
PolygonMesh half_pipe() {
  return grid(16, 8, Faces::quads, [](double i, double j) {
    const double angle = std::numbers::pi * i / 16;
    return Vec3(std::cos(angle), std::sin(angle), j / 4);
  });
}

ColumnPlanes planes_of(const PolygonMesh& surface) {
  const ShellLayers layers = make_layers(surface, 0, 1, 1);
  return ColumnPlanes(flat_border_planes(layers.surface, layers.topology), surface.positions.size());
}

}  // namespace

TEST_CASE("Flat ends of a pipe have planes, straight and oblique ones", "[shell]") {
  const PolygonMesh surface = pipe(0.6);
  const ShellLayers layers = make_layers(surface, 0, 1, 1);
  const std::vector<BorderPlane> planes = flat_border_planes(surface, layers.topology);
  REQUIRE(planes.size() == 2);
  for (const BorderPlane& plane : planes) {
    CHECK(plane.vertices.size() == 16);
    const bool is_lower = surface.positions[plane.vertices[0]].z() < 1;
    const Vec3 normal = is_lower ? Vec3::UnitZ() : Vec3(-0.6, 0, 1).normalized();
    CHECK(std::abs(plane.normal.dot(normal)) == Approx(1).epsilon(1e-12));
  }
  CHECK(planes_of(plane(Faces::quads)).empty());  // the faces lie in the plane of their border
  PolygonMesh bent = pipe(0.6);
  bent.positions[5].z() += 1e-3;
  CHECK(flat_border_planes(bent, layers.topology).size() == 1);
}

TEST_CASE("Pieces of a border have planes if they are not straight, or together are not", "[shell]") {
  const ColumnPlanes half = planes_of(half_pipe());
  CHECK(half.num_planes() == 2);
  CHECK(half.num_columns() == 2 * 17);
  // A channel: three straight pieces at each end lie in one plane; the sides along it lie in those of the faces there.
  const ColumnPlanes channel =
      planes_of(drawn_profile(profile({{0, 1, 0}, {0, 0, 0}, {1, 0, 0}, {1, 1, 0}}, 4), Faces::quads));
  CHECK(channel.num_planes() == 2);
  CHECK(channel.num_columns() == 2 * 13);
}

TEST_CASE("A border that zigzags has no planes, although each two of its edges lie in one", "[shell]") {
  constexpr int kEdges = 12;
  const PolygonMesh tube = grid(
      kEdges, 1, Faces::quads,
      [](double i, double j) {
        const double angle = 2 * std::numbers::pi * i / kEdges, bump = static_cast<int>(i) % 2 == 0 ? 0.4 : -0.4;
        return Vec3(std::cos(angle), std::sin(angle), j > 0 ? 2 + bump : 0);
      },
      true);
  const ShellLayers layers = make_layers(tube, 0, 1, 1);
  const std::vector<BorderPlane> planes = flat_border_planes(tube, layers.topology);
  REQUIRE(planes.size() == 1);
  CHECK(std::abs(planes[0].normal.z()) == Approx(1));
}

TEST_CASE("Projectors keep points in planes, on lines, or free", "[shell]") {
  const ColumnPlanes planes({{Vec3::UnitX(), {0, 1}}, {Vec3::UnitY(), {1, 2}}}, 4);
  const auto of = [&](std::initializer_list<Index> columns) { return planes.projector(std::vector<Index>(columns)); };
  CHECK(of({0}).isApprox(Vec3(0, 1, 1).asDiagonal().toDenseMatrix()));
  CHECK(of({1}).isApprox(Vec3(0, 0, 1).asDiagonal().toDenseMatrix()));
  CHECK(of({0, 1}).isApprox(of({0})));
  CHECK(of({1, 2}).isApprox(of({2})));
  CHECK(of({0, 2}) == Mat3::Identity());
  CHECK(of({3}) == Mat3::Identity());
  CHECK(ColumnPlanes().projector(std::vector<Index>{7}) == Mat3::Identity());
}

TEST_CASE("Layers end in the plane of a flat border, solved and curved", "[shell][slow]") {
  for (const double slope : {0.0, 0.6, 1.5})
    for (const ShellSide side : {ShellSide::outward, ShellSide::both}) {
      const ShellResult shell = make_shell(pipe(slope), {.thickness = 0.2, .side = side, .layers = 3});
      CAPTURE(slope);
      CHECK(shell.failures.none());
      CHECK(shell.layers.planes.num_columns() == 32);
      CHECK(shell.border_distance_max < 1e-14);
      const std::size_t n = shell.layers.num_columns();
      for (std::size_t i = 0; i < shell.mesh.num_vertices(); ++i) {
        const Vec3& p = shell.mesh.positions[i];
        if (i % n < 16) CHECK(std::abs(p.z()) < 1e-13);
        if (i % n >= n - 16) CHECK(std::abs(p.z() - 2 - slope * p.x()) < 1e-13);
      }
      if (side == ShellSide::both || slope != 0.6) continue;
      const CurvedShell curved = curve_shell(shell, {.order = 2});
      CHECK(curved.valid());
      const ElementSpace& space = curved.mesh.space;
      for (std::size_t v = 0; v < space.num_vertices(); ++v)
        if (v % n >= n - 16)
          CHECK(std::abs(curved.mesh.coefficients[v].z() - 2 - slope * curved.mesh.coefficients[v].x()) < 1e-12);
      // Modes are displacements.
      const MeshTopology& topology = space.topology();
      for (std::size_t e = 0; e < topology.num_edges(); ++e) {
        const auto [a, b] = topology.edge(static_cast<Index>(e));
        if (static_cast<std::size_t>(a) % n < n - 16 || static_cast<std::size_t>(b) % n < n - 16) continue;
        for (std::size_t i = space.edge_nodes(e); i < space.edge_nodes(e + 1); ++i)
          CHECK(std::abs(curved.mesh.coefficients[i].z() - slope * curved.mesh.coefficients[i].x()) < 1e-12);
      }
    }
}

TEST_CASE("A patch that is left out is a plane in which the layers around it end", "[shell]") {
  // A cube without its top and front: the edge between the two goes, too.
  const PolygonMesh cube = as_polygons(cube_surface(4, false));
  const Index top = closest_face(cube, {0.1, 0.2, 5}), front = closest_face(cube, {0.1, -5, 0.2});
  std::vector<char> left_out = patch_of_face(cube, top);
  CHECK(std::count(left_out.begin(), left_out.end(), 1) == 32);
  CHECK(patch_of_face(cube, top, 100) == std::vector<char>(cube.num_faces(), 1));
  const std::vector<char> of_front = patch_of_face(cube, front);
  for (std::size_t f = 0; f < left_out.size(); ++f) left_out[f] |= of_front[f];
  const PartialSurface part = without_faces(cube, {{{0, 1, 2.0}}, {{0}}}, left_out);
  CHECK(part.surface.num_faces() == 4 * 32);
  REQUIRE(part.border_planes.size() == 2);
  ShellOptions options{.thickness = 0.3, .side = ShellSide::both, .layers = 2};
  options.border_planes = part.border_planes;
  const ShellResult shell = make_shell(part.surface, options);
  CHECK(shell.failures.none());
  CHECK(shell.border_distance_max < 1e-14);
  std::size_t on_both = 0;
  const std::size_t n = shell.layers.num_columns();
  for (std::size_t i = 0; i < shell.mesh.num_vertices(); ++i) {
    const Vec3 &p = shell.mesh.positions[i], &foot = part.surface.positions[i % n];
    if (foot.z() > 1 - 1e-12) CHECK(std::abs(p.z() - 1) < 1e-14);
    if (foot.y() < -1 + 1e-12) CHECK(std::abs(p.y() + 1) < 1e-14);
    on_both += foot.z() > 1 - 1e-12 && foot.y() < -1 + 1e-12;
  }
  CHECK(on_both == 2 * 5);  // columns of two vertices, of five sheets
  CHECK_THROWS_AS(without_faces(cube, {}, std::vector<char>(cube.num_faces(), 1)), InputError);
  CHECK_THROWS_AS(patch_of_face(cube, 1000), InputError);
}
