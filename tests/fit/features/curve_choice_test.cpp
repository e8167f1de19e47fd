// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/curve_choice.h"
#include "subvol/base/error.h"
#include "subvol/fit/features/feature_routing.h"
#include "tests/support/feature_fixtures.h"

#include <catch2/catch.hpp>

#include <algorithm>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

TEST_CASE("curves at poor cells are given up, joined ones only as joined ones at first") {
  const TriangleMesh target = cube_surface(2, false);
  RoutedLattice cube(target, 3);
  const PatchedMesh patched = cube.patched(target);
  std::vector<double> faults(27, 0.0);
  RoutingOptions options;
  CHECK_FALSE(give_up_poor_curves(patched, cube.features, cube.routing, faults, options));
  faults[13] = 1;  // the cell in the middle, which touches no path
  CHECK_FALSE(give_up_poor_curves(patched, cube.features, cube.routing, faults, options));

  faults[0] = 0.1;  // at a corner: three curves
  const auto at_corner = [&](Index c) {
    const FeatureCurve& curve = cube.features.curves.curves[c];
    return curve.points.front().isApprox(-Vec3::Ones()) || curve.points.back().isApprox(-Vec3::Ones());
  };
  CHECK(give_up_poor_curves(patched, cube.features, cube.routing, faults, options));
  REQUIRE(std::ranges::count(options.excluded, 1) == 1);
  CHECK(std::ranges::count(options.not_joined, 1) == 0);
  const auto first = static_cast<Index>(std::ranges::find(options.excluded, 1) - options.excluded.begin());
  CHECK(at_corner(first));
  CHECK(route_features(cube.fitted, cube.features, options).paths.size() == 11);

  RoutingOptions fresh;
  cube.routing.joined = {first};
  CHECK(give_up_poor_curves(patched, cube.features, cube.routing, faults, fresh));
  CHECK(std::ranges::count(fresh.excluded, 1) == 0);
  CHECK(fresh.not_joined[first] == 1);
  CHECK(give_up_poor_curves(patched, cube.features, cube.routing, faults, fresh));
  CHECK(std::ranges::count(fresh.excluded, 1) == 1);
}

TEST_CASE("giving up curves refuses arrays of other sizes") {
  const TriangleMesh target = cube_surface(2, false);
  const RoutedLattice cube(target, 2);
  const PatchedMesh patched = cube.patched(target);
  RoutingOptions options;
  CHECK_THROWS_AS(give_up_poor_curves(patched, cube.features, cube.routing, std::vector<double>(7), options),
                  InputError);
  CHECK_THROWS_AS(give_up_poor_curves(patched, {}, cube.routing, std::vector<double>(8), options), InputError);
  options.excluded.assign(3, 0);
  CHECK_THROWS_AS(give_up_poor_curves(patched, cube.features, cube.routing, std::vector<double>(8), options),
                  InputError);
}
