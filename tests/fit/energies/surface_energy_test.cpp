// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/energies/surface_energy.h"

#include "subvol/base/error.h"
#include "tests/support/surface_fixtures.h"
#include "tests/support/threads.h"

#include <Eigen/Eigenvalues>
#include <catch2/catch.hpp>

#include <cmath>
#include <cstring>
#include <limits>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

constexpr double kSinglePrecision = 3e-7;  // relative error of the Hessian's blocks, and of what is made of them

/// A sphere-like S inside a cube T: neither close nor symmetric.
struct Case {
  TriangleMesh target_mesh = cube_surface(6, false);
  TriangleMesh samples = cube_surface(5, true);
  Case() {
    RandomPoints random(3);
    for (Vec3& p : samples.positions) p = 0.9 * p + random.point(0.05) + Vec3(0.1, 0, -0.05);
    for (Vec3& p : target_mesh.positions) p += random.point(0.02);
  }
};

/// E_S by brute force: nearest samples of a fine grid of points on both surfaces.
double sampled_energy(const TargetSurface& target, const TriangleMesh& samples, double tau, int n) {
  const auto nearest = [](const std::vector<Vec3>& sites, const Vec3& x) {
    std::size_t best = 0;
    for (std::size_t s = 1; s < sites.size(); ++s)
      if ((sites[s] - x).squaredNorm() < (sites[best] - x).squaredNorm()) best = s;
    return best;
  };
  const auto measure = [&](const Vec3& d, const Vec3& normal) {
    const double along = normal.dot(d);
    return tau * d.squaredNorm() + (1 - tau) * along * along;
  };
  const auto over = [&](const std::vector<Vec3>& positions, const std::vector<std::array<Index, 3>>& triangles,
                        auto f) {
    double sum = 0;
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      const Vec3 &a = positions[triangles[t][0]], u = positions[triangles[t][1]] - a,
                 v = positions[triangles[t][2]] - a;
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < 2 * (n - i) - 1; ++j) {
          const double shift = j % 2 ? 2. / 3 : 1. / 3;
          sum += 0.5 * u.cross(v).norm() / (n * n) * f(t, Vec3(a + (i + shift) / n * u + (j / 2 + shift) / n * v));
        }
    }
    return sum;
  };
  const double to_surface = over(target.positions(), target.triangles(), [&](std::size_t t, const Vec3& y) {
    return measure(y - samples.positions[nearest(samples.positions, y)], target.normals()[t]);
  });
  const double to_target = over(samples.positions, samples.triangles, [&](std::size_t, const Vec3& x) {
    const std::size_t j = nearest(target.samples(), x);
    return measure(x - target.samples()[j], target.normals()[target.sample_triangles()[j]]);
  });
  return (to_surface + to_target) / (2 * target.area() * target.length() * target.length());
}

}  // namespace

TEST_CASE("the surface energy agrees with brute-force sampling of both integrals") {
  const double tau = GENERATE(1.0, 0.1, 0.0);
  CAPTURE(tau);
  const Case c;
  const TargetSurface target(c.target_mesh);
  SurfaceEnergy energy(target, c.samples.triangles, c.samples.positions.size(), tau);
  energy.assign(c.samples.positions);
  // Error of the midpoint rule with 256 points a triangle.
  CHECK(sampled_energy(target, c.samples, tau, 16) == Approx(energy.value(c.samples.positions)).epsilon(1e-3));
  CHECK(energy.value(c.samples.positions) == Approx(energy.target_to_surface() + energy.surface_to_target()));
}

