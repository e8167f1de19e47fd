// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/mending/surface_repair.h"

#include "subvol/fit/geometry/surface_distance.h"
#include "subvol/fit/mending/mend_surface.h"
#include "subvol/fit/mending/second_sides.h"
#include "subvol/surface/boundary.h"
#include "subvol/surface/welded_surface.h"
#include "tests/support/surface_fixtures.h"

#include <catch2/catch.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

using namespace subvol;
using namespace subvol::test;

namespace {

/// A cube of volume 8 with a point above one of its triangles that lies beyond a corner by a share of the way there:
/// the triangles around it cross their neighbors.
TriangleMesh folded_cube(double share) {
  TriangleMesh cube = cube_surface(4, false);
  const auto [a, b, c] = cube.triangles[40];
  const Vec3 center = (cube.positions[a] + cube.positions[b] + cube.positions[c]) / 3;
  const auto m = static_cast<Index>(cube.positions.size());
  cube.positions.push_back(cube.positions[a] + share * (cube.positions[a] - center));
  cube.triangles[40] = {a, b, m};
  cube.triangles.push_back({b, c, m});
  cube.triangles.push_back({c, a, m});
  return cube;
}

TriangleMesh box(const Vec3& low, const Vec3& high, bool has_other_diagonals) {
  TriangleMesh mesh;
  for (int v = 0; v < 8; ++v)
    mesh.positions.emplace_back(v & 1 ? high.x() : low.x(), v & 2 ? high.y() : low.y(), v & 4 ? high.z() : low.z());
  for (const auto& [a, b, c, d] : std::vector<std::array<Index, 4>>{
           {0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}) {
    mesh.triangles.push_back({a, b, has_other_diagonals ? d : c});
    mesh.triangles.push_back({has_other_diagonals ? b : a, c, d});
  }
  return mesh;
}

void add(TriangleMesh& mesh, const TriangleMesh& more) {
  const auto first = static_cast<Index>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), more.positions.begin(), more.positions.end());
  for (const auto& [a, b, c] : more.triangles) mesh.triangles.push_back({first + a, first + b, first + c});
}

std::vector<double> volumes_of_regions(const SurfaceRepair& repair) {
  std::vector<double> volumes;
  if (repair.regions) volumes = repair.regions->volumes;
  std::ranges::sort(volumes);
  return volumes;
}

/// A cube whose upper side has a spike through the lower one.
TriangleMesh spiked_cube() {
  TriangleMesh cube = cube_surface(4, false);
  Eigen::AlignedBox3d box;
  for (const Vec3& p : cube.positions) box.extend(p);
  for (Vec3& p : cube.positions)
    if ((p - Vec3(box.center().x(), box.center().y(), box.max().z())).norm() < 1e-9) p.z() -= 1.2 * box.sizes().z();
  return cube;
}

}  // namespace

TEST_CASE("A fold of a thousandth of a triangle is mended before a surface is filled", "[mending]") {
  const TriangleMesh cube = folded_cube(1e-3);
  REQUIRE_FALSE(diagnose(cube).is_fillable());
  const SurfaceRepair repair = repair_surface(cube);
  CHECK(repair.is_fillable);
  CHECK(diagnose(repair.surface).is_fillable());
  REQUIRE(repair.done.size() == 1);
  CHECK(repair.done[0].find("target: mended within") == 0);
  CHECK(std::abs(internal::signed_volume_of(repair.surface)) == Approx(8));
}

TEST_CASE("A spike through the opposite side is left and told", "[mending][slow]") {
  const SurfaceRepair repair = repair_surface(spiked_cube());
  CHECK_FALSE(repair.is_fillable);
  CHECK_FALSE(repair.notes.empty());
}

TEST_CASE("Walls of zero width between two triangles that face each other are removed", "[mending]") {
  TriangleMesh cube = cube_surface(4, false);
  const auto [a, b, c] = cube.triangles[0];
  const auto m = static_cast<Index>(cube.positions.size());
  const double length = (cube.positions[a] - cube.positions[b]).norm();
  cube.positions.push_back(cube.positions[a] + 0.3 * (cube.positions[a] - cube.positions[c]).normalized() * length);
  cube.triangles.push_back({a, b, m});
  cube.triangles.push_back({b, a, m});
  REQUIRE_FALSE(diagnose(cube).is_fillable());
  const SurfaceRepair repair = repair_surface(cube);
  CHECK(repair.is_fillable);
  CHECK(repair.surface.triangles.size() == cube.triangles.size() - 2);
}

