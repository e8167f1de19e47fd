// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/elements/element_rule.h"
#include "subvol/fit/energies/distortion.h"
#include "subvol/fit/energies/volume_energy.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <catch2/catch.hpp>

#include <cmath>
#include <limits>
#include <random>

using namespace subvol;
using namespace subvol::internal;

namespace {

Mat3 random_feasible(std::mt19937& random, double spread) {
  std::normal_distribution<double> normal;
  for (;;) {
    Mat3 j = Mat3::Identity();
    for (int k = 0; k < 9; ++k) j(k / 3, k % 3) += spread * normal(random);
    if (j.determinant() > 1e-3) return j;
  }
}

VolumeMesh ideal_cell(CellKind kind) {
  VolumeMesh mesh;
  std::vector<Index> corners;
  const Mat3 a = ideal_inverse(kind).inverse();
  const std::vector<Vec3> canonical[] = {
      {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
      {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}},
      {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}},
      {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}}};
  for (const Vec3& p : canonical[static_cast<int>(kind)]) {
    corners.push_back(static_cast<Index>(mesh.positions.size()));
    mesh.positions.push_back(a * p);
  }
  mesh.add_cell(kind, corners);
  return mesh;
}

constexpr CellKind kKinds[] = {CellKind::tet, CellKind::prism, CellKind::hex, CellKind::pyramid};

/// Derivatives along d against central differences of step h. No eigenvalue may be clamped at x, as where cells are
/// half again as large as ideal ones. Blocks of the Hessian are stored in single precision.
void check_derivatives(const VolumeEnergy& energy, const std::vector<Vec3>& x, const std::vector<Vec3>& d, double h,
                       double tolerance) {
  const auto moved = [&](double t) {
    std::vector<Vec3> result = x;
    for (std::size_t i = 0; i < x.size(); ++i) result[i] += t * d[i];
    return result;
  };
  std::vector<Vec3> g(x.size(), Vec3::Zero()), plus = g, minus = g, product(x.size());
  BlockSparse hessian = energy.pattern();
  energy.add_hessian(x, 1, g, hessian);
  double slope = 0;
  for (std::size_t i = 0; i < x.size(); ++i) slope += g[i].dot(d[i]);
  CHECK(slope == Approx((energy.value(moved(h)) - energy.value(moved(-h))) / (2 * h)).epsilon(tolerance));
  energy.add_gradient(moved(h), 1, plus);
  energy.add_gradient(moved(-h), 1, minus);
  hessian.multiply(d, product);
  for (std::size_t i = 0; i < x.size(); ++i)
    CHECK((product[i] - (plus[i] - minus[i]) / (2 * h)).norm() < 1e-5 * (1 + product[i].norm()));
}

}  // namespace

TEST_CASE("The Hencky energy of singular values is half the sum of their squared logarithms") {
  CHECK(hencky(2 * Mat3::Identity()) == Approx(1.5 * std::log(2) * std::log(2)).epsilon(1e-14));
  std::mt19937 random(7);
  for (int k = 0; k < 200; ++k) {
    const Mat3 j = random_feasible(random, 0.6);
    const double expected = 0.5 * Eigen::JacobiSVD<Mat3>(j).singularValues().array().log().square().sum();
    CHECK(hencky(j) == Approx(expected).epsilon(1e-9).margin(1e-13));
  }
}

TEST_CASE("The Hencky energy vanishes for rotations and is infinite for inverted Jacobians") {
  std::mt19937 random(8);
  std::normal_distribution<double> normal;
  for (int k = 0; k < 50; ++k) {
    const Eigen::Quaterniond q(normal(random), normal(random), normal(random), normal(random));
    Mat3 stress;
    CHECK(hencky(q.normalized().toRotationMatrix(), &stress) < 1e-28);
    CHECK(stress.norm() < 1e-14);
  }
  Mat3 stress = Mat3::Ones();
  CHECK(hencky(Vec3(1, 1, -1).asDiagonal(), &stress) == std::numeric_limits<double>::infinity());
  CHECK(stress.norm() == 0);
  CHECK(hencky(Mat3::Zero()) == std::numeric_limits<double>::infinity());
}

TEST_CASE("The Hencky stress agrees with central differences, also just inside the barrier") {
  std::mt19937 random(9);
  for (int k = 0; k < 200; ++k) {
    Mat3 j = random_feasible(random, k % 2 ? 0.5 : 0.1);
    if (k % 5 == 0) j.col(2) *= 1e-2;
    Mat3 stress;
    hencky(j, &stress);
    const double h = 1e-6 * std::min(1.0, j.determinant());
    double error = 0;
    for (int e = 0; e < 9; ++e) {
      Mat3 plus = j, minus = j;
      plus(e / 3, e % 3) += h;
      minus(e / 3, e % 3) -= h;
      error = std::max(error, std::abs((hencky(plus) - hencky(minus)) / (2 * h) - stress(e / 3, e % 3)));
    }
    CHECK(stress.norm() > 0);
    CHECK(error <= 1e-5 * (1 + stress.norm()));
  }
}