TEST_CASE("the surface energy's gradient and Hessian agree with central differences of its frozen cells") {
  const double tau = GENERATE(1.0, 0.01);
  const Case c;
  const TargetSurface target(c.target_mesh);
  const std::size_t n = c.samples.positions.size();
  SurfaceEnergy energy(target, c.samples.triangles, n, tau);
  energy.assign(c.samples.positions);
  RandomPoints random(5);
  std::vector<Vec3> z = c.samples.positions, direction = random.points(n);
  for (Vec3& p : z) p += random.point(0.1);
  std::vector<Vec3> g(n, Vec3::Zero()), product(n), plus = z, minus = z;
  energy.add_gradient(z, g);
  energy.hessian().multiply(direction, product);
  double slope = 0, curvature = 0, steepness = 0;
  for (std::size_t i = 0; i < n; ++i) {
    plus[i] += 1e-3 * direction[i];
    minus[i] -= 1e-3 * direction[i];
    slope += g[i].dot(direction[i]);
    curvature += direction[i].dot(product[i]);
    steepness += g[i].norm() * direction[i].norm();
  }
  CHECK(steepness > 0);
  const double at = energy.value(z), up = energy.value(plus), down = energy.value(minus);
  // A quadratic has exact differences: roundings of E, magnified by the step, are all that is left.
  CHECK(std::abs((up - down) / 2e-3 - slope) < 1e-10 * steepness + 1e-12 * at / 1e-3);
  CHECK((up - 2 * at + down) / 1e-6 == Approx(curvature).epsilon(1e-6));
  CHECK(curvature > 0);
}

TEST_CASE("the gradient of frozen cells is that of moving cells for the target's side when tau is one") {
  const Case c;
  const TargetSurface target(c.target_mesh);
  const std::size_t n = c.samples.positions.size();
  SurfaceEnergy energy(target, {}, n, 1.0);  // no sample triangles: F_TS alone
  RandomPoints random(7);
  const auto direction = random.points(n);
  const auto moved = [&](double step) {
    std::vector<Vec3> z = c.samples.positions;
    for (std::size_t i = 0; i < n; ++i) z[i] += step * direction[i];
    energy.assign(z);
    return energy.value(z);
  };
  const double difference = (moved(1e-5) - moved(-1e-5)) / 2e-5;
  energy.assign(c.samples.positions);
  std::vector<Vec3> g(n, Vec3::Zero());
  energy.add_gradient(c.samples.positions, g);
  double slope = 0;
  for (std::size_t i = 0; i < n; ++i) slope += g[i].dot(direction[i]);
  CHECK(slope == Approx(difference).epsilon(1e-6));
}

TEST_CASE("the value away from the assigned samples is that of the same cells, to single precision") {
  const Case c;
  const TargetSurface target(c.target_mesh);
  const std::size_t n = c.samples.positions.size();
  SurfaceEnergy energy(target, c.samples.triangles, n, 0.3);
  std::vector<Vec3> z = c.samples.positions;
  energy.assign(z);
  for (Vec3& p : z) p += Vec3(1e-4, 0, 0);
  const double frozen = energy.value(z);
  energy.assign(z);
  // Cells change over a length of 1e-4 of cells of size 0.3, and so does the measure.
  CHECK(energy.value(z) == Approx(frozen).epsilon(1e-4));
}

TEST_CASE("a surface equal to its target has nearly no energy across it, and does not want to leave it") {
  const TriangleMesh mesh = cube_surface(12, false);
  const TargetSurface target(mesh);
  SurfaceEnergy energy(target, mesh.triangles, mesh.positions.size(), 0.0);
  energy.assign(mesh.positions);
  CHECK(energy.value(mesh.positions) < 1e-20);
  std::vector<Vec3> g(mesh.positions.size(), Vec3::Zero()), outward = mesh.positions;
  energy.add_gradient(mesh.positions, g);
  for (const Vec3& v : g) REQUIRE(v.norm() < 1e-12);
  for (Vec3& p : outward) p *= 1.05;
  CHECK(energy.value(outward) > 1e-4);
}

