// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/geometry/surface_distance.h"
#include "subvol/base/error.h"
#include "subvol/fit/geometry/closest_point.h"
#include "tests/support/threads.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include <cmath>
#include <limits>
#include <random>

using namespace subvol;

namespace {

/// A sphere of 2 * n * n triangles about the origin.
TriangleMesh sphere(double radius, int n) {
  TriangleMesh mesh;
  const double pi = std::acos(-1.0);
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j < n; ++j) {
      const double polar = pi * i / n, azimuth = 2 * pi * j / n;
      mesh.positions.push_back(
          radius * Vec3(std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth), std::cos(polar)));
    }
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < n; ++j) {
      const Index a = i * n + j, b = i * n + (j + 1) % n, c = a + n, d = b + n;
      mesh.triangles.push_back({a, c, d});
      mesh.triangles.push_back({a, d, b});
    }
  return mesh;
}

TriangleMesh unit_square(double height) {
  return {{{0, 0, height}, {1, 0, height}, {1, 1, height}, {0, 1, height}}, {{0, 1, 2}, {0, 2, 3}}};
}

/// The obvious twin: a fine barycentric grid, or all triangles one by one.
double distance_by_grid(const TriangleMesh& mesh, const Vec3& p, int n) {
  double least = std::numeric_limits<double>::infinity();
  for (const auto& [a, b, c] : mesh.triangles)
    for (int i = 0; i <= n; ++i)
      for (int j = 0; i + j <= n; ++j) {
        const Vec3 q = mesh.positions[a] + (mesh.positions[b] - mesh.positions[a]) * i / n +
                       (mesh.positions[c] - mesh.positions[a]) * j / n;
        least = std::min(least, (p - q).norm());
      }
  return least;
}

}  // namespace

