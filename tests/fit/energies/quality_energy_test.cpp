// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/energies/quality_energy.h"

#include "subvol/base/error.h"
#include "subvol/fit/quality/quality.h"
#include "tests/support/sample_meshes.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <random>

using namespace subvol;
using namespace subvol::internal;

namespace {

/// Two hexes, two prisms, a tet and a pyramid that share no vertex, disturbed so that all terms of the energy are
/// active.
VolumeMesh disturbed_cells(double spread) {
  VolumeMesh mesh;
  const std::vector<Vec3> corners[] = {
      {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
      {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}},
      {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}},
      {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}}};
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (const int kind : {2, 2, 1, 1, 0, 3}) {
    std::vector<Index> cell;
    for (const Vec3& p : corners[kind]) {
      cell.push_back(static_cast<Index>(mesh.positions.size()));
      mesh.positions.push_back(p + spread * Vec3(normal(random), normal(random), normal(random)));
    }
    mesh.add_cell(static_cast<CellKind>(kind), cell);
  }
  return mesh;
}

std::vector<Vec3> unit_lengths(const VolumeMesh& mesh) { return std::vector<Vec3>(mesh.num_cells(), Vec3::Ones()); }

/// Compares the gradient along a random direction with differences of the energy. Returns the curvature along it.
double check_derivatives(QualityEnergy& energy, const std::vector<Vec3>& at) {
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  std::vector<Vec3> d(at.size()), gradient(d.size(), Vec3::Zero()), product(d.size());
  for (Vec3& v : d) v = Vec3(normal(random), normal(random), normal(random));
  const double value = energy.linearize(at, 2, gradient);
  CHECK(value == Approx(energy.value(at)));
  const auto moved = [&](double t) {
    std::vector<Vec3> x = at;
    for (std::size_t i = 0; i < x.size(); ++i) x[i] += t * d[i];
    return energy.value(x);
  };
  constexpr double kStep = 1e-6;
  double slope = 0, curvature = 0;
  energy.multiply(d, product);
  for (std::size_t i = 0; i < d.size(); ++i) {
    slope += gradient[i].dot(d[i]);
    curvature += d[i].dot(product[i]);
  }
  CHECK(slope == Approx(2 * (moved(kStep) - moved(-kStep)) / (2 * kStep)).epsilon(1e-5));
  return curvature;
}

}  // namespace

TEST_CASE("The quality energy's gradient agrees with differences of its value, its Hessian is positive") {
  const VolumeMesh mesh = disturbed_cells(0.25);
  QualityEnergy energy(mesh, unit_lengths(mesh));
  energy.set_weights({.cosine = 1, .hinge = 50, .threshold = 0.9, .edge = 20, .least_edge = 1.1, .twist = 0.3});
  energy.densify(std::vector<Index>{1, 3});
  CHECK(check_derivatives(energy, mesh.positions) > 0);
}

TEST_CASE("The quality energy's derivatives are right and bounded where an edge has nearly vanished") {
  VolumeMesh mesh = test::lattice(1, 1, 1);
  const QualityWeights weights{
      .cosine = 1, .hinge = 50, .threshold = 0.9, .edge = 20, .least_edge = 0.25, .twist = 0.3};
  for (const double length : {0.06, 0.04, 1e-3, 1e-7}) {
    CAPTURE(length);
    mesh.positions[1] = mesh.positions[0] + length * Vec3(0.8, 0.36, 0.48);
    QualityEnergy energy(mesh, unit_lengths(mesh));
    energy.set_weights(weights);
    if (length > 1e-5) check_derivatives(energy, mesh.positions);  // else the step of the differences passes the kink
    std::vector<Vec3> gradient(mesh.num_vertices(), Vec3::Zero()), product(mesh.num_vertices(), Vec3::Zero());
    energy.linearize(mesh.positions, 1, gradient);
    std::vector<Vec3> along(mesh.num_vertices(), Vec3::Zero());
    along[1] = Vec3(0, 0.8, -0.6);
    energy.multiply(along, product);
    CHECK(along[1].dot(product[1]) < 1e5);
  }
}

TEST_CASE("The quality energy vanishes for cubes of the wanted size and sees the least scaled Jacobian of the check") {
  VolumeMesh mesh = test::lattice(3, 2, 2);
  const QualityEnergy energy(mesh, unit_lengths(mesh));
  CHECK(energy.value(mesh.positions) == Approx(0).margin(1e-12));
  std::mt19937 random(3);
  std::uniform_real_distribution<double> shift(-0.2, 0.2);
  for (Vec3& p : mesh.positions) p += Vec3(shift(random), shift(random), shift(random));
  std::vector<double> least(mesh.num_cells());
  energy.least_scaled_jacobians(mesh.positions, least);
  const std::vector<double> checked = measure_quality(mesh, 3).cell_minima;
  for (std::size_t c = 0; c < least.size(); ++c) CHECK(least[c] == Approx(checked[c]));
}

