// SPDX-License-Identifier: GPL-3.0-or-later
// The distortions that can be chosen by name, at one Jacobian and over cells of all kinds and orders.

#include "subvol/fit/energies/distortion.h"
#include "samples/shapes.h"
#include "subvol/fit/elements/element_rule.h"
#include "subvol/fit/energies/high_order_energy.h"
#include "subvol/fit/energies/volume_energy.h"
#include "subvol/fit/high_order_fit.h"
#include "subvol/fit/mesh_check.h"
#include "subvol/fit/quality/high_order_quality.h"
#include "subvol/fit/subdivision_fit.h"
#include "tests/support/element_fixtures.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

constexpr Distortion kAll[] = {Distortion::hencky, Distortion::inverse_mean_ratio, Distortion::condition_number};
constexpr double kNoFloor = -std::numeric_limits<double>::infinity();

using Tensor = Eigen::Matrix<double, 9, 9>;
using Vector9 = Eigen::Matrix<double, 9, 1>;

double by_definition(Distortion distortion, const Mat3& j) {
  switch (distortion) {
    case Distortion::hencky: return 0.5 * Eigen::JacobiSVD<Mat3>(j).singularValues().array().log().square().sum();
    case Distortion::inverse_mean_ratio: return j.squaredNorm() / (3 * std::pow(j.determinant(), 2.0 / 3)) - 1;
    case Distortion::condition_number: return j.norm() * j.inverse().norm() / 3 - 1;
  }
  return 0;
}

DistortionBatch evaluated(Distortion distortion, const Mat3& j, double floor = kHessianFloor) {
  DistortionBatch batch;
  batch.floor = floor;
  for (int e = 0; e < 9; ++e)
    for (int l = 0; l < kSimdLanes; ++l) batch.jacobian[e][l] = j(e / 3, e % 3);
  kernels_of(distortion).hessian(&batch, 1);
  return batch;
}

Mat3 matrix(const double (*entries)[kSimdLanes]) {
  Mat3 m;
  for (int e = 0; e < 9; ++e) m(e / 3, e % 3) = entries[e][0];
  return m;
}

/// The second derivative as the batch describes it, by entries of J row by row.
Tensor second_derivative(const DistortionBatch& batch, bool coupled) {
  const Mat3 u = matrix(batch.u), v = matrix(batch.v);
  const auto outer = [&](int i, int j) {
    const Mat3 m = u.col(i) * v.col(j).transpose();
    Vector9 row;
    for (int e = 0; e < 9; ++e) row[e] = m(e / 3, e % 3);
    return row;
  };
  Tensor h = Tensor::Zero();
  for (int i = 0; i < 3; ++i) {
    const int k = (i + 1) % 3;
    h += batch.stretch[i][0] * outer(i, i) * outer(i, i).transpose();
    h += batch.pair_same[i][0] * (outer(i, k) * outer(i, k).transpose() + outer(k, i) * outer(k, i).transpose());
    h += batch.pair_cross[i][0] * (outer(i, k) * outer(k, i).transpose() + outer(k, i) * outer(i, k).transpose());
    if (coupled)
      h += batch.coupling[i][0] * (outer(i, i) * outer(k, k).transpose() + outer(k, k) * outer(i, i).transpose());
  }
  return h;
}

Tensor differences_of_stress(Distortion distortion, const Mat3& j) {
  const double h = 1e-5;
  Tensor result;
  for (int c = 0; c < 9; ++c) {
    Mat3 plus = j, minus = j;
    plus(c / 3, c % 3) += h;
    minus(c / 3, c % 3) -= h;
    const Mat3 change =
        (matrix(evaluated(distortion, plus).stress) - matrix(evaluated(distortion, minus).stress)) / (2 * h);
    for (int r = 0; r < 9; ++r) result(r, c) = change(r / 3, r % 3);
  }
  return result;
}

std::vector<Mat3> test_jacobians() {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  std::vector<Mat3> result = {Mat3::Identity(), 1.7 * Mat3::Identity(), Vec3(2, 2, 1).asDiagonal(),
                              Vec3(1, 1.00001, 0.4).asDiagonal()};
  while (result.size() < 60) {
    Mat3 j = Mat3::Identity();
    for (int e = 0; e < 9; ++e) j(e / 3, e % 3) += (result.size() % 2 ? 0.15 : 0.5) * normal(random);
    if (j.determinant() > 0.05) result.push_back(j);
  }
  return result;
}

std::vector<Vec3> moved(std::vector<Vec3> x, const std::vector<Vec3>& d, double t) {
  for (std::size_t i = 0; i < x.size(); ++i) x[i] += t * d[i];
  return x;
}

