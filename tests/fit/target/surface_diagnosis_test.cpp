// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/target/surface_diagnosis.h"
#include "subvol/base/error.h"
#include "subvol/fit/mending/surface_repair.h"
#include "subvol/surface/solid_topology.h"
#include "tests/support/region_fixtures.h"

#include <Eigen/Geometry>

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

using namespace subvol;
using test::box_surface;
using test::together;
using test::turned;

namespace {

std::size_t count(const SurfaceDiagnosis& diagnosis, SurfaceFault fault) {
  const SurfaceFinding* found = diagnosis.find(fault);
  return found ? found->count : 0;
}

const TriangleMesh kUnit = box_surface({0, 0, 0}, {1, 1, 1});

}  // namespace

TEST_CASE("A clean box can be filled, and its wall is as thick as it is", "[diagnosis]") {
  const SurfaceDiagnosis found = diagnose(box_surface({0, 0, 0}, {1, 1, 0.01}));
  CHECK(found.is_fillable());
  CHECK(found.parts.size() == 1);
  CHECK(found.volume == Approx(0.01));
  REQUIRE(found.findings.size() == 1);
  const SurfaceFinding& wall = found.findings.front();
  CHECK(wall.fault == SurfaceFault::thin_wall);
  CHECK(wall.places.front().measure == Approx(0.01));
}

TEST_CASE("Crossing parts are told with their triangles and places, and united", "[diagnosis]") {
  const TriangleMesh surface = together(kUnit, box_surface({0.5, 0.25, 0.25}, {2, 0.75, 0.75}));
  const SurfaceDiagnosis found = diagnose(surface);
  CHECK(!found.is_fillable());
  const SurfaceFinding* crossing = found.find(SurfaceFault::crossing);
  REQUIRE(crossing);
  CHECK(crossing->places.size() == std::min(crossing->count, kMostPlaces));
  for (const SurfacePlace& place : crossing->places) {
    CHECK(place.at.x() == Approx(1));
    CHECK(place.parts == std::array<Index, 2>{0, 1});
    CHECK((place.triangles[0] < 48 && place.triangles[1] >= 48));
  }
  const SurfaceRepair repair = repair_surface(surface);
  CHECK(repair.done.size() == 1);
  CHECK(diagnose(repair.surface).is_fillable());
  const SolidBoundary solid = solid_boundary(repair.surface);
  CHECK(solid.topology == BettiNumbers{1, 0, 0});
  CHECK(solid.volume == Approx(1 + 0.25));
}

TEST_CASE("Parts that touch along a face are told and united", "[diagnosis]") {
  for (const double shift : {0.0, 0.3}) {  // the same triangles on the face, or others
    const TriangleMesh surface = together(kUnit, box_surface({1, shift, 0}, {2, 1 + shift, 1}));
    CHECK(count(diagnose(surface), SurfaceFault::face_contact) > 0);
    const SurfaceRepair repair = repair_surface(surface);
    CHECK(repair.done.size() == 1);
    const SolidBoundary solid = solid_boundary(repair.surface);
    CHECK(solid.topology == BettiNumbers{1, 0, 0});
    CHECK(solid.volume == Approx(2));
  }
}

TEST_CASE("Parts that share an edge or a corner stay two parts, and the place is told", "[diagnosis]") {
  const TriangleMesh edge = together(kUnit, box_surface({1, 1, 0}, {2, 2, 1}));
  SurfaceDiagnosis found = diagnose(edge);
  CHECK(found.is_fillable());
  CHECK(found.parts.size() == 2);
  REQUIRE(count(found, SurfaceFault::edge_contact) == 2);
  CHECK(found.find(SurfaceFault::edge_contact)->places.front().at.head<2>() == Eigen::Vector2d(1, 1));
  CHECK(solid_boundary(edge).topology == BettiNumbers{2, 0, 0});
  CHECK(solid_boundary(turned(edge)).topology == BettiNumbers{2, 0, 0});
  const TriangleMesh corner = together(kUnit, box_surface({1, 1, 1}, {2, 2, 2}));
  found = diagnose(corner);
  CHECK(found.is_fillable());
  REQUIRE(count(found, SurfaceFault::vertex_contact) == 1);
  CHECK(found.find(SurfaceFault::vertex_contact)->places.front().at == Vec3(1, 1, 1));
  CHECK(solid_boundary(corner).topology == BettiNumbers{2, 0, 0});
  const SurfaceRepair repair = repair_surface(corner);
  CHECK(repair.done.empty());
  CHECK(repair.notes.size() == 1);
  CHECK(repair.surface.positions == corner.positions);
}

