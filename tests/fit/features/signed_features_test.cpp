// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/signed_features.h"
#include "subvol/base/error.h"
#include "subvol/surface/triangle_geometry.h"
#include "tests/support/feature_fixtures.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <set>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

TEST_CASE("a cube has twelve convex edges of 90 degrees between six regions") {
  const SignedFeatures features = features_of(cube_surface(3, false));
  REQUIRE(features.angles.size() == 12);
  for (std::size_t c = 0; c < 12; ++c) {
    CHECK(features.angles[c] == Approx(90));
    CHECK(features.is_convex(static_cast<Index>(c)));
    REQUIRE(features.segment_angles[c].size() == 3);
    for (double angle : features.segment_angles[c]) CHECK(angle == Approx(90));
  }
  CHECK(features.num_regions == 6);
  REQUIRE(features.regions.size() == 6 * 18);
  for (std::size_t t = 0; t < features.regions.size(); ++t) CHECK(features.regions[t] == static_cast<Index>(t / 18));
}

TEST_CASE("the regions beside a curve are those on its left and right, as seen from outside") {
  const TriangleMesh target = cube_surface(3, false);
  const SignedFeatures features = features_of(target);
  REQUIRE(features.sides.size() == 12);
  for (std::size_t c = 0; c < 12; ++c) {
    const auto normal = [&](Index region) {
      return triangle_normal(
          target, static_cast<Index>(std::ranges::find(features.regions, region) - features.regions.begin()));
    };
    const auto& [left, right] = features.sides[c];
    const std::vector<Vec3>& points = features.curves.curves[c].points;
    CHECK(normal(left).cross(normal(right)).isApprox((points[1] - points[0]).normalized()));
    CHECK(features.sides[c].has(left));
    CHECK(!features.sides[c].has(kNoIndex));
  }
}

TEST_CASE("an L has one reflex edge, whatever the order of the triangles' corners") {
  TriangleMesh target = surface_of(l_shape(3));
  for (std::size_t t = 0; t < target.triangles.size(); ++t)
    std::rotate(target.triangles[t].begin(), target.triangles[t].begin() + t % 3, target.triangles[t].end());
  const SignedFeatures features = features_of(target);
  CHECK(features.num_regions == 8);
  CHECK(std::ranges::count_if(features.angles, [](double a) { return a == Approx(270); }) == 1);
  CHECK(std::ranges::count_if(features.angles, [](double a) { return a == Approx(90); }) == 17);
}

TEST_CASE("a tetrahedron's edges have its dihedral angle") {
  for (double angle : features_of(tetrahedron_surface()).angles) CHECK(angle == Approx(70.5288).epsilon(1e-5));
}

TEST_CASE("an inward target has the outer angles") {
  TriangleMesh target = cube_surface(1, false);
  for (auto& t : target.triangles) std::swap(t[0], t[1]);
  for (double angle : features_of(target).angles) CHECK(angle == Approx(270));
}

TEST_CASE("a curve leaves its ends in its own directions") {
  FeatureCurve curve;
  curve.vertices = {0, 1, 2};
  curve.points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}};
  CHECK(direction_at_end(curve, true, 0.5).isApprox(Vec3(1, 0, 0)));
  CHECK(direction_at_end(curve, false, 0.5).isApprox(Vec3(0, -1, 0)));
  CHECK(direction_at_end(curve, true, 1.2).isApprox(Vec3(1, 1, 0).normalized()));
  CHECK(direction_at_end(curve, true, 100).isApprox(Vec3(1, 1, 0).normalized()));
}

TEST_CASE("signed features refuse targets without an outside, and curves that are no edges") {
  const TriangleMesh target = cube_surface(2, false);
  const FeatureCurves curves = feature_curves(target, 40);
  TriangleMesh turned = target, torn = target, broken = target;
  std::swap(turned.triangles[0][0], turned.triangles[0][1]);
  CHECK_THROWS_AS(signed_features(turned, curves), InputError);
  torn.triangles.erase(torn.triangles.begin());
  CHECK_THROWS_AS(signed_features(torn, curves), InputError);
  broken.triangles[0][0] = -1;
  CHECK_THROWS_AS(signed_features(broken, curves), InputError);
  FeatureCurves elsewhere;
  elsewhere.curves.push_back({{0, 1'000'000}, {Vec3::Zero(), Vec3::Ones()}});
  CHECK_THROWS_AS(signed_features(target, elsewhere), InputError);
}

TEST_CASE("without curves, each connected part is one region") {
  const SignedFeatures features = features_of(cube_surface(4, true));
  CHECK(features.angles.empty());
  CHECK(features.num_regions == 1);
  CHECK(signed_features({}, {}).num_regions == 0);
}
