// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/energies/boundary_folds.h"

#include "subvol/fit/energies/quality_energy.h"
#include "tests/support/sample_meshes.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

using namespace subvol;
using namespace subvol::internal;

namespace {

/// Three hexes around the edge from (0, 0, 0) to (0, 0, 1), whose free faces lie at these angles, in degrees.
VolumeMesh wedge(double from, double to) {
  VolumeMesh mesh;
  const auto point = [](double angle, double radius, double z) {
    const double radians = angle * std::numbers::pi / 180;
    return Vec3(radius * std::cos(radians), radius * std::sin(radians), z);
  };
  const double part = (to - from) / 3;
  for (const double z : {0.0, 1.0}) {
    mesh.positions.push_back({0, 0, z});
    for (int k = 0; k <= 6; ++k) mesh.positions.push_back(point(from + k * part / 2, k % 2 == 0 ? 1 : 1.3, z));
  }
  for (Index k = 0; k < 3; ++k) {
    const Index a = 2 * k + 1;
    mesh.add_cell(CellKind::hex, std::vector<Index>{0, a, a + 1, a + 2, 7 + 1, 7 + a + 1, 7 + a + 2, 7 + a + 3});
  }
  return mesh;
}

/// Returns the edge with the largest angle.
std::size_t widest(const BoundaryFolds& folds, const VolumeMesh& mesh) {
  std::size_t widest = 0;
  for (std::size_t e = 0; e < folds.size(); ++e)
    if (folds.angle(e, mesh, mesh.positions) > folds.angle(widest, mesh, mesh.positions)) widest = e;
  return widest;
}

}  // namespace

TEST_CASE("Interior angles at boundary edges add up over their cells, beyond a full turn as well", "[quality]") {
  for (const double angle : {200.0, 270.0, 330.0, 359.0, 365.0, 400.0}) {
    const VolumeMesh mesh = wedge(10, 10 + angle);
    const BoundaryFolds folds(mesh);
    const std::size_t e = widest(folds, mesh);
    CHECK(folds.angle(e, mesh, mesh.positions) == Approx(angle));
    CHECK(folds.residual(e, mesh, mesh.positions) == Approx(std::max(0.0, angle - 300) / 60).margin(1e-12));
  }
  const VolumeMesh cube = test::lattice(1, 1, 1);
  const BoundaryFolds folds(cube);
  CHECK(folds.size() == 12);
  for (std::size_t e = 0; e < folds.size(); ++e) CHECK(folds.angle(e, cube, cube.positions) == Approx(90));
}

TEST_CASE("The angle that is wanted at an edge raises its limit", "[quality]") {
  const VolumeMesh mesh = wedge(0, 345);
  BoundaryFolds folds(mesh);
  const std::size_t e = widest(folds, mesh);
  const std::vector<EdgeCap> edges{{{0, 8}, 0.9, 340}};
  folds.want(edges, mesh);
  CHECK(folds.limit(e) == 350);
  CHECK(folds.residual(e, mesh, mesh.positions) == 0);
  for (std::size_t other = 0; other < folds.size(); ++other)
    if (other != e) CHECK(folds.limit(other) == 300);
}

TEST_CASE("The derivative of a fold's residual is that of its differences", "[quality]") {
  VolumeMesh mesh = wedge(10, 350);
  for (std::size_t v = 0; v < mesh.num_vertices(); ++v)  // skew faces
    mesh.positions[v] += 0.05 * Vec3(std::sin(3.0 * v), std::cos(5.0 * v), std::sin(7.0 * v + 1));
  const BoundaryFolds folds(mesh);
  const std::size_t e = widest(folds, mesh);
  const BoundaryFolds::Residual linear = folds.linearized(e, mesh, mesh.positions);
  REQUIRE(linear.value > 0);
  std::vector<Vec3> gradient(mesh.num_vertices(), Vec3::Zero());
  for (const BoundaryFolds::Side& side : linear.sides)
    for (std::size_t i = 0; i < 4; ++i) gradient[mesh.cell(side.cell)[side.corners[i]]] += side.derivative[i];
  constexpr double kStep = 1e-6;
  for (std::size_t v = 0; v < mesh.num_vertices(); ++v)
    for (int k = 0; k < 3; ++k) {
      std::vector<Vec3> after = mesh.positions, before = mesh.positions;
      after[v][k] += kStep;
      before[v][k] -= kStep;
      const double slope = (folds.residual(e, mesh, after) - folds.residual(e, mesh, before)) / (2 * kStep);
      CHECK(gradient[v][k] == Approx(slope).margin(1e-6));
    }
}

TEST_CASE("A part of the edges keeps those whose cells it has", "[quality]") {
  const VolumeMesh bar = test::lattice(3, 1, 1);
  const BoundaryFolds whole(bar);
  const std::vector<Index> cells{1, 2};
  const BoundaryFolds part(whole, cells);
  // The cells 1 and 2 have four edges each along the bar, four between them, and four at the end. Those toward cell 0
  // lack a cell.
  CHECK(part.size() == 16);
  for (std::size_t e = 0; e < part.size(); ++e)
    for (const Index c : part.cells_of(e)) CHECK((c == 0 || c == 1));
}

TEST_CASE("The quality energy opens a fold once folds are forbidden", "[quality]") {
  const VolumeMesh mesh = wedge(0, 370);
  QualityEnergy energy(mesh, std::vector<Vec3>(mesh.num_cells(), Vec3::Ones()));
  const double before = energy.value(mesh.positions);
  const double share = energy.emphasize_poor(mesh.positions, 0.1).least_share;
  energy.reset_emphasis();
  energy.forbid_folds({}, 0);
  CHECK(energy.value(mesh.positions) > before + 50);
  CHECK(energy.emphasize_poor(mesh.positions, 0.1).least_share < std::min(0.0, share));
  energy.reset_emphasis();

  std::vector<Vec3> gradient(mesh.num_vertices(), Vec3::Zero());
  energy.add_gradient(mesh.positions, 1, gradient);
  constexpr double kStep = 1e-6;
  for (std::size_t v = 0; v < mesh.num_vertices(); ++v)
    for (int k = 0; k < 3; ++k) {
      std::vector<Vec3> up = mesh.positions, down = mesh.positions;
      up[v][k] += kStep;
      down[v][k] -= kStep;
      CHECK(gradient[v][k] == Approx((energy.value(up) - energy.value(down)) / (2 * kStep)).epsilon(1e-4).margin(1e-3));
    }
}

TEST_CASE("An edge far shorter than wanted makes its cells poor, if that is asked for", "[quality]") {
  VolumeMesh mesh = test::lattice(2, 1, 1);
  for (Vec3& p : mesh.positions) p.z() *= 0.05;
  QualityEnergy energy(mesh, std::vector<Vec3>(mesh.num_cells(), Vec3::Ones()));
  energy.forbid_folds({}, 0);
  CHECK(energy.emphasize_poor(mesh.positions, 0.6).least_share == 1);
  energy.forbid_folds({}, 0.1);
  const QualityEnergy::State state = energy.emphasize_poor(mesh.positions, 0.6);
  CHECK(state.least_share == Approx(0.5));
  CHECK(state.poor.size() == 2);
}