TEST_CASE("Cracks between the faces of a part close before it is filled", "[mending]") {
  // Each triangle has corners of its own, off by up to a quarter of the distance within which surfaces are mended.
  TriangleMesh cube = cube_surface(4, false), cracked;
  RandomPoints random(7);
  const double diagonal = bounding_box_diagonal(cube);
  for (const auto& t : cube.triangles) {
    const auto first = static_cast<Index>(cracked.positions.size());
    for (const Index v : t) cracked.positions.push_back(cube.positions[v] + random.point(kMendingShare * diagonal / 8));
    cracked.triangles.push_back({first, first + 1, first + 2});
  }
  REQUIRE_FALSE(diagnose(cracked).is_fillable());
  const SurfaceRepair repair = repair_surface(cracked);
  CHECK(repair.is_fillable);
  CHECK(internal::welded(repair.surface).mesh.positions.size() == cube.positions.size());
  CHECK(std::abs(internal::signed_volume_of(repair.surface)) == Approx(8).epsilon(1e-3));
  // They do so only where rims count as cracks.
  const PolygonMesh polygons = as_polygons(cracked);
  const double distance = kMendingShare * diagonal;
  CHECK(mend_surface(polygons, {}, distance, MendingGoal::solid).surface.positions.size() == cracked.positions.size());
  CHECK(mend_surface(polygons, {}, distance, MendingGoal::solid_with_cracks).surface.positions.size() ==
        cube.positions.size());
}

TEST_CASE("A plane hole gets a plane cover before a surface is filled", "[mending]") {
  TriangleMesh cube = cube_surface(4, false);
  double top = -kInfinity;
  for (const Vec3& p : cube.positions) top = std::max(top, p.z());
  std::erase_if(cube.triangles, [&](const auto& t) {
    return std::ranges::all_of(t, [&](Index v) { return cube.positions[v].z() > top - 1e-9; });
  });
  const std::size_t left = cube.triangles.size();
  REQUIRE(diagnose(cube).find(SurfaceFault::open_rim));
  const SurfaceRepair repair = repair_surface(cube);
  CHECK(repair.is_fillable);
  CHECK(repair.surface.triangles.size() == left + 14);  // 16 vertices on the rim
  CHECK(internal::signed_volume_of(repair.surface) == Approx(8));
  REQUIRE(repair.done.size() == 1);
  CHECK(repair.done[0] == "target: 1 hole is covered, with 20 % of the surface's area");
}

TEST_CASE("A hole is covered also if a crossing elsewhere is left", "[mending][slow]") {
  TriangleMesh cube = spiked_cube();
  std::erase_if(cube.triangles, [&](const auto& t) {
    return std::ranges::all_of(t, [&](Index v) { return cube.positions[v].x() < -1 + 1e-9; });
  });
  REQUIRE(diagnose(cube).find(SurfaceFault::open_rim));
  const SurfaceRepair repair = repair_surface(cube);
  CHECK_FALSE(repair.is_fillable);
  CHECK_FALSE(diagnose(repair.surface).find(SurfaceFault::open_rim));
  CHECK(std::ranges::any_of(repair.done,
                            [](const std::string& done) { return done.find("target: 1 hole is covered") == 0; }));
}

TEST_CASE("Closed parts that lie on each other and have edges in common are united", "[mending]") {
  // A box on another one, whose faces there have other diagonals, and a tet in a corner of a box.
  TriangleMesh stack = box({0, 0, 0}, {1, 1, 1}, false);
  add(stack, box({0, 0, 1}, {1, 1, 3}, true));
  TriangleMesh corner = box({0, 0, 0}, {1, 1, 1}, false);
  add(corner, {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 3, 2}, {0, 1, 3}, {1, 2, 3}}});
  for (const auto& [surface, volume] : {std::pair(stack, 3.0), std::pair(corner, 1.0)}) {
    CAPTURE(volume);
    REQUIRE(diagnose(surface).find(SurfaceFault::face_contact));
    const SurfaceRepair repair = repair_surface(surface);
    CHECK(repair.is_fillable);
    CHECK_FALSE(repair.regions);
    CHECK(diagnose(repair.surface).is_fillable());
    CHECK(internal::signed_volume_of(repair.surface) == Approx(volume));
  }
}