TEST_CASE("Element rules integrate constants and reproduce affine maps for every kind") {
  Mat3 affine;
  affine << 1.2, 0.3, -0.1, 0.2, 0.9, 0.15, -0.2, 0.1, 1.4;
  for (CellKind kind : kKinds)
    for (int n : {2, 3, 5}) {
      const ElementRule rule = make_element_rule(kind, n);
      const VolumeMesh mesh = ideal_cell(kind);
      double sum = 0;
      for (std::size_t q = 0; q < rule.num_points(); ++q) {
        sum += rule.weights[q];
        Mat3 j = Mat3::Zero();
        for (const auto& entry : rule.point(q))
          j += affine * mesh.positions[entry.vertex] * Eigen::Map<const Eigen::RowVector3d>(entry.gradient.data());
        CHECK((j - affine).norm() < 1e-14);
      }
      CHECK(sum == Approx(1).epsilon(1e-14));
    }
}

TEST_CASE("The volume energy of an ideal cell is zero and that of a scaled one is known") {
  for (CellKind kind : kKinds) {
    VolumeMesh mesh = ideal_cell(kind);
    const std::vector<Vec3> lengths = {Vec3::Ones()};
    const VolumeEnergy energy(mesh, lengths, 3);
    CHECK(energy.value(mesh.positions) < 1e-28);
    for (Vec3& p : mesh.positions) p *= 2;
    CHECK(energy.value(mesh.positions) == Approx(1.5 * std::log(2) * std::log(2)).epsilon(1e-13));
    for (Vec3& p : mesh.positions) p[0] = -p[0];
    CHECK(energy.value(mesh.positions) == std::numeric_limits<double>::infinity());
  }
}

TEST_CASE("A box costs nothing where a box of its lengths is ideal") {
  VolumeMesh mesh = ideal_cell(CellKind::hex);
  const std::vector<Vec3> lengths = {Vec3(3, 0.2, 1)};
  for (Vec3& p : mesh.positions) p = p.cwiseProduct(lengths[0]);
  CHECK(VolumeEnergy(mesh, lengths, 3).value(mesh.positions) < 1e-28);
}

TEST_CASE("Gradient and Hessian of the volume energy agree with differences for every kind") {
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  for (CellKind kind : kKinds)
    for (int n : {2, 3}) {
      VolumeMesh mesh = ideal_cell(kind);
      const std::vector<Vec3> lengths = {Vec3(1.1, 0.9, 1.05)};
      const VolumeEnergy energy(mesh, lengths, n);
      std::vector<Vec3> x = mesh.positions, d(x.size());
      for (Vec3& p : x) p = 1.5 * p + 0.03 * Vec3(normal(random), normal(random), normal(random));
      for (Vec3& p : d) p = Vec3(normal(random), normal(random), normal(random));
      check_derivatives(energy, x, d, 1e-5, 1e-7);
    }
}

TEST_CASE(
    "Against references of their own, cells are undistorted in that shape, and derivatives agree with differences") {
  std::mt19937 random(12);
  std::normal_distribution<double> normal;
  for (CellKind kind : kKinds)
    for (int n : {2, 3}) {
      VolumeMesh mesh = ideal_cell(kind);
      Mat3 shape;
      shape << 1.2, 0.3, -0.1, 0.1, 0.8, 0.2, -0.2, 0.1, 0.1;
      const Mat3 reference = shape * ideal_matrix(kind);
      const VolumeEnergy energy(
          mesh, [&](Index, const Vec3&) -> const Mat3& { return reference; }, n);
      std::vector<Vec3> x = mesh.positions, d(x.size());
      for (Vec3& p : x) p = shape * p;
      CHECK(energy.value(x) < 1e-26);
      for (Vec3& p : x) p = 1.5 * p + 0.002 * Vec3(normal(random), normal(random), normal(random));
      for (Vec3& p : d) p = Vec3(normal(random), normal(random), normal(random));
      check_derivatives(energy, x, d, 1e-6, 1e-6);
    }
  const VolumeMesh mesh = ideal_cell(CellKind::hex);
  CHECK_THROWS(VolumeEnergy(
      mesh, [](Index, const Vec3&) { return Mat3(-Mat3::Identity()); }, 2));
}

TEST_CASE("A step of the size that max_step allows stays feasible, a longer one may not") {
  VolumeMesh mesh = ideal_cell(CellKind::hex);
  const std::vector<Vec3> lengths = {Vec3::Ones()};
  const VolumeEnergy energy(mesh, lengths, 2);
  std::vector<Vec3> d(mesh.positions.size(), Vec3::Zero());
  d[6] = Vec3(-2, -2, -2);
  const double t = energy.max_step(mesh.positions, d);
  CHECK(t < 0.5);
  std::vector<Vec3> moved = mesh.positions;
  moved[6] += t * d[6];
  CHECK(std::isfinite(energy.value(moved)));
  for (Vec3& p : d) p = Vec3(1, 2, 3);
  CHECK(energy.max_step(mesh.positions, d) == 1);
}

TEST_CASE("Element rules and volume energies refuse what they cannot use") {
  const VolumeMesh mesh = ideal_cell(CellKind::hex);
  CHECK_THROWS(make_element_rule(CellKind::hex, 1));
  CHECK_THROWS(VolumeEnergy(mesh, std::vector<Vec3>{}, 2));
  CHECK_THROWS(VolumeEnergy(mesh, std::vector<Vec3>{Vec3(1, -1, 1)}, 2));
  CHECK_THROWS(VolumeEnergy(mesh, std::vector<Vec3>{Vec3(1, 1, std::nan(""))}, 2));
}
