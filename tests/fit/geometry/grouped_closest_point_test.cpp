// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/geometry/grouped_closest_point.h"
#include "subvol/fit/geometry/closest_point.h"

#include "subvol/base/error.h"
#include "tests/support/surface_fixtures.h"

#include <catch2/catch.hpp>

#include <random>

using namespace subvol;
using namespace subvol::internal;

TEST_CASE("Closest points of a group lie on its triangles, and agree with a tree of them alone") {
  const TriangleMesh cube = test::cube_surface(4, false);
  std::vector<Index> groups;
  for (std::size_t t = 0; t < cube.triangles.size(); ++t) groups.push_back(static_cast<Index>(t % 3 == 0 ? 0 : 2));
  GroupedClosestPoint grouped(cube, groups);
  const ClosestPoint all(cube);
  TriangleMesh part{cube.positions, {}};
  for (std::size_t t = 0; t < groups.size(); ++t)
    if (groups[t] == 0) part.triangles.push_back(cube.triangles[t]);
  const ClosestPoint alone(part);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(-2, 2);
  std::vector<Vec3> points(50);
  for (Vec3& p : points) p = Vec3(place(random), place(random), place(random));
  std::vector<ClosestPoint::Hit> hits(points.size());
  grouped.closest(points, std::vector<Index>(points.size(), 0), hits);
  for (std::size_t i = 0; i < points.size(); ++i) {
    CHECK(groups[hits[i].triangle] == 0);
    CHECK(hits[i].distance == Approx(alone.closest(points[i]).distance));
    // A hint from another group has no effect; a group without triangles, and none, mean all triangles.
    CHECK(grouped.closest(points[i], 0, 1).distance == Approx(hits[i].distance));
    for (const Index group : {Index{1}, kNoIndex})
      CHECK(grouped.closest(points[i], group).distance == Approx(all.closest(points[i]).distance));
  }
  std::vector<Vec3> moved = cube.positions;
  for (Vec3& p : moved) p.x() += 1;
  grouped.move(moved);
  CHECK(grouped.closest(points[0] + Vec3(1, 0, 0), 0).distance == Approx(hits[0].distance));
  CHECK_THROWS_AS(GroupedClosestPoint(cube, std::vector<Index>{0}), InputError);
}
