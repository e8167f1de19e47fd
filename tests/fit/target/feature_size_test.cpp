// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/target/feature_size.h"
#include "subvol/fit/geometry/closest_point.h"

#include "samples/shapes.h"
#include "subvol/base/error.h"
#include "tests/support/feature_fixtures.h"
#include "tests/support/surface_fixtures.h"

#include <catch2/catch.hpp>

#include <algorithm>

using namespace subvol;
using namespace subvol::test;

namespace {

FeatureSizes sizes_of(const TriangleMesh& mesh, double most, double least = 0) {
  return feature_sizes(TargetSurface(mesh, {.sample_spacing = 0.05}), ClosestPoint(mesh), least, most);
}

/// The cube [-1, 1]^3, scaled along z.
TriangleMesh plate(double thickness) {
  TriangleMesh mesh = cube_surface(4, false);
  for (Vec3& p : mesh.positions) p.z() *= thickness / 2;
  return mesh;
}

}  // namespace

TEST_CASE("features: the size of a wall is half its thickness, wherever its sides are opposite") {
  const FeatureSizes sizes = sizes_of(plate(0.1), 0.5);
  REQUIRE(!sizes.points.empty());
  for (std::size_t i = 0; i < sizes.sizes.size(); ++i) {
    CHECK(sizes.sizes[i] == Approx(0.05).epsilon(0.03));
    CHECK(std::abs(sizes.points[i].z()) == Approx(0.05));  // no point of the rim
  }
  CHECK(sizes_of(plate(0.1), 0.5, 0.06).points.empty());
  CHECK_THROWS_AS(sizes_of(plate(0.1), 0.5, 0.5), InputError);
}

TEST_CASE("features: the size of a pin is its radius") {
  const TriangleMesh pin = prism_surface(32);  // radius about 1
  const FeatureSizes sizes = sizes_of(pin, 10);
  REQUIRE(!sizes.points.empty());
  for (const double size : sizes.sizes) CHECK(size <= 1.05);
  CHECK(*std::max_element(sizes.sizes.begin(), sizes.sizes.end()) >= 0.9);
}

TEST_CASE("features: a cube has none, however sharp its edges are") {
  CHECK(sizes_of(cube_surface(4, false), 0.9).points.empty());
}

TEST_CASE("features: the largest miss is a share of the size") {
  const FeatureSizes sizes = sizes_of(plate(0.1), 0.5);
  const auto miss = largest_feature_miss(sizes, feature_distances(sizes, ClosestPoint(plate(0.12))));
  REQUIRE(miss);
  CHECK(miss->distance == Approx(0.01));
  CHECK(miss->share == Approx(0.01 / miss->size));
  const ClosestPoint same(plate(0.1));
  CHECK(largest_feature_miss(sizes, feature_distances(sizes, same))->share == Approx(0).margin(1e-12));
  CHECK(!largest_feature_miss({}, feature_distances({}, same)));
}

TEST_CASE("features: a small one that is missed more does not hide a large one") {
  const FeatureSizes sizes{{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {0.1, 1, 2}};
  const std::vector<double> distances{0.5, 1.5, 2.5};
  CHECK(largest_feature_miss(sizes, distances)->size == 0.1);
  CHECK(largest_feature_miss(sizes, distances, 1)->size == 1);
  CHECK(largest_feature_miss(sizes, distances, 1.1)->size == 2);
  CHECK(!largest_feature_miss(sizes, distances, 2.1));
}

TEST_CASE("features: a radius that is not positive is refused") {
  CHECK_THROWS_AS(sizes_of(plate(0.1), 0), InputError);
}
