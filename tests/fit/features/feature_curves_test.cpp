// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/feature_curves.h"
#include "subvol/base/error.h"
#include "subvol/fit/features/crease_paths.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/surface_fixtures.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

/// A cylinder of radius 1 from z = 0 to `height` with n quads around and fans for its ends.
TriangleMesh cylinder(int n, double height) {
  TriangleMesh mesh;
  for (int k = 0; k < 2; ++k)
    for (int i = 0; i < n; ++i) {
      const double angle = 2 * std::numbers::pi * i / n;
      mesh.positions.emplace_back(std::cos(angle), std::sin(angle), k * height);
    }
  mesh.positions.emplace_back(0, 0, 0);
  mesh.positions.emplace_back(0, 0, height);
  for (Index i = 0; i < n; ++i) {
    const Index j = (i + 1) % n;
    mesh.triangles.push_back({i, j, n + j});
    mesh.triangles.push_back({i, n + j, n + i});
    mesh.triangles.push_back({j, i, 2 * n});
    mesh.triangles.push_back({n + i, n + j, 2 * n + 1});
  }
  return mesh;
}

/// A square bar, two cells wide and high: its rims are of eight edges each, bent by 90 degrees.
VolumeMesh bar(double height) {
  VolumeMesh mesh = lattice(2, 2, 2);
  for (Vec3& p : mesh.positions) {
    p = Vec3(p.x() - 1, p.y() - 1, p.z() * height / 2);
    if (p.head<2>().norm() > 1) p.head<2>().normalize();
  }
  return mesh;
}

}  // namespace

TEST_CASE("a cube has twelve feature curves that end at eight corners of three") {
  const TriangleMesh mesh = cube_surface(4, false);
  const FeatureCurves curves = feature_curves(mesh, 40);
  CHECK(curves.curves.size() == 12);
  CHECK(curves.corners.size() == 8);
  CHECK(curves.corner_edges == std::vector<int>(8, 3));
  for (const FeatureCurve& curve : curves.curves) {
    CHECK(curve.vertices.size() == 5);
    CHECK(curve.length() == Approx(2));
    CHECK_FALSE(curve.closed());
  }
  CHECK(feature_curves(mesh, 90.1).empty());
  CHECK(feature_curves(cube_surface(4, true), 40).empty());
}

TEST_CASE("triangles of either orientation make the same feature curves") {
  TriangleMesh mesh = cube_surface(4, false);
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 3) std::swap(mesh.triangles[t][0], mesh.triangles[t][1]);
  CHECK(feature_curves(mesh, 40).curves.size() == 12);
}

TEST_CASE("a rim is one closed curve") {
  const FeatureCurves curves = feature_curves(cylinder(24, 2), 40);
  REQUIRE(curves.curves.size() == 2);
  CHECK(curves.corners.empty());
  for (const FeatureCurve& curve : curves.curves) {
    CHECK(curve.closed());
    CHECK(curve.vertices.size() == 25);
  }
}

TEST_CASE("feature curves refuse angles out of range and corners that do not exist") {
  const TriangleMesh mesh = cube_surface(1, false);
  for (double angle : {-1.0, 181.0, std::numeric_limits<double>::quiet_NaN()})
    CHECK_THROWS_AS(feature_curves(mesh, angle), InputError);
  TriangleMesh broken = mesh;
  broken.triangles[0][0] = 1000;
  CHECK_THROWS_AS(feature_curves(broken, 40), InputError);
  for (const std::array<Index, 2> tagged : {std::array<Index, 2>{0, 1000}, {-1, 0}, {2, 2}})
    CHECK_THROWS_AS(feature_curves(mesh, 40, std::span(&tagged, 1)), InputError);
}

TEST_CASE("a displaced lattice follows every edge of a cube") {
  const FeatureCurves curves = feature_curves(cube_surface(8, false), 40);
  VolumeMesh mesh = lattice(3, 3, 3);
  for (Vec3& p : mesh.positions) p = p * (2.0 / 3) - Vec3::Ones() + Vec3(0.15, -0.1, 0.1);
  const std::vector<CreasePath> paths = follow_curves(mesh, curves);
  CHECK(paths.size() == 12);
  const FeatureTags tags = tags_of_paths(paths, curves);
  CHECK(tags.creases.size() == 36);
  CHECK(tags.corners.size() == 8);
  for (const CreasePath& path : paths) {
    const FeatureCurve& curve = curves.curves[path.curve];
    CHECK((mesh.positions[path.vertices.front()] - curve.points.front()).norm() < 0.3);
    CHECK((mesh.positions[path.vertices.back()] - curve.points.back()).norm() < 0.3);
  }
}

