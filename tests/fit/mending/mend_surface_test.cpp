// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/mending/mend_surface.h"

#include "subvol/base/error.h"
#include "subvol/fit/geometry/surface_distance.h"
#include "subvol/fit/mending/near_vertices.h"
#include "subvol/fit/mending/surface_faults.h"
#include "subvol/io/surface_io.h"
#include "subvol/shell/shell.h"
#include "subvol/surface/boundary.h"
#include "tests/support/require_data.h"
#include "tests/support/shell_fixtures.h"
#include "tests/support/surface_fixtures.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <numeric>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

/// Two unit cubes, the second moved; vertices in one place are one.
TriangleMesh two_cubes(const Vec3& way) {
  TriangleMesh mesh = cube_surface(2, false);
  const TriangleMesh other = mesh;
  std::vector<Index> number;
  for (const Vec3& p : other.positions) {
    const auto same =
        std::find_if(mesh.positions.begin(), mesh.positions.begin() + static_cast<long>(other.positions.size()),
                     [&](const Vec3& q) { return (q - (p + way)).norm() < 1e-12; });
    number.push_back(static_cast<Index>(same - mesh.positions.begin()));
    if (number.back() < static_cast<Index>(other.positions.size())) continue;
    number.back() = static_cast<Index>(mesh.positions.size());
    mesh.positions.push_back(p + way);
  }
  for (const auto& [a, b, c] : other.triangles) mesh.triangles.push_back({number[a], number[b], number[c]});
  return mesh;
}

/// What a surface without faults must be after mending: something that layers stand on.
void check_mended(const MendedSurface& mended, double distance) {
  CHECK(mended.is_mended());
  CHECK(mended.distance <= distance);
  CHECK(find_faults(mended.surface).none());
  CHECK(make_shell(mended.surface, {.thickness = 0.05, .layers = 2}).failures.none());
  CHECK(mended.vertex_numbers.size() == mended.surface.positions.size());
  CHECK(mended.face_numbers.size() == mended.surface.num_faces());
}

/// A cylinder of diameter and height 1 without its top, whose rims have `n` vertices. If it has a slit, the faces at
/// the first vertices of the rims have vertices of their own on one side, a width away.
TriangleMesh cup(Index n, double slit = 0) {
  TriangleMesh mesh{{Vec3::Zero()}, {}};
  for (const double z : {0.0, 1.0})
    for (Index k = 0; k < n; ++k) {
      const double angle = 2 * std::acos(-1.0) * k / n;
      mesh.positions.emplace_back(std::cos(angle) / 2, std::sin(angle) / 2, z);
    }
  for (Index k = 0; k < n; ++k) {
    const Index a = 1 + k, b = 1 + (k + 1) % n;
    mesh.triangles.push_back({0, b, a});
    mesh.triangles.push_back({a, b, n + b});
    mesh.triangles.push_back({a, n + b, n + a});
  }
  if (slit > 0) {
    const auto first = static_cast<Index>(mesh.positions.size());
    for (const Index v : {Index{1}, 1 + n}) mesh.positions.push_back(mesh.positions[v] - Vec3(0, slit, 0));
    for (auto t = mesh.triangles.end() - 3; t != mesh.triangles.end(); ++t)
      for (Index& v : *t) v = v == 1 ? first : v == 1 + n ? first + 1 : v;
  }
  return mesh;
}

}  // namespace

TEST_CASE("A rim of short edges does not collapse when cracks close, and a slit beside it closes", "[mending]") {
  constexpr double kDistance = 0.05;
  constexpr Index kNumSides = 200;  // edges of 0.016
  const TriangleMesh open = cup(kNumSides);
  const MendedSurface same = mend_surface(as_polygons(open), {}, kDistance, MendingGoal::solid_with_cracks);
  CHECK(same.merged_vertices == 0);
  CHECK(same.surface.num_faces() == open.triangles.size());
  const TriangleMesh slit = cup(kNumSides, 0.003);
  const MendedSurface closed = mend_surface(as_polygons(slit), {}, kDistance, MendingGoal::solid_with_cracks);
  CHECK(closed.merged_vertices == 2);
  CHECK(closed.surface.num_faces() == slit.triangles.size());
  CHECK(closed.surface.positions.size() == open.positions.size());
  CHECK(closed.distance > 1e-4);  // from the surface with the slit
  CHECK(closed.distance <= 0.003 * (1 + 1e-9));
}