TEST_CASE("A corner that touches a face from outside is a contact at a point", "[diagnosis]") {
  TriangleMesh tip{{{0.3, 0.3, 1}, {0, 0, 2}, {1, 0, 2}, {0, 1, 2}}, {{0, 2, 1}, {0, 3, 2}, {0, 1, 3}, {1, 2, 3}}};
  const SurfaceDiagnosis found = diagnose(together(kUnit, tip));
  CHECK(count(found, SurfaceFault::crossing) == 0);
  REQUIRE(count(found, SurfaceFault::vertex_contact) > 0);
  CHECK((found.find(SurfaceFault::vertex_contact)->places.front().at - Vec3(0.3, 0.3, 1)).norm() < 1e-12);
}

TEST_CASE("Nested parts are told apart by how deep they lie", "[diagnosis]") {
  const TriangleMesh outer = box_surface({-2, -2, -2}, {2, 2, 2}), middle = box_surface({-1, -1, -1}, {1, 1, 1}),
                     inner = box_surface({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5});
  const TriangleMesh hollow = together(outer, turned(middle));
  CHECK(diagnose(hollow).is_fillable());
  CHECK(diagnose(hollow).volume == Approx(56));
  const TriangleMesh wrong = together(outer, middle);
  const SurfaceDiagnosis found = diagnose(wrong);
  REQUIRE(count(found, SurfaceFault::wall_outward) == 1);
  CHECK(found.find(SurfaceFault::wall_outward)->places.front().parts == std::array<Index, 2>{1, 0});
  CHECK(solid_boundary(wrong).topology == BettiNumbers{1, 0, 1});
  CHECK(repair_surface(wrong).regions);  // it does not face inward
  const SurfaceRepair repair = repair_surface(wrong, {}, RegionRule::merge);
  CHECK(!repair.regions);
  CHECK(repair.done.size() == 1);
  CHECK(diagnose(repair.surface).is_fillable());
  const TriangleMesh floating = together(hollow, inner);
  CHECK(count(diagnose(floating), SurfaceFault::part_in_void) == 1);
  CHECK(diagnose(floating).is_fillable());
  CHECK(solid_boundary(floating).topology == BettiNumbers{2, 0, 1});
  CHECK(solid_boundary(together(wrong, inner)).topology == BettiNumbers{2, 0, 1});
  CHECK(solid_boundary(turned(floating)).topology == BettiNumbers{2, 0, 1});
}

TEST_CASE("A surface that is inside out is told as inward", "[diagnosis]") {
  const SurfaceDiagnosis found = diagnose(turned(kUnit));
  CHECK(count(found, SurfaceFault::part_inward) == 1);
  CHECK(found.is_fillable());
  CHECK(found.volume == Approx(1));
}

TEST_CASE("Holes are told with their rims, short ones as pinholes", "[diagnosis][slow]") {
  TriangleMesh open = kUnit;
  open.triangles.pop_back();
  SurfaceDiagnosis found = diagnose(open);
  CHECK(!found.is_fillable());
  REQUIRE(count(found, SurfaceFault::open_rim) == 1);
  CHECK(found.find(SurfaceFault::open_rim)->places.front().measure == Approx(1 + std::sqrt(0.5)));
  TriangleMesh ball = test::cube_surface(40, true);
  ball.triangles.pop_back();
  found = diagnose(ball);
  CHECK(count(found, SurfaceFault::pinhole) == 1);
  CHECK(count(found, SurfaceFault::open_rim) == 0);
  CHECK(repair_surface(ball).notes.size() == 1);
}