TEST_CASE("each of many cubes gets its paths, whatever its vertices' numbers") {
  constexpr int kCubes = 2;
  const auto in_cube = [](int i) { return i % 4 < 2; };
  constexpr int kLength = 4 * kCubes - 2;
  VolumeMesh mesh =
      voxels(kLength, kLength, kLength, [&](int i, int j, int k) { return in_cube(i) && in_cube(j) && in_cube(k); });
  for (Vec3& p : mesh.positions) p += Vec3(0.15, -0.1, 0.12);
  TriangleMesh target;
  for (int n = 0; n < kCubes * kCubes * kCubes; ++n) {
    const TriangleMesh cube = cube_surface(2, false);
    const auto first = static_cast<Index>(target.positions.size());
    const Vec3 center = Vec3::Ones() + 4 * Vec3(n % kCubes, n / kCubes % kCubes, n / kCubes / kCubes);
    for (const Vec3& p : cube.positions) target.positions.push_back(center + p);
    for (const auto& t : cube.triangles) target.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  }
  const FeatureCurves curves = feature_curves(target, 40);
  const std::vector<CreasePath> paths = follow_curves(mesh, curves);
  CHECK(paths.size() == 12 * 8);
  for (const CreasePath& path : paths) {
    const FeatureCurve& curve = curves.curves[path.curve];
    CHECK((mesh.positions[path.vertices.front()] - curve.points.front()).norm() < 0.3);
    CHECK((mesh.positions[path.vertices.back()] - curve.points.back()).norm() < 0.3);
  }
  const FeatureTags tags = tags_of_paths(paths, curves);
  CHECK(tags.creases.size() == 24 * 8);
  CHECK(tags.corners.size() == 8 * 8);

  const auto last = static_cast<Index>(mesh.num_vertices()) - 1;
  VolumeMesh backward = mesh;
  std::reverse(backward.positions.begin(), backward.positions.end());
  for (Index& v : backward.cell_vertices) v = last - v;
  std::vector<CreasePath> others = follow_curves(backward, curves);
  REQUIRE(others.size() == paths.size());
  for (std::size_t i = 0; i < paths.size(); ++i) {
    for (Index& v : others[i].vertices) v = last - v;
    CHECK(others[i].curve == paths[i].curve);
    CHECK(others[i].vertices == paths[i].vertices);
  }
}

TEST_CASE("a coarse rim follows a round one, and gets no corner for being coarse") {
  const FeatureCurves curves = feature_curves(cylinder(24, 2), 40);
  const VolumeMesh mesh = bar(2);
  const std::vector<CreasePath> paths = follow_curves(mesh, curves);
  REQUIRE(paths.size() == 2);
  for (const CreasePath& path : paths) {
    CHECK(path.vertices.size() == 9);
    CHECK(path.vertices.front() == path.vertices.back());
  }
  const FeatureTags tags = tags_of_paths(paths, curves);
  CHECK(tags.creases.size() == 16);
  CHECK(tags.corners.empty());
}

TEST_CASE("paths keep to creases where they are told to") {
  const FeatureCurves curves = feature_curves(cylinder(24, 2), 40);
  VolumeMesh mesh = bar(2);
  CHECK(follow_curves(mesh, curves, PathEdges::creases).empty());
  mesh.tags = tags_of_paths(follow_curves(mesh, curves), curves);
  std::erase_if(mesh.tags.creases, [&](const CreaseEdge& c) { return mesh.positions[c.v0].z() > 1; });
  const std::vector<CreasePath> paths = follow_curves(mesh, curves, PathEdges::creases);
  REQUIRE(paths.size() == 1);
  for (Index v : paths[0].vertices) CHECK(mesh.positions[v].z() == 0);
}

TEST_CASE("a template far from the target follows nothing") {
  VolumeMesh mesh = bar(2);
  for (Vec3& p : mesh.positions) p.x() += 5;
  CHECK(follow_curves(mesh, feature_curves(cylinder(24, 2), 40)).empty());
  CHECK(follow_curves(mesh, {}).empty());
}
