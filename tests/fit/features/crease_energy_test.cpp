// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/crease_energy.h"
#include "subvol/base/error.h"
#include "subvol/fit/energies/closest_point_energy.h"
#include "subvol/fit/features/crease_distance.h"
#include "subvol/fit/target/target_surface.h"
#include "subvol/subdivision/limit_surface.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/surface_fixtures.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

/// A cube as the target; a shifted, shaken cube as samples, whose edges follow the target's.
struct Case {
  TriangleMesh target = cube_surface(6, false), samples = cube_surface(4, false);
  FeatureCurves curves = feature_curves(target, 40);
  std::vector<CreaseSegment> segments;
  explicit Case(double shake) {
    for (const FeatureCurve& curve : feature_curves(samples, 40).curves)
      for (std::size_t i = 0; i + 1 < curve.vertices.size(); ++i)
        segments.push_back({{curve.vertices[i], curve.vertices[i + 1]}, same_curve(curve)});
    RandomPoints random(11);
    for (Vec3& p : samples.positions) p += random.point(shake);
  }
  Index same_curve(const FeatureCurve& curve) const {
    const auto middle = [](const FeatureCurve& c) { return Vec3(0.5 * (c.points.front() + c.points.back())); };
    for (std::size_t c = 0; c < curves.curves.size(); ++c)
      if ((middle(curves.curves[c]) - middle(curve)).norm() < 1e-9) return static_cast<Index>(c);
    return kNoIndex;
  }
};

}  // namespace

TEST_CASE("creases on their curves cost nothing, and a shift across them what it is worth") {
  const Case c(0);
  const TargetSurface target(c.target);
  const double scale = 1 / (2 * target.area() * target.length() * target.length());
  ClosestPointEnergy energy(target, c.samples.triangles, c.samples.positions.size(), 0, 1);
  energy.add_creases(CreaseEnergy(c.curves, c.segments, c.samples.positions.size(), 0.5, 0));
  energy.assign(c.samples.positions);
  CHECK(energy.value(c.samples.positions) == Approx(0).margin(1e-15));
  // Shifted along x, frozen: eight edges move across themselves, four along; corners are tied 2 x 12 times by a segment
  // of length 1/2.
  std::vector<Vec3> z = c.samples.positions;
  for (Vec3& p : z) p.x() += 0.01;
  ClosestPointEnergy bare(target, c.samples.triangles, z.size(), 0, 1);
  bare.assign(c.samples.positions);
  const double expected = scale * 0.5 * 1e-4 * (2 * 8 * 2 + 24 * 0.5);
  CHECK(energy.value(z) - bare.value(z) == Approx(expected).epsilon(1e-5));
}

TEST_CASE("gradient and Hessian with creases agree with central differences") {
  const double tau = GENERATE(1.0, 0.01);
  const Case c(0.1);
  const TargetSurface target(c.target);
  const std::size_t n = c.samples.positions.size();
  ClosestPointEnergy energy(target, c.samples.triangles, n, tau, 3);
  energy.add_creases(CreaseEnergy(c.curves, c.segments, n, 2, tau));
  energy.assign(c.samples.positions);
  RandomPoints random(5);
  std::vector<Vec3> z = c.samples.positions, direction = random.points(n), g(n, Vec3::Zero()), product(n);
  energy.add_gradient(z, g);
  energy.hessian().multiply(direction, product);
  std::vector<Vec3> plus = z, minus = z;
  double slope = 0, curvature = 0, steepness = 0;
  for (std::size_t i = 0; i < n; ++i) {
    plus[i] += 1e-3 * direction[i];
    minus[i] -= 1e-3 * direction[i];
    slope += g[i].dot(direction[i]);
    curvature += direction[i].dot(product[i]);
    steepness += g[i].norm() * direction[i].norm();
  }
  const double at = energy.value(z), up = energy.value(plus), down = energy.value(minus);
  CHECK(steepness > 0);
  CHECK(std::abs((up - down) / 2e-3 - slope) < 1e-10 * steepness + 1e-12 * at / 1e-3);
  CHECK((up - 2 * at + down) / 1e-6 == Approx(curvature).epsilon(1e-6));
}

