// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/energies/regularized_barrier.h"
#include "subvol/fit/energies/volume_energy.h"
#include "tests/support/sample_meshes.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <catch2/catch.hpp>

#include <cmath>
#include <random>

using namespace subvol;
using namespace subvol::internal;

namespace {

struct Value {
  double energy;
  Mat3 stress, cofactor;
  double alpha, beta, gamma;
};

Value barrier(const Mat3& jacobian, double epsilon) {
  RegularizedBatch batch;
  for (int k = 0; k < 9; ++k)
    for (int l = 0; l < kSimdLanes; ++l) batch.jacobian[k][l] = jacobian(k / 3, k % 3);
  regularized_barrier(batch, epsilon);
  Value value{batch.energy[0], {}, {}, batch.alpha[0], batch.beta[0], batch.gamma[0]};
  for (int k = 0; k < 9; ++k) {
    value.stress(k / 3, k % 3) = batch.stress[k][0];
    value.cofactor(k / 3, k % 3) = batch.cofactor[k][0];
  }
  return value;
}

Mat3 random_matrix(std::mt19937& random, double spread = 1) {
  std::normal_distribution<double> normal;
  Mat3 m;
  for (int k = 0; k < 9; ++k) m(k / 3, k % 3) = spread * normal(random);
  return m;
}

Mat3 random_rotation(std::mt19937& random) {
  Mat3 q = Eigen::JacobiSVD<Mat3>(random_matrix(random), Eigen::ComputeFullU).matrixU();
  if (q.determinant() < 0) q.col(0) *= -1;
  return q;
}

}  // namespace

TEST_CASE("The regularized barrier has the derivative of its value, for inverted Jacobians too") {
  std::mt19937 random(3);
  constexpr double kStep = 1e-6, kTolerance = 1e-6;  // central differences
  int inverted = 0;
  for (int trial = 0; trial < 100; ++trial) {
    const double epsilon = std::pow(10.0, -trial % 4);
    const Mat3 j = random_matrix(random), d = random_matrix(random);
    inverted += j.determinant() < 0;
    const Value value = barrier(j, epsilon);
    const double plus = barrier(j + kStep * d, epsilon).energy, minus = barrier(j - kStep * d, epsilon).energy;
    const double slope = value.stress.cwiseProduct(d).sum();
    INFO("trial " << trial << ", determinant " << j.determinant() << ", epsilon " << epsilon);
    CHECK(slope == Approx((plus - minus) / (2 * kStep)).epsilon(1e-4).margin(kTolerance * value.energy));
    CHECK(value.stress.norm() > 0);
  }
  CHECK(inverted > 20);
}

TEST_CASE("The regularized barrier's second derivative is positive definite") {
  std::mt19937 random(4);
  for (int trial = 0; trial < 200; ++trial) {
    const Mat3 j = random_matrix(random), d = random_matrix(random);
    const Value value = barrier(j, std::pow(10.0, -trial % 5));
    const double along_j = j.cwiseProduct(d).sum(), along_c = value.cofactor.cwiseProduct(d).sum();
    CHECK(value.alpha > 0);
    CHECK(value.alpha * d.squaredNorm() + 2 * value.beta * along_j * along_c + value.gamma * along_c * along_c > 0);
  }
}

TEST_CASE("Without regularization the barrier agrees with Hencky's energy about rotations up to second order") {
  std::mt19937 random(5);
  constexpr double kSize = 1e-3, kTiny = 1e-12;
  for (int trial = 0; trial < 20; ++trial) {
    const Mat3 j = random_rotation(random) * (Mat3::Identity() + kSize * random_matrix(random));
    const double difference = barrier(j, kTiny).energy - 13.0 / 12 - hencky(j);
    CHECK(std::abs(difference) < 50 * kSize * kSize * kSize);  // third order; measured below 12
  }
}

TEST_CASE("The regularized barrier is finite wherever the Jacobian is, and grows as epsilon falls") {
  Mat3 flat = Mat3::Identity(), mirrored = Mat3::Identity();
  flat(2, 2) = 0;
  mirrored(2, 2) = -1;
  for (const Mat3& j : {flat, mirrored, Mat3(1e4 * mirrored), Mat3(Mat3::Zero())}) {
    double before = 0;
    for (const double epsilon : {1.0, 1e-2, 1e-4, 1e-8}) {
      const Value value = barrier(j, epsilon);
      CHECK(std::isfinite(value.energy));
      CHECK(value.stress.allFinite());
      CHECK(std::isfinite(value.gamma));
      CHECK(value.energy > before);
      before = value.energy;
    }
  }
}