/// Value, gradient and exact second derivative along d against central differences; the clamped one is positive.
template <class Energy>
void check_derivatives(Energy& energy, Distortion distortion, const std::vector<Vec3>& x, const std::vector<Vec3>& d,
                       double tolerance) {
  constexpr double h = 1e-5;
  const auto times = [&](const std::vector<Vec3>& a) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].dot(d[i]);
    return sum;
  };
  std::vector<Vec3> gradient(x.size(), Vec3::Zero()), plus = gradient, minus = gradient, unused = gradient,
                                                      product(x.size());
  energy.set_distortion(distortion, kNoFloor);
  CHECK(energy.add_gradient(x, 1, gradient) == Approx(energy.value(x)).epsilon(1e-14));
  CHECK(times(gradient) ==
        Approx((energy.value(moved(x, d, h)) - energy.value(moved(x, d, -h))) / (2 * h)).epsilon(1e-6));
  energy.add_gradient(moved(x, d, h), 1, plus);
  energy.add_gradient(moved(x, d, -h), 1, minus);
  energy.linearize(x, 1, unused);
  energy.multiply(d, product);
  double largest = 0, error = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    largest = std::max(largest, product[i].norm());
    error = std::max(error, (product[i] - (plus[i] - minus[i]) / (2 * h)).norm());
  }
  CHECK(error < tolerance * largest);
  const double exact = times(product);
  energy.set_distortion(distortion);
  energy.linearize(x, 1, unused);
  energy.multiply(d, product);
  CHECK(times(product) > 0);
  CHECK(times(product) > exact - 1e-5 * std::abs(exact));
}

}  // namespace

TEST_CASE("Singular vectors and stress are as accurate as the Jacobian, be singular values equal, close or far apart") {
  std::mt19937 random(6);
  std::normal_distribution<double> normal;
  const auto rotation = [&] {
    return Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
        .normalized()
        .toRotationMatrix();
  };
  const Vec3 values[] = {{1, 1, 1},         {2, 2, 1},       {2, 1, 1},          {3, 2, 1},
                         {1, 1e-3, 1e-6},   {1, 1, 1e-7},    {1e4, 1, 1},        {1, 1 + 1e-9, 1 + 2e-9},
                         {5, 5, 5 + 1e-12}, {7e5, 8e5, 9e5}, {1e-5, 2e-5, 4e-5}, {1, 2, 2 + 1e-8}};
  for (const Vec3& s : values)
    for (int k = 0; k < 100; ++k) {
      const Mat3 left = k == 0 ? Mat3(Mat3::Identity()) : rotation(), right = k < 2 ? Mat3::Identity() : rotation();
      const Mat3 j = left * s.asDiagonal() * right.transpose();
      const DistortionBatch batch = evaluated(Distortion::hencky, j);
      const Mat3 u = matrix(batch.u), v = matrix(batch.v);
      const Vec3 logs = s.array().log();
      const double error = 1e-14 * s.maxCoeff() / s.minCoeff();  // what rounding J does to the least singular value
      CAPTURE(s.transpose(), k);
      CHECK(std::abs(batch.energy[0] - 0.5 * logs.squaredNorm()) <= error * (error + logs.norm()));
      CHECK((v.transpose() * v - Mat3::Identity()).norm() < 1e-14);
      CHECK((u.transpose() * u - Mat3::Identity()).norm() < 1e-14 + error);
      const Mat3 expected = left * logs.cwiseQuotient(s).asDiagonal() * right.transpose();
      CHECK((matrix(batch.stress) - expected).norm() <= error * ((1 + logs.cwiseAbs().maxCoeff()) / s.minCoeff()));
    }
}

TEST_CASE("Distortions are what their definitions say, 0 where cells are ideal, infinite where they are inverted") {
  for (Distortion distortion : kAll) {
    CAPTURE(to_string(distortion));
    for (const Mat3& j : test_jacobians())
      CHECK(evaluated(distortion, j).energy[0] == Approx(by_definition(distortion, j)).epsilon(1e-9).margin(1e-12));
    const Mat3 turned = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
    CHECK(std::abs(evaluated(distortion, turned).energy[0]) < 1e-14);
    if (distortion != Distortion::hencky) {
      CHECK(std::abs(evaluated(distortion, 3 * turned).energy[0]) < 1e-14);
      CHECK(matrix(evaluated(distortion, 3 * turned).stress).norm() < 1e-14);
    }
    const DistortionBatch inverted = evaluated(distortion, Vec3(1, 1, -1).asDiagonal());
    CHECK(inverted.energy[0] == std::numeric_limits<double>::infinity());
    CHECK(matrix(inverted.stress).norm() == 0);
    CHECK(second_derivative(inverted, distortion != Distortion::hencky).norm() == 0);
    // Towards inversion all grow without bound.
    CHECK(evaluated(distortion, Vec3(1, 1, 1e-6).asDiagonal()).energy[0] > 50);
  }
}