TEST_CASE("Vertices in a row become one only as far as the distance reaches", "[mending]") {
  std::vector<Vec3> row;
  std::vector<Index> all;
  for (Index i = 0; i < 100; ++i) {
    row.emplace_back(0.4 * i, 0, 0);
    all.push_back(i);
  }
  const std::vector<Index> number = near_vertices(row, all, 1);
  for (Index i = 0; i < 100; ++i) {
    CHECK((row[number[i]] - row[i]).norm() <= 1);
    CHECK(number[number[i]] == number[i]);
  }
  CHECK(number[2] == 0);
  CHECK(number[3] == 3);
  // Neighbors along a rim stay apart, and so do both ends of a short stretch of it; beyond a gap it is a crack.
  const std::vector<std::array<Index, 2>> rims{{0, 1}, {1, 2}, {3, 4}};
  const std::vector<Index> at_rims = crack_vertices(row, rims, 1);
  CHECK(std::vector<Index>(at_rims.begin(), at_rims.begin() + 5) == std::vector<Index>{0, 1, 2, 2, 4});
}

TEST_CASE("A surface without faults is not mended, nor is one of quads", "[mending]") {
  const PolygonMesh cube = as_polygons(cube_surface(4, false));
  const MendedSurface same = mend_surface(cube, {{{0, 1}}, {}}, 0.01);
  CHECK_FALSE(same.is_mended());
  CHECK(same.surface.positions == cube.positions);
  CHECK(same.surface.face_vertices == cube.face_vertices);
  CHECK(same.tags.creases.size() == 1);
  CHECK(same.vertex_numbers[7] == 7);
  CHECK(to_text(same, 1).empty());
  PolygonMesh folded = plane(Faces::quads);
  folded.positions[8] = folded.positions[0];
  CHECK_FALSE(mend_surface(folded, {}, 0.1).is_mended());
}

TEST_CASE("A face without area between two others goes, whichever way its edges run", "[mending]") {
  TriangleMesh cube = cube_surface(4, false);
  const auto [a, b, c] = cube.triangles[5];
  const auto next = std::find_if(cube.triangles.begin(), cube.triangles.end(), [a = a, b = b](const auto& t) {
    return (t[0] == b && t[1] == a) || (t[1] == b && t[2] == a) || (t[2] == b && t[0] == a);
  });
  REQUIRE(next != cube.triangles.end());
  const Index d = (*next)[0] + (*next)[1] + (*next)[2] - a - b, m = static_cast<Index>(cube.positions.size());
  cube.positions.push_back(0.5 * (cube.positions[a] + cube.positions[b]));
  *next = {b, m, d};
  cube.triangles.push_back({m, a, d});
  cube.triangles.push_back({b, a, m});
  cube.face_groups.groups = {{"side", 3}};
  cube.face_groups.of_face.assign(cube.triangles.size(), 0);
  const PolygonMesh given = as_polygons(cube);
  CHECK_THROWS_WITH(make_shell(given, {.thickness = 0.05}), Catch::Contains("1 face has no area: face 193 at ("));
  const MendedSurface mended = mend_surface(given, {}, 1e-3);
  check_mended(mended, 1e-3);
  CHECK(mended.distance < 1e-12);
  CHECK(mended.surface.face_groups.of_face.size() == mended.surface.num_faces());
  CHECK(to_text(mended, 3).find("mended within") == 0);
}

TEST_CASE("Solids that share a vertex or an edge get one each, a little apart", "[mending]") {
  for (const Vec3& way : {Vec3(2, 2, 2), Vec3(2, 2, 0)}) {
    const PolygonMesh given = as_polygons(two_cubes(way));
    const bool share_vertex = way.z() > 0;
    CHECK_THROWS_WITH(
        make_shell(given, {.thickness = 0.05}),
        Catch::Contains(share_vertex ? "1 vertex has more than one fan of faces: surfaces touch there: vertex"
                                     : "2 edges have more than two faces"));
    const MendedSurface mended = mend_surface(given, {}, 1e-2);
    check_mended(mended, 1e-2);
    CHECK(mended.split_vertices == (share_vertex ? 1 : 3));
    CHECK(mended.surface.num_faces() == given.num_faces());
  }
}