TEST_CASE("Solids that touch with faces cut into other triangles become regions", "[mending]") {
  // Two boxes have a face in common, of which readers leave one; two others touch these with other diagonals.
  TriangleMesh four = box({0, 0, 0}, {1, 1, 1}, false);
  TriangleMesh upper = box({0, 0, 1}, {1, 1, 3}, false);
  upper.triangles.erase(upper.triangles.begin(), upper.triangles.begin() + 2);
  add(four, upper);
  add(four, box({1, 0, 0}, {2, 1, 1}, true));
  add(four, box({1, 0, 1}, {2, 1, 3}, true));
  const SurfaceRepair repair = repair_surface(four);
  CHECK(repair.is_fillable);
  const std::vector<double> volumes = volumes_of_regions(repair);
  REQUIRE(volumes.size() == 4);
  for (std::size_t i = 0; i < 4; ++i) CHECK(volumes[i] == Approx(i < 2 ? 1 : 2));
  REQUIRE_FALSE(repair.done.empty());
  CHECK_THAT(repair.done[0],
             Catch::Contains("overlap in one plane") && Catch::Contains("cut along each other's edges"));
  // A small box on a large one, and one that sticks out over its edge. Without RegionRule::keep they are united.
  TriangleMesh three = box({0, 0, 0}, {4, 4, 1}, false);
  add(three, box({1, 1, 1}, {2, 2.5, 2}, true));
  add(three, box({3, 1.5, 1}, {5, 3.25, 1.5}, false));
  CHECK_FALSE(repair_surface(three).regions);
  const std::vector<double> kept = volumes_of_regions(repair_surface(three, {}, RegionRule::keep));
  REQUIRE(kept.size() == 3);
  CHECK(kept[0] == Approx(1.5));
  CHECK(kept[1] == Approx(1.75));
  CHECK(kept[2] == Approx(16));
}

TEST_CASE("A sheet is refused, and the message says what can be made of it", "[mending]") {
  TriangleMesh sheet;
  constexpr int kSide = 6;
  for (int i = 0; i <= kSide; ++i)
    for (int j = 0; j <= kSide; ++j) sheet.positions.emplace_back(i, j, 0.3 * std::sin(i + 0.5 * j));
  for (Index i = 0; i < kSide; ++i)
    for (Index j = 0; j < kSide; ++j) {
      const Index a = i * (kSide + 1) + j, b = a + kSide + 1;
      sheet.triangles.push_back({a, b, b + 1});
      sheet.triangles.push_back({a, b + 1, a + 1});
    }
  CHECK_THROWS_WITH(repair_surface(sheet), Catch::Contains("A sheet bounds no solid") && Catch::Contains("`shell`"));
}

TEST_CASE("Of a two-sided surface one side is left", "[mending]") {
  const TriangleMesh cube = cube_surface(4, false);
  TriangleMesh both = cube;
  const auto first = static_cast<Index>(cube.positions.size());  // the second side has vertices of its own
  both.positions.insert(both.positions.end(), cube.positions.begin(), cube.positions.end());
  for (const auto& [a, b, c] : cube.triangles) both.triangles.push_back({first + b, first + a, first + c});
  const SurfaceRepair repair = repair_surface(both);
  CHECK(repair.is_fillable);
  CHECK(repair.surface.triangles.size() == cube.triangles.size());
  CHECK(internal::signed_volume_of(repair.surface) == Approx(8));
  REQUIRE(repair.done.size() == 1);
  CHECK(repair.done[0] == "target: 192 triangles are there with both orientations; one of each is left");
  // Solids that touch share some of their triangles only.
  TriangleMesh touching = cube;
  for (const Vec3& p : cube.positions) touching.positions.push_back(p + Vec3(2, 0, 0));
  for (const auto& [a, b, c] : cube.triangles) touching.triangles.push_back({first + a, first + b, first + c});
  CHECK_FALSE(internal::without_second_sides(touching));
}

TEST_CASE("A surface that even a wrap does not follow is refused", "[slow][mending]") {
  CHECK_THROWS_WITH(repair_surface(triangle_soup(100, 0.3, 4)),
                    Catch::Contains("pairs of triangles cross") && Catch::Contains("it bounds no solid: even a wrap"));
}