TEST_CASE("Holes that touch at a vertex are several, and each is closed by itself", "[diagnosis]") {
  TriangleMesh cube = test::cube_surface(4, false);
  const auto at = [&](Index v) {
    std::vector<std::size_t> around;
    for (std::size_t t = 0; t < cube.triangles.size(); ++t)
      if (std::ranges::count(cube.triangles[t], v) > 0) around.push_back(t);
    return around;
  };
  std::array<std::size_t, 2> removed{};
  for (Index v = 0; removed[1] == 0; ++v)
    for (const std::size_t t : at(v))
      for (const std::size_t s : at(v)) {
        const auto& corners = cube.triangles[s];
        if (std::ranges::count_if(cube.triangles[t], [&](Index w) { return std::ranges::count(corners, w) > 0; }) == 1)
          removed = {std::min(t, s), std::max(t, s)};
      }
  for (const std::size_t t : {removed[1], removed[0]})
    cube.triangles.erase(cube.triangles.begin() + static_cast<long>(t));
  for (const bool disagrees : {false, true}) {
    if (disagrees)
      for (std::size_t t = 0; t < cube.triangles.size(); t += 3) std::swap(cube.triangles[t][0], cube.triangles[t][1]);
    const SurfaceDiagnosis found = diagnose(cube);
    CHECK(count(found, SurfaceFault::open_rim) + count(found, SurfaceFault::pinhole) == 2);
    CHECK(found.find(SurfaceFault::open_rim)->places.front().measure < 2);  // of one triangle
    const SolidBoundary solid = solid_boundary(cube);
    CHECK(solid.closed_holes == 2);
    CHECK(solid.topology == BettiNumbers{1, 0, 0});
    CHECK(solid.volume == Approx(8));
  }
}

TEST_CASE("A flap is a fin, and a sheet through the inside divides it into regions", "[diagnosis]") {
  TriangleMesh flap{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {2, 2, 2}},
                    {{0, 2, 1}, {0, 3, 2}, {0, 1, 3}, {1, 2, 3}, {1, 2, 4}}};
  SurfaceDiagnosis found = diagnose(flap);
  CHECK(count(found, SurfaceFault::fin) == 1);
  CHECK(!found.is_fillable());
  TriangleMesh divided{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, -1}},
                       {{0, 2, 1}, {0, 3, 2}, {0, 1, 3}, {1, 2, 3}, {0, 2, 4}, {0, 4, 1}, {1, 4, 2}}};
  found = diagnose(divided);
  CHECK(count(found, SurfaceFault::interface) == 3);
  CHECK(found.is_fillable());
  const SurfaceRepair kept = repair_surface(divided);
  REQUIRE(kept.regions);
  CHECK(kept.regions->volumes.size() == 2);
  CHECK(kept.done.empty());
  const SurfaceRepair merged = repair_surface(divided, {}, RegionRule::merge);
  CHECK(merged.surface.triangles.size() == 6);
  CHECK(merged.done.size() == 1);
  TriangleMesh crossed = together(divided, box_surface({0.1, 0.1, -0.2}, {0.4, 0.4, 0.2}));
  CHECK_THROWS_WITH(repair_surface(crossed), Catch::Contains("edges that they share"));
}

TEST_CASE("Gaps, sharp angles, turned and repeated triangles are told", "[diagnosis]") {
  const SurfaceDiagnosis gap = diagnose(together(kUnit, box_surface({1.002, 0, 0}, {2, 1, 1})));
  REQUIRE(count(gap, SurfaceFault::thin_gap) == 1);
  CHECK(gap.find(SurfaceFault::thin_gap)->places.front().measure == Approx(0.002));
  const TriangleMesh wedge{{{0, 0, 0}, {1, 0, 0}, {1, 0.1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 0.1, 1}},
                           {{0, 2, 1}, {3, 4, 5}, {0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}, {0, 3, 5}, {0, 5, 2}}};
  const SurfaceDiagnosis sharp = diagnose(wedge);
  REQUIRE(count(sharp, SurfaceFault::sharp_angle) == 1);
  CHECK(sharp.find(SurfaceFault::sharp_angle)->places.front().measure == Approx(5.7106).epsilon(1e-4));
  TriangleMesh odd = kUnit;
  std::swap(odd.triangles[0][1], odd.triangles[0][2]);
  CHECK(count(diagnose(odd), SurfaceFault::disagreement) == 3);
  TriangleMesh twice = kUnit;
  twice.triangles.push_back(twice.triangles[0]);
  CHECK(count(diagnose(twice), SurfaceFault::repeated_triangle) == 1);
}