TEST_CASE("A regularized volume energy does not depend on place, orientation or unit") {
  std::mt19937 random(6);
  VolumeMesh mesh = test::mixed_cells();
  test::jitter(mesh, 0.8);
  REQUIRE(test::count_inverted(mesh) > 0);
  const std::vector<Vec3> lengths(mesh.num_cells(), Vec3(1, 1.2, 0.9));
  VolumeEnergy energy(mesh, lengths, 3);
  energy.set_regularization(0.1);
  const double value = energy.value(mesh.positions);
  constexpr double kScale = 7;
  const Mat3 rotation = random_rotation(random);
  std::vector<Vec3> moved, larger;
  for (const Vec3& p : mesh.positions) moved.push_back(kScale * (rotation * p) + Vec3(3, -1, 5));
  for (const Vec3& h : lengths) larger.push_back(kScale * h);
  VolumeEnergy same(mesh, larger, 3);
  same.set_regularization(0.1);
  CHECK(same.value(moved) == Approx(value).epsilon(1e-12));

  std::vector<Vec3> gradient(mesh.num_vertices(), Vec3::Zero()), direction = gradient, plus, minus;
  for (Vec3& d : direction) d = random_matrix(random).col(0);
  energy.add_gradient(mesh.positions, 1, gradient);
  constexpr double kStep = 1e-6;
  double slope = 0;
  plus = minus = mesh.positions;
  for (std::size_t i = 0; i < gradient.size(); ++i) {
    slope += gradient[i].dot(direction[i]);
    plus[i] += kStep * direction[i];
    minus[i] -= kStep * direction[i];
  }
  CHECK(slope == Approx((energy.value(plus) - energy.value(minus)) / (2 * kStep)).epsilon(1e-5));
  CHECK(energy.uncertified(mesh.positions).empty());
  energy.set_regularization(0);
  CHECK(std::isinf(energy.value(mesh.positions)));
  CHECK_FALSE(energy.uncertified(mesh.positions).empty());
}

TEST_CASE("In the form of other distortions, the regularized barrier has the same second derivative") {
  std::mt19937 random(6);
  for (int trial = 0; trial < 60; ++trial) {
    Mat3 j = random_matrix(random);
    if (trial % 4 == 1) j.col(2) = j.col(0) + j.col(1);  // flat
    if (trial % 4 == 2) j.col(1) = j.col(2) = 2 * j.col(0);
    if (trial % 8 == 3) j.setZero();
    const Mat3 d = random_matrix(random);
    const double epsilon = std::pow(10.0, -trial % 4);
    const Value value = barrier(j, epsilon);
    DistortionBatch batch;
    for (int k = 0; k < 9; ++k)
      for (int l = 0; l < kSimdLanes; ++l) batch.jacobian[k][l] = j(k / 3, k % 3);
    regularized_hessian(&batch, 1, epsilon);
    const auto matrix_of = [&](const double(*entries)[kSimdLanes]) {
      Mat3 m;
      for (int k = 0; k < 9; ++k) m(k / 3, k % 3) = entries[k][3];
      return m;
    };
    CHECK(batch.energy[3] == value.energy);
    CHECK(matrix_of(batch.stress) == value.stress);
    const Mat3 u = matrix_of(batch.u), v = matrix_of(batch.v), w = u.transpose() * d * v;
    CHECK((u.transpose() * u - Mat3::Identity()).norm() < 1e-10);
    CHECK((v.transpose() * v - Mat3::Identity()).norm() < 1e-10);
    Mat3 p;
    for (int i = 0; i < 3; ++i) {
      const int k = (i + 1) % 3, other = (i + 2) % 3;
      p(i, i) =
          batch.stretch[i][3] * w(i, i) + batch.coupling[i][3] * w(k, k) + batch.coupling[other][3] * w(other, other);
      p(i, k) = batch.pair_same[i][3] * w(i, k) + batch.pair_cross[i][3] * w(k, i);
      p(k, i) = batch.pair_same[i][3] * w(k, i) + batch.pair_cross[i][3] * w(i, k);
    }
    const Mat3 found = u * p * v.transpose();
    const Mat3 wanted =
        value.alpha * d +
        value.beta * (j * value.cofactor.cwiseProduct(d).sum() + value.cofactor * j.cwiseProduct(d).sum()) +
        value.gamma * value.cofactor * value.cofactor.cwiseProduct(d).sum();
    INFO("trial " << trial << ", determinant " << j.determinant() << ", epsilon " << epsilon);
    CHECK((found - wanted).norm() < 1e-9 * (wanted.norm() + value.alpha * d.norm()));
  }
}