TEST_CASE("Emphasis rises on what is below the goal and falls back where it is not") {
  VolumeMesh mesh = test::lattice(2, 1, 1);
  mesh.positions[0] += Vec3(0.6, 0.6, 0.6);  // a corner of the first cell, of nearly no height
  QualityEnergy energy(mesh, unit_lengths(mesh));
  energy.set_weights({.cosine = 0, .hinge = 1, .threshold = 0.9, .edge = 0, .twist = 0});
  const double before = energy.value(mesh.positions);
  REQUIRE(before > 0);
  const QualityEnergy::State state = energy.emphasize_poor(mesh.positions, 0.8);
  CHECK(state.poor.size() == 1);
  CHECK(state.least < 0.8);
  CHECK(state.least_share == Approx(std::max(-1.0, state.least / 0.8)));
  CHECK(energy.value(mesh.positions) > 1.5 * before);
  energy.reset_emphasis();
  CHECK(energy.value(mesh.positions) == Approx(before));
  // Nothing is poor against a goal of nearly nothing.
  CHECK(energy.emphasize_poor(test::lattice(2, 1, 1).positions, 1e-3).poor.empty());
}

TEST_CASE("Caps lower the threshold and the goal at edges and vertices that cannot be better") {
  VolumeMesh mesh = test::lattice(1, 1, 1);
  // A parallelepiped of 60 degrees around the edge along z through vertex 0.
  for (Vec3& p : mesh.positions) p = {p.x() + 0.5 * p.y(), std::sqrt(0.75) * p.y(), p.z()};
  QualityEnergy energy(mesh, unit_lengths(mesh));
  energy.set_weights({.cosine = 0, .hinge = 1, .threshold = 1, .edge = 0, .twist = 0});
  const double free = energy.value(mesh.positions);
  REQUIRE(free > 0);
  std::vector<EdgeCap> edges;
  for (Index v = 0; v < 4; ++v) edges.push_back({{static_cast<Index>(v + 4), v}, 0.5});
  energy.set_caps(edges, {});
  CHECK(energy.value(mesh.positions) < free);
  CHECK(energy.emphasize_poor(mesh.positions, 0.95).least_share == Approx(std::sqrt(0.75) / 0.95));  // inside the cell
  energy.reset_emphasis();
  energy.set_caps({}, std::vector<VertexCap>{{0, 0.5}});
  CHECK(energy.value(mesh.positions) < free);
  energy.set_caps({}, {});
  CHECK(energy.value(mesh.positions) == Approx(free));
}

TEST_CASE("A cell whose cap is zero reaches its goal if it is not inverted; inverted cells are equally poor") {
  VolumeMesh mesh = test::lattice(1, 1, 1);
  QualityEnergy energy(mesh, unit_lengths(mesh));
  energy.set_caps({}, std::vector<VertexCap>{{0, 0}});
  CHECK(energy.emphasize_poor(mesh.positions, 0.65).least_share == 1);
  mesh.positions[0] = {2, 2, 2};
  CHECK(energy.emphasize_poor(mesh.positions, 0.65).least_share == -1);
}

TEST_CASE("Cells that a step ruins are named, with their vertices") {
  const VolumeMesh mesh = test::lattice(2, 1, 1);
  const QualityEnergy energy(mesh, unit_lengths(mesh));
  std::vector<Vec3> after = mesh.positions;
  after[0] = {2, 2, 2};
  CHECK(energy.ruined(mesh.positions, after) == std::vector<Index>{0});
  CHECK(energy.ruined(mesh.positions, mesh.positions).empty());
  CHECK(energy.nodes_of(std::vector<Index>{0}).size() == 8);
  CHECK(energy.uncertified(after) == std::vector<Index>{0});
}

TEST_CASE("The quality energy refuses what it cannot use") {
  const VolumeMesh mesh = test::lattice(1, 1, 1);
  CHECK_THROWS_AS(QualityEnergy(mesh, {}), InputError);
  CHECK_THROWS_AS(QualityEnergy(mesh, std::vector<Vec3>{{1, 0, 1}}), InputError);
  QualityEnergy energy(mesh, unit_lengths(mesh));
  CHECK_THROWS_AS(energy.set_weights({.hinge = -1}), InputError);
  CHECK_THROWS_AS(energy.set_weights({.threshold = 1.5}), InputError);
  CHECK_THROWS_AS(energy.densify(std::vector<Index>{1}), InputError);
}