TEST_CASE("What no diagnosis can be made of is refused", "[diagnosis]") {
  CHECK_THROWS_AS(diagnose({}), InputError);
  CHECK_THROWS_AS(diagnose({{{0, 0, 0}}, {{0, 1, 2}}}), InputError);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(diagnose({{{0, nan, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}}), InputError);
  CHECK(!diagnose({{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 2}}}).is_fillable());
  CHECK(!diagnose({{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}, {{0, 1, 2}}}).findings.empty());
  CHECK(!diagnose(test::triangle_soup(300, 0.5, 1)).is_fillable());
  CHECK(diagnose(kUnit, [] { return true; }).is_cancelled);
}

TEST_CASE("Why no grid has the topology is told with the place", "[diagnosis]") {
  const SurfaceDiagnosis plate = diagnose(box_surface({0, 0, 0}, {1, 1, 0.002}));
  const std::string text = why_no_grid(plate, 300, {1, 0, 0});
  CHECK_THAT(text, Catch::Contains("1 component") && Catch::Contains("thinnest wall is 0.002 wide") &&
                       Catch::Contains("thinner than a cell"));
  CHECK_FALSE(is_too_thin_for_grids(plate, 300));  // its cells are 0.0069 wide
  CHECK_FALSE(is_too_thin_for_grids(diagnose(box_surface({0, 0, 0}, {1, 1, 0.1})), 300));
  const SurfaceDiagnosis slit = diagnose(together(kUnit, box_surface({1.0002, 0, 0}, {2, 1, 1})));
  CHECK(is_too_thin_for_grids(slit, 3000));
  CHECK_FALSE(is_too_thin_for_grids(slit, 30'000'000));
}

TEST_CASE("Boxes that touch in a face with different diagonals are in contact, whatever rounding says",
          "[diagnosis][regions]") {
  for (int turn = 0; turn < 12; ++turn) {
    // The face between the boxes is there twice, with a diagonal from vertex 4 and one from vertex 5.
    TriangleMesh surface;
    const Mat3 rotation =
        Eigen::AngleAxisd(0.3 + 0.7 * turn, Vec3(1 + turn, 2, 3 - turn).normalized()).toRotationMatrix();
    for (const double z : {0.0, 1.0, 2.3})
      for (const auto& [x, y] : {std::pair(0, 0), std::pair(1, 0), std::pair(1, 1), std::pair(0, 1)})
        surface.positions.push_back(rotation * Vec3(x, y, z) + Vec3(0.1 * turn, -1, 2));
    for (const Index low : {0, 4})
      for (Index i = 0; i < 4; ++i) {
        const Index a = low + i, b = low + (i + 1) % 4;
        surface.triangles.push_back({a, b, b + 4});
        surface.triangles.push_back({a, b + 4, a + 4});
      }
    for (const std::array<Index, 3>& t : {std::array<Index, 3>{0, 3, 2},
                                          {0, 2, 1},
                                          {4, 5, 6},
                                          {4, 6, 7},
                                          {5, 4, 7},
                                          {5, 7, 6},
                                          {8, 9, 10},
                                          {8, 10, 11}})
      surface.triangles.push_back(t);
    CHECK(count(diagnose(surface), SurfaceFault::face_contact) == 4);
    CHECK(!find_regions(surface));
    const SurfaceRepair repair = repair_surface(surface);
    CHECK(repair.is_fillable);
    CHECK(solid_boundary(repair.surface).volume == Approx(2.3).epsilon(0.01));
    surface.triangles[20] = {5, 4, 6};  // now with the same diagonal: an interface
    surface.triangles[21] = {7, 6, 4};
    REQUIRE(find_regions(surface));
    CHECK(find_regions(surface)->regions.size() == 2);
    CHECK(count(diagnose(surface), SurfaceFault::face_contact) == 2);
  }
}
