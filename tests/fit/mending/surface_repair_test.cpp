// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/mending/surface_repair.h"

#include "subvol/fit/geometry/surface_distance.h"
#include "subvol/fit/mending/mend_surface.h"
#include "subvol/surface/boundary.h"
#include "subvol/surface/welded_surface.h"
#include "tests/support/surface_fixtures.h"

#include <catch2/catch.hpp>

#include <Eigen/Geometry>

#include <cmath>

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

TEST_CASE("A spike through the opposite side is left and told", "[mending]") {
  TriangleMesh cube = cube_surface(4, false);
  Eigen::AlignedBox3d box;
  for (const Vec3& p : cube.positions) box.extend(p);
  for (Vec3& p : cube.positions)
    if ((p - Vec3(box.center().x(), box.center().y(), box.max().z())).norm() < 1e-9) p.z() -= 1.2 * box.sizes().z();
  const SurfaceRepair repair = repair_surface(cube);
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
  // A hole is none.
  TriangleMesh open = cube;
  open.triangles.resize(open.triangles.size() - 20);
  CHECK(repair_surface(open).surface.triangles == open.triangles);
}

TEST_CASE("A surface that can be filled as it is is not mended", "[mending]") {
  const TriangleMesh cube = cube_surface(4, false);
  const SurfaceRepair repair = repair_surface(cube);
  CHECK(repair.is_fillable);
  CHECK(repair.done.empty());
  CHECK(repair.surface.positions == cube.positions);
}