TEST_CASE("creases refuse segments that are no edges of samples, and weights out of range") {
  const Case c(0);
  const std::size_t n = c.samples.positions.size();
  const TargetSurface target(c.target);
  ClosestPointEnergy energy(target, c.samples.triangles, n, 0, 1);
  CHECK_THROWS_AS(CreaseEnergy(c.curves, {{{0, static_cast<Index>(n)}, 0}}, n, 1, 0), InputError);
  CHECK_THROWS_AS(CreaseEnergy(c.curves, {{{0, 1}, 12}}, n, 1, 0), InputError);
  CHECK_THROWS_AS(CreaseEnergy(c.curves, {{{0, 1}, kNoIndex}}, n, 1, 0), InputError);
  CHECK_THROWS_AS(CreaseEnergy(c.curves, c.segments, n, -1, 0), InputError);
  CHECK_THROWS_AS(CreaseEnergy(c.curves, c.segments, n, 1, 2), InputError);
  const Index far = static_cast<Index>(n) - 1;
  CHECK_THROWS_AS(energy.add_creases(CreaseEnergy(c.curves, {{{0, far}, 0}}, n, 1, 0)), InputError);
}

TEST_CASE("the distance of creases is that of a shift, and tells what is not followed") {
  Case c(0);
  for (Vec3& p : c.samples.positions) p.z() += 0.009;
  CreaseDistance all = crease_distance(c.curves, c.samples.positions, c.segments, 10);
  CHECK(all.num_curves == 12);
  CHECK(all.num_followed == 12);
  CHECK(all.max_percent() == Approx(0.09));
  CHECK(all.mean_percent() == Approx(0.09 * 8 / 12).epsilon(0.01));  // upright edges stay within themselves
  CHECK(all.target_length_percent == Approx(240));
  CHECK(all.followed_share() == 1);
  CHECK(all.within_share() == Approx(1));

  std::erase_if(c.segments, [](const CreaseSegment& s) { return s.curve % 2 == 0; });
  const CreaseDistance half = crease_distance(c.curves, c.samples.positions, c.segments, 10);
  CHECK(half.num_followed == 6);
  CHECK(half.followed_share() == Approx(0.5));
  CHECK(half.within_share() < 0.6);
  const CreaseDistance none = crease_distance(c.curves, {}, {}, 10);
  CHECK(none.num_followed == 0);
  CHECK(none.max_percent() == 0);
  CHECK(none.within_share() == 0);
  CHECK_THROWS_AS(crease_distance(c.curves, c.samples.positions, {{{{0, -1}, 0}}}, 10), InputError);
  CHECK_THROWS_AS(crease_distance(c.curves, c.samples.positions, c.segments, 0), InputError);
}

TEST_CASE("a refined boundary knows the edges of every crease") {
  VolumeMesh mesh = l_shape(2);
  mesh.tags.creases = {{0, 1}};
  const MeshTopology topology(mesh);
  // Some boundary edges, in the order of the tags.
  mesh.tags.creases.clear();
  for (std::size_t e = 0; e < topology.num_edges(); e += 5)
    if (topology.is_boundary_edge(static_cast<Index>(e))) {
      const auto [v0, v1] = topology.edge(static_cast<Index>(e));
      mesh.tags.creases.push_back({v0, v1});
      mesh.tags.corners.push_back({v0});
      mesh.tags.corners.push_back({v1});
    }
  std::sort(mesh.tags.corners.begin(), mesh.tags.corners.end(), [](auto a, auto b) { return a.vertex < b.vertex; });
  mesh.tags.corners.erase(std::unique(mesh.tags.corners.begin(), mesh.tags.corners.end()), mesh.tags.corners.end());
  for (int levels : {0, 1, 3}) {
    const BoundaryRefinement refined = refine_boundary(mesh, levels);
    const std::vector<Vec3> points = refined.positions.apply(mesh.positions);
    const std::size_t children = std::size_t{1} << levels;
    REQUIRE(refined.crease_edges.size() == children * mesh.tags.creases.size());
    for (std::size_t k = 0; k < refined.crease_edges.size(); ++k) {
      // With fixed ends the crease stays straight.
      const CreaseEdge& crease = mesh.tags.creases[k / children];
      const Vec3 &a = mesh.positions[crease.v0], &b = mesh.positions[crease.v1];
      for (Index v : refined.crease_edges[k])
        CHECK((points[v] - a).norm() + (points[v] - b).norm() == Approx((a - b).norm()).epsilon(1e-9));
      const Vec3 piece = points[refined.crease_edges[k][0]] - points[refined.crease_edges[k][1]];
      CHECK(piece.norm() > 0.5 / static_cast<double>(children) * (a - b).norm());
    }
  }
}