TEST_CASE("the surface energy does not change under similarities of both surfaces") {
  const Case c;
  const std::size_t n = c.samples.positions.size();
  const TargetSurface target(c.target_mesh);
  SurfaceEnergy energy(target, c.samples.triangles, n, 0.1);
  energy.assign(c.samples.positions);
  const Mat3 rotation = Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized()).toRotationMatrix();
  const auto moved = [&](std::vector<Vec3> points) {
    for (Vec3& p : points) p = 3.5 * rotation * p + Vec3(100, -200, 50);
    return points;
  };
  const TargetSurface moved_target(TriangleMesh{moved(c.target_mesh.positions), c.target_mesh.triangles});
  SurfaceEnergy moved_energy(moved_target, c.samples.triangles, n, 0.1);
  const auto z = moved(c.samples.positions);
  moved_energy.assign(z);
  CHECK(moved_energy.value(z) == Approx(energy.value(c.samples.positions)).epsilon(1e-11));
  std::vector<Vec3> g(n, Vec3::Zero()), h(n, Vec3::Zero());
  energy.add_gradient(c.samples.positions, g);
  moved_energy.add_gradient(z, h);
  for (std::size_t i = 0; i < n; ++i) REQUIRE((rotation * g[i] - 3.5 * h[i]).norm() < 1e-11);
}

TEST_CASE("the surface energy's Hessian is symmetric and positive semidefinite") {
  const Case c;
  const TargetSurface target(c.target_mesh);
  const std::size_t n = c.samples.positions.size();
  SurfaceEnergy energy(target, c.samples.triangles, n, 0.003);
  energy.assign(c.samples.positions);
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(3 * n, 3 * n);
  const BlockSparse& h = energy.hessian();
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = h.offsets[i]; k < h.offsets[i + 1]; ++k)
      for (int e = 0; e < 9; ++e) dense(3 * i + e / 3, 3 * h.columns[k] + e % 3) = h.block(k)[e];
  CHECK((dense - dense.transpose()).norm() <= kSinglePrecision * dense.norm());
  const Eigen::VectorXd values = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(dense).eigenvalues();
  CHECK(values.minCoeff() > -kSinglePrecision * values.maxCoeff());
}

TEST_CASE("the surface energy has the same bits for one and two threads, and for every history", "[slow]") {
  const TriangleMesh mesh = cube_surface(20, true);
  const TargetSurface target(cube_surface(24, false));
  test::ThreadGuard guard;
  RandomPoints random(11);
  std::vector<Vec3> z = mesh.positions;
  std::vector<double> values[2];
  std::vector<Vec3> gradients[2];
  for (int run = 0; run < 2; ++run) {
    guard.use(run + 1);
    SurfaceEnergy energy(target, mesh.triangles, z.size(), 0.1);
    if (run == 1) energy.assign(random.points(z.size()));
    energy.assign(z);
    std::vector<Vec3> y = z;
    for (Vec3& p : y) p *= 1.01;
    gradients[run].assign(z.size(), Vec3::Zero());
    energy.add_gradient(y, gradients[run]);
    values[run] = {energy.value(z), energy.value(y), energy.target_to_surface()};
  }
  CHECK(values[0] == values[1]);
  CHECK(gradients[0] == gradients[1]);
}

TEST_CASE("what SurfaceEnergy refuses") {
  const TriangleMesh mesh = cube_surface(2, true);
  const TargetSurface target(mesh);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(SurfaceEnergy(target, {}, 0, 0.1), InputError);
  CHECK_THROWS_AS(SurfaceEnergy(target, {{0, 1, 2}}, 2, 0.1), InputError);
  CHECK_THROWS_AS(SurfaceEnergy(target, {}, 3, 1.1), InputError);
  CHECK_THROWS_AS(SurfaceEnergy(target, {}, 3, nan), InputError);
  SurfaceEnergy energy(target, {{0, 1, 2}}, 3, 0.1);
  std::vector<Vec3> z(3, Vec3(0, 0, 0));
  CHECK_THROWS_AS(energy.value(z), InputError);
  CHECK_THROWS_AS(energy.assign(std::vector<Vec3>(2)), InputError);
  z[1][0] = nan;
  CHECK_THROWS_AS(energy.assign(z), InputError);
}
