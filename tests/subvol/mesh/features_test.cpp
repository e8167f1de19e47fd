// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/mesh/features.h"

#include "subvol/base/error.h"
#include "subvol/mesh/validate.h"
#include "tests/support/sample_meshes.h"

#include <catch2/catch.hpp>

#include <limits>

using namespace subvol;
using namespace subvol::test;

TEST_CASE("a cube of many cells has twelve sharp edges and eight corners") {
  const FeatureTags tags = features_by_angle(lattice(3, 3, 3), 40);
  CHECK(tags.creases.size() == 12 * 3);
  CHECK(tags.corners.size() == 8);
  for (const CreaseEdge& crease : tags.creases) CHECK(crease.sharpness == kInfiniteSharpness);
}

TEST_CASE("a reflex edge is a feature like a convex one") {
  const FeatureTags tags = features_by_angle(l_shape(2), 40);
  // Profile: 6 corners, each an upright line of 2 edges; rims: perimeter 8 on both ends.
  CHECK(tags.creases.size() == 6 * 2 + 8 * 2);
  CHECK(tags.corners.size() == 12);
}

TEST_CASE("features depend on the shape only: not on place, size or orientation") {
  VolumeMesh mesh = mixed_cells();
  const FeatureTags tags = features_by_angle(mesh, 35);
  const Eigen::AngleAxisd turn(0.7, Vec3(1, -2, 0.5).normalized());
  for (Vec3& x : mesh.positions) x = 1e-3 * (turn * x) + Vec3(5, 6, 7);
  CHECK(features_by_angle(mesh, 35) == tags);
  for (Vec3& x : mesh.positions) x.z() = -x.z();
  CHECK(features_by_angle(mesh, 35) == tags);
}

TEST_CASE("the angle is that between the faces' normals, and must be exceeded") {
  // A wedge of one sector: the two side planes meet at 60 degrees, so their normals differ by 120.
  const VolumeMesh mesh = fan(1, 60, 1);
  const auto has_axis = [&](double angle_degrees) {
    const FeatureTags tags = features_by_angle(mesh, angle_degrees);
    const Index top = static_cast<Index>(mesh.num_vertices() / 2);
    return std::find(tags.creases.begin(), tags.creases.end(), CreaseEdge{0, top}) != tags.creases.end();
  };
  CHECK(has_axis(119.9));
  CHECK_FALSE(has_axis(120.1));
  CHECK(features_by_angle(mesh, 180).empty());
}

TEST_CASE("where two creases meet, only a sharp turn makes a corner") {
  // A round bar with a notch: its rims turn by 345/24 degrees at each vertex, its sides by as much at each line.
  VolumeMesh mesh = fan(12, 345, 2);
  for (Vec3& x : mesh.positions)
    if (x.head<2>().norm() > 0) x.head<2>().normalize();
  const FeatureTags tags = features_by_angle(mesh, 40);
  for (const CornerVertex& corner : tags.corners) {
    const Vec3& x = mesh.positions[static_cast<std::size_t>(corner.vertex)];
    // Only the notch has corners: on the axis and at its two outer edges.
    const double angle = std::atan2(x.y(), x.x()) * 180 / std::acos(-1.0);
    CHECK((x.head<2>().norm() < 1e-12 || std::abs(angle) < 1e-9 || std::abs(angle + 15) < 1e-9));
  }
  CHECK(tags.corners.size() == 6);
}

TEST_CASE("a crease that runs out makes no corner") {
  // Lift one end of the middle line of a plate: the fold fades to nothing at the other end.
  VolumeMesh mesh = lattice(2, 2, 1);
  for (Vec3& x : mesh.positions)
    if (x == Vec3(1, 0, 1)) x.z() = 1.6;
  const FeatureTags tags = features_by_angle(mesh, 30);
  for (std::size_t v = 0; v < mesh.num_vertices(); ++v) {
    if (mesh.positions[v] != Vec3(1, 1, 1)) continue;
    const auto at = [&](const CreaseEdge& c) { return c.v0 == static_cast<Index>(v) || c.v1 == static_cast<Index>(v); };
    CHECK(std::count_if(tags.creases.begin(), tags.creases.end(), at) == 1);
    CHECK(std::none_of(tags.corners.begin(), tags.corners.end(),
                       [&](const CornerVertex& c) { return c.vertex == static_cast<Index>(v); }));
  }
}

TEST_CASE("faces without area are not features and give no NaN") {
  VolumeMesh mesh = lattice(2, 1, 1);
  for (Vec3& x : mesh.positions) x.setZero();
  CHECK(features_by_angle(mesh, 0).empty());
}

TEST_CASE("an angle outside 0 to 180 degrees is refused") {
  const VolumeMesh mesh = lattice(1, 1, 1);
  for (const double angle : {-1.0, 180.5, std::numeric_limits<double>::quiet_NaN()})
    CHECK_THROWS_AS(features_by_angle(mesh, angle), InputError);
}

TEST_CASE("tags found pass validation") {
  for (VolumeMesh mesh : {lattice(2, 3, 1), l_shape(3), mixed_cells()}) {
    mesh.tags = features_by_angle(mesh, 30);
    CHECK(!mesh.tags.empty());
    CHECK(validate(mesh).empty());
  }
}

TEST_CASE("merging tags keeps each once, sorted, with the larger sharpness") {
  FeatureTags a, b;
  a.creases = {{4, 2, 1.5}, {0, 1, 3}};
  a.corners = {{7, 1}};
  b.creases = {{2, 4, 2.5}, {0, 1, 2}, {3, 5}};
  b.corners = {{2, 4}, {7, 0.5}};
  const FeatureTags merged = merge_tags(a, b);
  CHECK(merged.creases == std::vector<CreaseEdge>{{0, 1, 3}, {2, 4, 2.5}, {3, 5, kInfiniteSharpness}});
  CHECK(merged.corners == std::vector<CornerVertex>{{2, 4}, {7, 1}});
  CHECK(merge_tags(b, a) == merged);
  CHECK(merge_tags(merged, {}) == merged);
}
