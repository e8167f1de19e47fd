// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/geometry/normal_deviation.h"
#include "subvol/fit/geometry/closest_point.h"

#include "subvol/base/error.h"
#include "tests/support/surface_fixtures.h"

#include <catch2/catch.hpp>

#include <cmath>
#include <numbers>
#include <utility>

using namespace subvol;
using namespace subvol::test;

namespace {

NormalDeviation deviation(const TriangleMesh& fitted, const TriangleMesh& target) {
  return normal_deviation(fitted, ClosestPoint(fitted), target, ClosestPoint(target), 20000);
}

/// A square of side 1, folded by an angle along x = 0.5: two halves that rise on either side.
TriangleMesh folded_square(double degrees) {
  const double rise = 0.5 * std::tan(degrees * std::numbers::pi / 180);
  return {{{0, 0, rise}, {0.5, 0, 0}, {1, 0, rise}, {0, 1, rise}, {0.5, 1, 0}, {1, 1, rise}},
          {{0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}}};
}

}  // namespace

TEST_CASE("normals: a surface does not deviate from itself, whichever way its triangles face") {
  TriangleMesh sphere = cube_surface(8, true);
  CHECK(deviation(sphere, sphere).mean_degrees == Approx(0).margin(1e-6));
  TriangleMesh turned = sphere;
  for (auto& triangle : turned.triangles) std::swap(triangle[0], triangle[1]);
  const NormalDeviation found = deviation(turned, sphere);
  CHECK(found.mean_degrees == Approx(0).margin(1e-6));
  CHECK(found.percentile_95_degrees == 0.5);  // the first bin
}

TEST_CASE("normals: a fold deviates from the plane by its angle") {
  const NormalDeviation found = deviation(folded_square(10.2), folded_square(0));
  CHECK(found.mean_degrees == Approx(10.2));
  CHECK(found.percentile_95_degrees == 10.5);
}

TEST_CASE("normals: a surface without area does not deviate") {
  const TriangleMesh flat{{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 2}}};
  CHECK(deviation(flat, folded_square(0)).mean_degrees == 0);
  CHECK(deviation(folded_square(0), flat).mean_degrees == 0);
}