TEST_CASE("Sheets divide the inside only of surfaces that do not cross everywhere", "[mending][slow]") {
  TriangleMesh cube = cube_surface(4, false);
  const auto first = static_cast<Index>(cube.positions.size());
  for (int i = -2; i <= 2; ++i)
    for (int j = -2; j <= 2; ++j) cube.positions.emplace_back(i / 2.0, j / 2.0, 0);
  for (Index i = 0; i < 4; ++i)
    for (Index j = 0; j < 4; ++j) {
      const Index a = first + 5 * i + j, b = a + 5;
      cube.triangles.push_back({a, b, b + 1});
      cube.triangles.push_back({a, b + 1, a + 1});
    }
  REQUIRE(repair_surface(cube).regions);
  const auto with_soup = [&](std::size_t triangles) {
    TriangleMesh mesh = cube, soup = triangle_soup(triangles, 0.3, 4);
    const auto start = static_cast<Index>(mesh.positions.size());
    for (const Vec3& p : soup.positions) mesh.positions.push_back(0.6 * p);
    for (const auto& [a, b, c] : soup.triangles) mesh.triangles.push_back({start + a, start + b, start + c});
    return mesh;
  };
  CHECK_THROWS_WITH(repair_surface(with_soup(20)), Catch::Contains("divide the inside into regions"));
  const SurfaceRepair repair = repair_surface(with_soup(400));  // triangles inside of the wrap may leave voids
  CHECK(repair.is_fillable);
  CHECK(internal::signed_volume_of(repair.surface) == Approx(8).epsilon(0.1));
}

TEST_CASE("A repair that is cancelled returns the surface as it was given, at whichever step", "[mending][slow]") {
  const TriangleMesh cube = cube_surface(4, false);
  TriangleMesh open = cube, finned = cube, crossing = cube, two_sided = cube, sheet = cube, untidy = folded_cube(0.001);
  open.triangles.resize(open.triangles.size() - 20);
  const auto [a, b, c] = cube.triangles[0];
  const auto m = static_cast<Index>(cube.positions.size());
  finned.triangles.push_back({a, b, m});
  finned.positions.push_back(1.5 * cube.positions[a]);
  for (const Vec3& p : cube.positions) crossing.positions.push_back(p + Vec3(1.1, 0.3, 0.2));
  for (const auto& [i, j, k] : cube.triangles) crossing.triangles.push_back({m + i, m + j, m + k});
  for (const auto& [i, j, k] : cube.triangles) two_sided.triangles.push_back({i, k, j});
  sheet.positions.push_back(4 * cube.positions[a]);
  sheet.positions.push_back(sheet.positions[m] + Vec3(3, -5, 0));
  sheet.triangles.push_back({a, b, m});
  sheet.triangles.push_back({b, m + 1, m});
  std::swap(untidy.triangles[7][0], untidy.triangles[7][1]);
  for (const TriangleMesh& given : {open, finned, crossing, two_sided, sheet, untidy, folded_cube(0.001)}) {
    std::size_t calls = 0;
    const SurfaceRepair whole = repair_surface(given, [&] { return ++calls, false; });
    REQUIRE(whole.done.size() > 0);
    const std::size_t all = calls;
    for (std::size_t n = 1; n <= all; n = n < 4 || n == all ? n + 1 : std::min(n + n / 2, all)) {
      calls = 0;
      bool is_cancelled = false;
      const SurfaceRepair repair = repair_surface(given, [&] { return ++calls == n && (is_cancelled = true); });
      if (!is_cancelled) break;  // how often it is asked depends on time
      CAPTURE(n, all);
      CHECK(repair.surface.triangles == given.triangles);
      CHECK(repair.surface.positions == given.positions);
      CHECK(repair.done.empty());
      CHECK(repair.notes.empty());
      CHECK_FALSE(repair.is_fillable);
    }
  }
}