TEST_CASE("closest points agree with a search of all triangles, with and without hints", "[closest_point]") {
  std::mt19937_64 engine(1);
  std::normal_distribution<double> normal;
  TriangleMesh soup;
  for (Index t = 0; t < 300; ++t) {
    const Vec3 center(normal(engine), normal(engine), normal(engine));
    for (int k = 0; k < 3; ++k) {
      const Vec3 offset = 0.2 * Vec3(normal(engine), normal(engine), normal(engine));
      const bool point = t % 50 == 7, needle = t % 50 == 9;
      const Vec3 kept = point ? Vec3::Zero() : needle ? Vec3(offset[0], offset[0], 0) : offset;
      soup.positions.push_back(center + kept);
    }
    soup.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  const ClosestPoint tree(soup);
  for (int i = 0; i < 200; ++i) {
    const Vec3 p(normal(engine), normal(engine), normal(engine));
    const ClosestPoint::Hit hit = tree.closest(p), hinted = tree.closest(p, i);
    CHECK(hit.distance == Approx(hinted.distance).epsilon(1e-12));
    CHECK((hit.point - p).norm() == Approx(hit.distance));
    const double grid = distance_by_grid(soup, p, 40);
    CHECK(hit.distance <= grid + 1e-12);
    CHECK(hit.distance >= grid - 0.02);
    const TriangleMesh alone{soup.positions, {soup.triangles[hit.triangle]}};
    CHECK(ClosestPoint(alone).closest(p).distance == Approx(hit.distance).epsilon(1e-12));
  }
}

TEST_CASE("every region of a triangle gives its own closest point", "[closest_point]") {
  const ClosestPoint tree({{{0, 0, 0}, {4, 0, 0}, {0, 3, 0}}, {{0, 1, 2}}});
  const auto point = [&](double x, double y, double z) { return tree.closest({x, y, z}).point; };
  CHECK(point(1, 1, 5).isApprox(Vec3(1, 1, 0)));
  CHECK(point(2, -1, 1).isApprox(Vec3(2, 0, 0)));
  CHECK(point(-2, 1, 1).isApprox(Vec3(0, 1, 0)));
  CHECK(point(2 + 3, 1.5 + 4, -2).isApprox(Vec3(2, 1.5, 0)));
  CHECK(point(-1, -1, 0).norm() == 0);
  CHECK(point(9, -1, 0).isApprox(Vec3(4, 0, 0)));
  CHECK(point(-1, 7, 0).isApprox(Vec3(0, 3, 0)));
}

TEST_CASE("shifted planes are apart by their shift, concentric spheres by the difference of radii", "[distance]") {
  const SurfaceDistance planes = surface_distance(unit_square(0), unit_square(0.25));
  CHECK(planes.mean() == Approx(0.25).epsilon(1e-14));
  CHECK(planes.max() == Approx(0.25).epsilon(1e-14));
  const SurfaceDistance spheres = surface_distance(sphere(1, 100), sphere(1.2, 120));
  // Chords of angles 2 pi / 100 and less lie up to 1.2 (1 - cos(pi / 100)) < 6e-4 inside their spheres.
  CHECK(std::abs(spheres.mean_a_to_b - 0.2) < 1e-3);
  CHECK(std::abs(spheres.mean_b_to_a - 0.2) < 1e-3);
  CHECK(std::abs(spheres.max() - 0.2) < 1e-3);
  CHECK(spheres.extreme().distance == Approx((spheres.extreme().from - spheres.extreme().to).norm()));
  const SurfaceDistance none = surface_distance(sphere(1, 30), sphere(1, 30));
  CHECK(none.max() < 1e-15);
}

TEST_CASE("one-sided distances differ where one surface is a part of the other", "[distance]") {
  TriangleMesh larger = unit_square(0);
  for (Vec3& p : larger.positions) p *= 3;
  const SurfaceDistance result = surface_distance(unit_square(0), larger);
  CHECK(result.max_a_to_b.distance < 1e-15);
  CHECK(result.max_b_to_a.distance == Approx(2 * std::sqrt(2.0)));
  CHECK(result.max() == result.max_b_to_a.distance);
  CHECK(result.max_b_to_a.from.isApprox(Vec3(3, 3, 0)));
  CHECK(result.max_b_to_a.to.isApprox(Vec3(1, 1, 0)));
  // 1/9 ([two 1 x 2 strips: mean 1] + the corner square: 8 (sqrt2 + ln(1 + sqrt2)) / 3)
  const double strip = 2 * 2.0, corner = 8 * (std::sqrt(2.0) + std::log(1 + std::sqrt(2.0))) / 3;
  CHECK(result.mean_b_to_a == Approx((strip + corner) / 9).epsilon(1e-4));
}

TEST_CASE("distances have the same bits for one and two threads", "[distance]") {
  const TriangleMesh a = sphere(1, 60), b = sphere(1.01, 41);
  test::ThreadGuard guard;
  guard.use(1);
  const SurfaceDistance one = surface_distance(a, b);
  guard.use(2);
  const SurfaceDistance two = surface_distance(a, b);
  CHECK(one.mean_a_to_b == two.mean_a_to_b);
  CHECK(one.mean_b_to_a == two.mean_b_to_a);
  CHECK(one.max_a_to_b.from == two.max_a_to_b.from);
  CHECK(one.max_b_to_a.to == two.max_b_to_a.to);
}

TEST_CASE("distances refuse empty and broken surfaces", "[distance]") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(ClosestPoint(TriangleMesh{}), InputError);
  CHECK_THROWS_AS(ClosestPoint(TriangleMesh{{{0, 0, 0}}, {{0, 0, 1}}}), InputError);
  CHECK_THROWS_AS(ClosestPoint(TriangleMesh{{{0, 0, nan}}, {{0, 0, 0}}}), InputError);
  CHECK_THROWS_AS(surface_distance(unit_square(0), unit_square(1), {.num_samples = 0}), InputError);
  CHECK(ClosestPoint(unit_square(0)).closest(Vec3(nan, 0, 0)).triangle == kNoIndex);
  CHECK(bounding_box_diagonal(unit_square(2)) == Approx(std::sqrt(2.0)));
}

TEST_CASE("points so far away that squares overflow have a closest point all the same", "[distance]") {
  const ClosestPoint square(unit_square(0));
  for (const Index hint : {kNoIndex, Index{0}}) {
    const ClosestPoint::Hit hit = square.closest(Vec3(0, 0, 1e200), hint);
    CHECK(hit.triangle != kNoIndex);
    CHECK(hit.point.norm() <= std::sqrt(2.0));
    CHECK(hit.distance == Approx(1e200));
  }
}

TEST_CASE("A fit that cuts off a sharp edge is seen between the ends and the middle of the edge",
          "[surface_distance]") {
  // A blade of about 5 degrees, and one whose edge is dented at a third of its length.
  TriangleMesh blade, dented;
  blade.positions = {{0, 0, 0}, {1, 0, 0}, {0.5, 1, 0.04}, {0.5, 1, -0.04}};
  blade.triangles = {{0, 1, 2}, {1, 0, 3}};
  dented.positions = blade.positions;
  dented.positions.push_back({1.0 / 3, 0.2, 0});
  dented.triangles = {{0, 4, 2}, {4, 1, 2}, {4, 0, 3}, {1, 4, 3}};
  const SurfaceDistance distance = surface_distance(blade, dented, {.num_samples = 100});
  CHECK(distance.max_a_to_b.distance > 0.165);  // 0.144 from the middle
}