TEST_CASE("Batches of Jacobians worked on side by side give what they give alone") {
  for (Distortion distortion : kAll) {
    std::vector<DistortionBatch> together, alone;
    for (const Mat3& j : test_jacobians()) alone.push_back(evaluated(distortion, j));
    alone.push_back(evaluated(distortion, Vec3(1, 1, -1).asDiagonal()));
    if (alone.size() % 2 == 0) alone.push_back(evaluated(distortion, Vec3(1, 2, 3).asDiagonal()));
    for (const DistortionBatch& batch : alone) {
      DistortionBatch& copy = together.emplace_back();
      copy.floor = batch.floor;
      std::copy_n(&batch.jacobian[0][0], 9 * kSimdLanes, &copy.jacobian[0][0]);
    }
    kernels_of(distortion).hessian(together.data(), static_cast<int>(together.size()));
    for (std::size_t n = 0; n < alone.size(); ++n) {
      CHECK(together[n].energy[kSimdLanes - 1] == Approx(alone[n].energy[0]).margin(1e-14));
      CHECK((matrix(together[n].stress) - matrix(alone[n].stress)).norm() <=
            1e-13 * (1 + matrix(alone[n].stress).norm()));
    }
  }
}

TEST_CASE(
    "Stress and second derivative of every distortion agree with differences, and the clamped one is the nearest") {
  for (Distortion distortion : kAll) {
    CAPTURE(to_string(distortion));
    const bool coupled = kernels_of(distortion).coupled;
    for (const Mat3& j : test_jacobians()) {
      const double h = 1e-6;
      const Mat3 stress = matrix(evaluated(distortion, j).stress);
      for (int e = 0; e < 9; ++e) {
        Mat3 plus = j, minus = j;
        plus(e / 3, e % 3) += h;
        minus(e / 3, e % 3) -= h;
        const double slope = (by_definition(distortion, plus) - by_definition(distortion, minus)) / (2 * h);
        CHECK(slope == Approx(stress(e / 3, e % 3)).epsilon(1e-5).margin(1e-6 * (1 + stress.norm())));
      }
      const Tensor expected = differences_of_stress(distortion, j);
      const Tensor exact = second_derivative(evaluated(distortion, j, kNoFloor), coupled);
      CHECK((exact - expected).norm() < 1e-5 * (1 + expected.norm()));
      const Eigen::SelfAdjointEigenSolver<Tensor> eigen(0.5 * (exact + exact.transpose()));
      const Tensor clamped = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(kHessianFloor).asDiagonal() *
                             eigen.eigenvectors().transpose();
      CHECK((second_derivative(evaluated(distortion, j), coupled) - clamped).norm() < 1e-9 * (1 + clamped.norm()));
    }
  }
}

TEST_CASE("Every distortion's derivatives over cells of every kind and order agree with differences",
          "[elements][slow]") {
  PointSource source(6);
  for (CellKind kind : kAllKinds) {
    const VolumeMesh mesh = single_cell(kind);
    for (Distortion distortion : kAll)
      for (int order : {1, 2, 4, 8}) {
        if (order == 8 && kind == CellKind::tet) continue;
        CAPTURE(to_string(distortion), static_cast<int>(kind), order);
        const ElementSpace space(mesh, Basis::fourier, order);
        HighOrderEnergy energy(space, std::vector{Vec3(1.1, 0.9, 1.05)}, std::vector{2 * order + 1});
        std::vector<Vec3> x = HighOrderMesh(space, mesh).coefficients, d(space.num_nodes());
        for (Vec3& p : x) p = 1.2 * p + 0.05 / (order * order) * (source.vector() - Vec3::Constant(0.5));
        for (Vec3& v : d) v = source.vector() - Vec3::Constant(0.5);
        check_derivatives(energy, distortion, x, d, 1e-6);
        if (order > 1) continue;
        VolumeEnergy linear(mesh, std::vector{Vec3(1.1, 0.9, 1.05)}, 3);
        linear.set_distortion(distortion);
        energy.set_distortion(distortion);
        CHECK(linear.value(x) == Approx(energy.value(x)).epsilon(1e-12));
        check_derivatives(linear, distortion, x, d, 1e-5);  // its blocks are of single precision
      }
  }
}

TEST_CASE("Fits reach the surface with every distortion, with valid cells", "[slow]") {
  const samples::Sample sample = samples::ball_sample();
  for (Distortion distortion : kAll) {
    CAPTURE(to_string(distortion));
    const FitResult linear =
        fit_subdivision_volume(sample.target, sample.template_mesh, {.levels = 1, .distortion = distortion});
    CHECK(linear.report.stop_reason == StopReason::converged);
    CHECK(check_mesh(linear.mesh).valid());
    CHECK(check_mesh(linear.mesh, &sample.target).mean_distance_percent() < 2.6);
    const HighOrderFitResult curved =
        fit_high_order(sample.target, sample.template_mesh, {.order = 2, .distortion = distortion});
    CHECK(curved.report.stop_reason == StopReason::converged);
    CHECK(measure_quality(curved.mesh).inverted_cells == 0);
  }
}
