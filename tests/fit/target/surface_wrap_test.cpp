// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/target/surface_wrap.h"
#include "subvol/base/error.h"
#include "subvol/fit/geometry/closest_point.h"
#include "subvol/fit/geometry/surface_distance.h"
#include "subvol/surface/solid_topology.h"
#include "tests/support/surface_fixtures.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

using namespace subvol;

namespace {

/// A ball of radius 1 whose cap above a height is missing, and a bar of 0.4 x 0.4 through it along x, from -2 to 2,
/// with groups: 1 the ball, 2 the bar. They cross, and the ball is open.
TriangleMesh open_ball_with_bar(double height) {
  const TriangleMesh ball = test::cube_surface(24, true);
  TriangleMesh surface{.positions = ball.positions};
  for (const auto& triangle : ball.triangles) {
    double low = 1;
    for (const Index v : triangle) low = std::min(low, ball.positions[v].z());
    if (low < height) surface.triangles.push_back(triangle);
  }
  surface.face_groups.groups = {{"ball", 1}, {"bar", 2}};
  surface.face_groups.of_face.assign(surface.triangles.size(), 0);
  const auto first = static_cast<Index>(surface.positions.size());
  const TriangleMesh bar = test::cube_surface(2, false);
  for (const Vec3& p : bar.positions) surface.positions.push_back(p.cwiseProduct(Vec3(2, 0.2, 0.2)));
  for (const auto& [a, b, c] : bar.triangles) {
    surface.triangles.push_back({first + a, first + b, first + c});
    surface.face_groups.of_face.push_back(1);
  }
  return surface;
}

}  // namespace

TEST_CASE("A wrap closes holes and unites what crosses", "[surface_wrap][slow]") {
  const TriangleMesh open = open_ball_with_bar(0.9);
  const TriangleMesh wrap = wrap_surface(open, {.voxel_percent = 1});
  const SolidBoundary solid = solid_boundary(wrap);
  CHECK(solid.topology == BettiNumbers{1, 0, 0});
  // The ball without its cap, and two arms of the bar, whose ends begin where the ball ends.
  const double arms = 2 * (2 - 0.98) * 0.16;
  CHECK(solid.volume == Approx(4.0 / 3 * std::numbers::pi + arms).epsilon(0.02));
  const ClosestPoint tree(open);
  for (const Vec3& p : wrap.positions)
    if (p.z() < 0.8) CHECK(tree.closest(p).distance < 0.015 * bounding_box_diagonal(open));
  REQUIRE(wrap.face_groups.groups.size() == 2);
  for (std::size_t t = 0; t < wrap.triangles.size(); ++t) {
    const Vec3 middle = (wrap.positions[wrap.triangles[t][0]] + wrap.positions[wrap.triangles[t][1]] +
                         wrap.positions[wrap.triangles[t][2]]) /
                        3;
    if (std::abs(middle.x()) > 1.1) CHECK(wrap.face_groups.of_face[t] == 1);
    if (std::abs(middle.y()) > 0.5) CHECK(wrap.face_groups.of_face[t] == 0);
  }
}

TEST_CASE("A wrap keeps voids, and a sheet that sticks out does not matter", "[surface_wrap]") {
  TriangleMesh surface = test::cube_surface(6, false);
  const auto outer = static_cast<Index>(surface.positions.size());
  for (std::size_t v = 0; v < static_cast<std::size_t>(outer); ++v)
    surface.positions.push_back(0.5 * surface.positions[v]);
  const std::size_t num_triangles = surface.triangles.size();
  for (std::size_t t = 0; t < num_triangles; ++t) {
    const auto [a, b, c] = surface.triangles[t];
    surface.triangles.push_back({outer + a, outer + c, outer + b});
  }
  surface.positions.emplace_back(3, 3, 3);
  const auto [a, b, c] = surface.triangles[0];
  surface.triangles.push_back({a, b, static_cast<Index>(surface.positions.size()) - 1});
  const SolidBoundary solid = solid_boundary(wrap_surface(surface, {.voxel_percent = 1}));
  CHECK(solid.topology == BettiNumbers{1, 0, 1});
  CHECK(solid.volume == Approx(7).epsilon(0.02));
}

TEST_CASE("A wrap refuses what has no inside, and can be cancelled", "[surface_wrap][slow]") {
  TriangleMesh inward = test::cube_surface(2, false);
  for (auto& triangle : inward.triangles) std::swap(triangle[1], triangle[2]);
  CHECK_THROWS_WITH(wrap_surface(inward), Catch::Contains("nothing is inside"));
  CHECK_THROWS_AS(wrap_surface({}), InputError);
  TriangleMesh point = test::cube_surface(2, false);
  for (Vec3& p : point.positions) p.setZero();
  CHECK_THROWS_WITH(wrap_surface(point), Catch::Contains("at one point"));
  CHECK_THROWS_WITH(wrap_surface(inward, {.voxel_percent = 0}), Catch::Contains("voxel_percent"));
  CHECK(wrap_surface(test::cube_surface(2, false), {}, [] { return true; }).triangles.empty());
}