TEST_CASE("A vertex that lies beyond its neighbor by less than the distance does not fold the surface", "[mending]") {
  TriangleMesh cube = cube_surface(4, true);
  const auto [a, b, c] = cube.triangles[40];
  const Vec3 center = (cube.positions[a] + cube.positions[b] + cube.positions[c]) / 3;
  const auto m = static_cast<Index>(cube.positions.size());
  cube.positions.push_back(cube.positions[a] + 1e-4 * (cube.positions[a] - center));
  cube.triangles[40] = {a, b, m};
  cube.triangles.push_back({b, c, m});
  cube.triangles.push_back({c, a, m});
  const PolygonMesh given = as_polygons(cube);
  REQUIRE_FALSE(find_faults(given).none());
  check_mended(mend_surface(given, {}, 1e-3), 1e-3);
  const MendedSurface hardly = mend_surface(given, {}, 1e-9);
  CHECK(hardly.distance <= 1e-9);
  CHECK(mend_surface(given, {}, 0).surface.positions == given.positions);
}

TEST_CASE("Vertices of a soup that differ by rounding become one", "[mending]") {
  const TriangleMesh cube = cube_surface(3, false);
  TriangleMesh soup;
  RandomPoints random(4);
  for (const auto& t : cube.triangles) {
    for (const Index v : t) soup.positions.push_back(cube.positions[v] + random.point(1e-9));
    const auto n = static_cast<Index>(soup.positions.size());
    soup.triangles.push_back({n - 3, n - 2, n - 1});
  }
  const MendedSurface mended = mend_surface(as_polygons(soup), {}, 1e-3);
  check_mended(mended, 1e-3);
  CHECK(mended.surface.positions.size() == cube.positions.size());
  CHECK(mended.merged_vertices == soup.positions.size() - cube.positions.size());
}

TEST_CASE("What crosses deeply stays, and is told with its number and places", "[mending][slow]") {
  TriangleMesh two = cube_surface(2, false);
  const auto n = static_cast<Index>(two.positions.size());
  const TriangleMesh one = two;
  for (const Vec3& p : one.positions) two.positions.push_back(p + Vec3(0.7, 0.6, 0.5));
  for (const auto& [a, b, c] : one.triangles) two.triangles.push_back({n + a, n + b, n + c});
  const PolygonMesh given = as_polygons(two);
  CHECK_FALSE(find_faults(mend_surface(given, {}, 1e-3).surface).none());
  CHECK_THROWS_WITH(make_shell(given, {.thickness = 0.05}), Catch::Contains("the surface meets itself at ") &&
                                                                Catch::Contains(" pairs of faces: faces ") &&
                                                                Catch::Contains(" in all)"));
}

TEST_CASE("Messages name vertices by the numbers that the caller gives, and their coordinates", "[mending]") {
  const PolygonMesh surface = plane(Faces::triangles);
  std::vector<Index> vertices(surface.positions.size()), faces(surface.num_faces());
  std::iota(vertices.begin(), vertices.end(), 100);
  std::iota(faces.begin(), faces.end(), 200);
  SurfaceFaults faults;
  CHECK(to_text(faults, surface).empty());
  faults.meeting = {{0, 1}};
  faults.hidden = {0, 1};
  CHECK(to_text(faults, surface, {vertices, faces}) ==
        "the surface meets itself at 1 pair of faces: faces 200 and 201 at (0.0833333, 0.125, 0); no direction sees "
        "all faces "
        "around from their front at 2 vertices: vertex 100 at (0, 0, 0), vertex 101 at (0.166667, 0, 0)");
}

TEST_CASE("Real parts that were refused get shells after a repair", "[mending][slow]") {
  const auto data = require_data();
  if (!data) return;
  // Rounding errors of zero are no faults: readers make one vertex of places that differ by nothing else.
  CHECK(find_faults(read_polygon_mesh(*data / "reported/50-angle_block.stl")).none());
  for (const char* name : {"reported/50-z-axis-top.stl", "auto/parts/T8_Nut_Block_x1.stl", "auto/parts/fan-shroud.stl",
                           "shell/camelhead_open/surface.off"}) {
    if (!std::filesystem::exists(*data / name)) continue;
    CAPTURE(name);
    const PolygonMesh surface = read_polygon_mesh(*data / name);
    const double diagonal = bounding_box_diagonal(triangulate(surface));
    const MendedSurface mended = mend_surface(surface, {}, kMendingShare * diagonal);
    CHECK(mended.is_mended());
    CHECK(mended.distance <= kMendingShare * diagonal);
    CHECK(find_faults(mended.surface).none());
    CHECK(make_shell(mended.surface, {.thickness = 0.01 * diagonal, .optimize = false}).failures.none());
  }
}