TEST_CASE("A part that points inward beside others that do not is turned", "[mending]") {
  TriangleMesh cubes = cube_surface(2, false);
  const TriangleMesh other = cubes;
  const auto first = static_cast<Index>(cubes.positions.size());
  for (const Vec3& p : other.positions) cubes.positions.push_back(p / 2 + Vec3(5, 0, 0));
  for (const auto& [a, b, c] : other.triangles) cubes.triangles.push_back({first + a, first + c, first + b});
  const SurfaceRepair repair = repair_surface(cubes);
  CHECK(repair.is_fillable);
  REQUIRE(repair.done.size() == 1);
  CHECK(repair.done[0].find("1 part points inward") != std::string::npos);
  CHECK(repair.done[0].ends_with("; turned"));
  CHECK(internal::signed_volume_of(repair.surface) == Approx(9));
  // A surface that is inside out as a whole stays as it is.
  for (auto& t : cubes.triangles)
    if (t[0] < first) std::swap(t[1], t[2]);
  const SurfaceRepair same = repair_surface(cubes);
  CHECK(same.done.empty());
  CHECK(same.surface.triangles == cubes.triangles);
}

TEST_CASE("A fin is left out before a surface is filled", "[mending]") {
  TriangleMesh cube = cube_surface(4, false);
  const auto [a, b, c] = cube.triangles[0];
  cube.triangles.push_back({a, b, static_cast<Index>(cube.positions.size())});
  cube.positions.push_back(1.5 * cube.positions[a]);
  REQUIRE(diagnose(cube).find(SurfaceFault::fin));
  const SurfaceRepair repair = repair_surface(cube);
  CHECK(repair.is_fillable);
  CHECK(repair.surface.triangles.size() + 1 == cube.triangles.size());
  REQUIRE(repair.done.size() == 1);
  CHECK_THAT(repair.done[0], Catch::StartsWith("target: 1 triangle of fins left out"));
}

TEST_CASE("What crosses after parts are united is told", "[mending][slow]") {
  // Two cubes that cross; a spike of one goes through its opposite side.
  TriangleMesh both = cube_surface(6, false);
  const TriangleMesh cube = both;
  const auto first = static_cast<Index>(cube.positions.size());
  for (const Vec3& p : cube.positions) both.positions.push_back(p + Vec3(1.1, 0.3, 0.2));
  for (const auto& [a, b, c] : cube.triangles) both.triangles.push_back({first + a, first + b, first + c});
  Eigen::AlignedBox3d box;
  for (const Vec3& p : cube.positions) box.extend(p);
  for (Index v = 0; v < first; ++v)
    if ((cube.positions[v] - Vec3(box.center().x(), box.center().y(), box.max().z())).norm() < 1e-9)
      both.positions[v].z() -= 1.2 * box.sizes().z();
  const SurfaceRepair repair = repair_surface(both);
  CHECK_FALSE(repair.is_fillable);
  CHECK_THAT(repair.done.back(), Catch::EndsWith("are united"));
  REQUIRE(repair.notes.size() == 1);
  CHECK_THAT(repair.notes[0], Catch::EndsWith("left as it is"));
}

TEST_CASE("A surface that bounds no solid after its repair is wrapped", "[mending][slow]") {
  // A cube with a sheet on an edge that is too large for a fin.
  TriangleMesh cube = cube_surface(4, false);
  const auto [a, b, c] = cube.triangles[0];
  const auto m = static_cast<Index>(cube.positions.size());
  cube.positions.push_back(4 * cube.positions[a]);
  cube.positions.push_back(cube.positions[m] + Vec3(3, -5, 0));
  cube.triangles.push_back({a, b, m});
  cube.triangles.push_back({b, m + 1, m});
  for (const bool inward : {false, true}) {
    if (inward)
      for (auto& t : cube.triangles) std::swap(t[1], t[2]);
    const SurfaceRepair repair = repair_surface(cube);
    CHECK(repair.is_fillable);
    REQUIRE(repair.done.size() == 1);
    CHECK_THAT(
        repair.done[0],
        Catch::Contains("it bounds no solid, and is wrapped with voxels of 0.5 % of its diagonal; the wrap is ") &&
            Catch::Contains(" % off the surface on average, and at most "));
    CHECK(diagnose(repair.surface).is_fillable());
    CHECK(internal::signed_volume_of(repair.surface) == Approx(8).epsilon(0.03));
  }
  // Where every enclosed part is to be a region, nothing is wrapped.
  CHECK_FALSE(repair_surface(cube, {}, RegionRule::keep).is_fillable);
}
