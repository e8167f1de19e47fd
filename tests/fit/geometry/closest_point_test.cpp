// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/geometry/closest_point.h"

#include "tests/support/surface_fixtures.h"

#include <catch2/catch.hpp>

#include <random>

using namespace subvol;

TEST_CASE("the closest point within a distance is the closest point if it is nearer, else none") {
  const ClosestPoint tree(test::triangle_soup(300, 0.2, 5));
  std::mt19937 random(7);
  std::uniform_real_distribution<double> coordinate(-1.5, 1.5), share(0.3, 1.7);
  for (int i = 0; i < 500; ++i) {
    const Vec3 p(coordinate(random), coordinate(random), coordinate(random));
    const ClosestPoint::Hit closest = tree.closest(p);
    const double distance = share(random) * closest.distance;
    const ClosestPoint::Hit within = tree.closest_within(p, distance);
    if (closest.distance < distance) {
      CHECK(within.triangle != kNoIndex);
      CHECK(within.distance == Approx(closest.distance).epsilon(1e-12));
      CHECK(within.point.isApprox(closest.point, 1e-9));
    } else {
      CHECK(within.triangle == kNoIndex);
      CHECK(within.distance == distance);
    }
  }
}
