// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/energies/high_order_energy.h"
#include "subvol/base/error.h"
#include "subvol/fit/elements/element_rule.h"
#include "subvol/fit/energies/volume_energy.h"
#include "subvol/fit/quality/quality.h"
#include "tests/support/element_fixtures.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/threads.h"

#include <Eigen/LU>
#include <catch2/catch.hpp>

#include <cmath>
#include <limits>
#include <memory>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

std::vector<int> points_of(const ElementSpace& space, int n) { return std::vector<int>(space.num_cells(), n); }

/// Cells half again as large as ideal ones, bent a little: there no eigenvalue of the Hessian is clamped.
std::vector<Vec3> bent(const ElementSpace& space, const VolumeMesh& mesh, PointSource& source, double amount) {
  HighOrderMesh curved(space, mesh);
  for (std::size_t i = 0; i < curved.coefficients.size(); ++i) {
    Vec3& x = curved.coefficients[i];
    x = 1.5 * x + amount * (source.vector() - Vec3::Constant(0.5));
  }
  return curved.coefficients;
}

std::vector<Vec3> moved_along(std::vector<Vec3> x, const std::vector<Vec3>& d, double t) {
  for (std::size_t i = 0; i < x.size(); ++i) x[i] += t * d[i];
  return x;
}

void check_derivatives(VolumeTerm& energy, const std::vector<Vec3>& x, const std::vector<Vec3>& d) {
  constexpr double h = 1e-5, scale = 0.7;
  std::vector<Vec3> gradient(x.size(), Vec3::Zero()), again = gradient, plus = gradient, minus = gradient,
                                                      product(x.size());
  const double value = energy.value(x);
  CHECK(energy.add_gradient(x, scale, gradient) == Approx(value).epsilon(1e-14));
  CHECK(energy.linearize(x, scale, again) == Approx(value).epsilon(1e-14));
  double slope = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    CHECK((gradient[i] - again[i]).norm() < 1e-14);
    slope += gradient[i].dot(d[i]);
  }
  CHECK(slope == Approx(scale * (energy.value(moved_along(x, d, h)) - energy.value(moved_along(x, d, -h))) / (2 * h))
                     .epsilon(1e-7));
  energy.add_gradient(moved_along(x, d, h), scale, plus);
  energy.add_gradient(moved_along(x, d, -h), scale, minus);
  energy.multiply(d, product);
  double largest = 0, error = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    largest = std::max(largest, product[i].norm());
    error = std::max(error, (product[i] - (plus[i] - minus[i]) / (2 * h)).norm());
  }
  CHECK(error < 1e-6 * largest);
}

}  // namespace

TEST_CASE("at order 1, the energy of curved cells is that of linear ones", "[elements]") {
  PointSource source(1);
  for (CellKind kind : {CellKind::prism, CellKind::hex}) {
    VolumeMesh mesh = single_cell(kind);
    for (Vec3& p : mesh.positions) p += 0.1 * source.vector();
    const ElementSpace space(mesh, Basis::fourier, 1);
    const std::vector<Vec3> lengths = {Vec3(1.1, 0.8, 0.9)};
    const VolumeEnergy linear(mesh, lengths, 3);
    const HighOrderEnergy curved(space, lengths, points_of(space, 3));
    CHECK(curved.value(mesh.positions) == Approx(linear.value(mesh.positions)).epsilon(1e-13));
    std::vector<Vec3> a(mesh.num_vertices(), Vec3::Zero()), b = a;
    linear.add_gradient(mesh.positions, 2, a);
    curved.add_gradient(mesh.positions, 2, b);
    for (std::size_t i = 0; i < a.size(); ++i) CHECK((a[i] - b[i]).norm() < 1e-13);
  }
}

TEST_CASE("gradient and Hessian of curved cells agree with differences for every kind, basis and order",
          "[elements][slow]") {
  PointSource source(2);
  for (CellKind kind : kAllKinds)
    for (Basis basis : kBothBases)
      for (int order : {1, 2, 4, 8}) {
        if (order == 8 && kind == CellKind::tet && basis == Basis::fourier) continue;
        const VolumeMesh mesh = single_cell(kind);
        const ElementSpace space(mesh, basis, order);
        HighOrderEnergy energy(space, std::vector{Vec3(1.1, 0.9, 1.05)}, points_of(space, 2 * order + 1));
        std::vector<Vec3> d(space.num_nodes());
        for (Vec3& v : d) v = source.vector() - Vec3::Constant(0.5);
        check_derivatives(energy, bent(space, mesh, source, 0.05 / (order * order)), d);
      }
}

TEST_CASE("the regularized barrier of curved cells is finite if they are inverted, with the derivatives of its value",
          "[elements]") {
  PointSource source(7);
  for (CellKind kind : kAllKinds)
    for (Basis basis : kBothBases) {
      const VolumeMesh mesh = single_cell(kind);
      const ElementSpace space(mesh, basis, 3);
      HighOrderEnergy energy(space, std::vector{Vec3(1.1, 0.9, 1.05)}, points_of(space, 5));
      std::vector<Vec3> x = bent(space, mesh, source, 0.05), d(space.num_nodes());
      x[0] += 3 * (x[1] - x[0]);
      for (Vec3& v : d) v = source.vector() - Vec3::Constant(0.5);
      CHECK(std::isinf(energy.value(x)));
      energy.set_regularization(0.1);
      const double value = energy.value(x);
      REQUIRE(std::isfinite(value));
      CHECK(energy.uncertified(x).empty());
      CHECK(energy.not_certified(x).size() == 1);
      CHECK(energy.max_step(x, d) == 1);
      std::vector<double> least(1);
      energy.least_determinants(x, least);
      CHECK(least[0] < 0);

      constexpr double h = 1e-6;
      std::vector<Vec3> gradient(x.size(), Vec3::Zero()), again = gradient, product = gradient;
      CHECK(energy.add_gradient(x, 1, gradient) == Approx(value));
      CHECK(energy.linearize(x, 1, again) == Approx(value));
      energy.multiply(d, product);
      double slope = 0, curvature = 0;
      for (std::size_t i = 0; i < x.size(); ++i) {
        CHECK((gradient[i] - again[i]).norm() < 1e-12 * (1 + gradient[i].norm()));
        slope += gradient[i].dot(d[i]);
        curvature += product[i].dot(d[i]);
      }
      CHECK(slope ==
            Approx((energy.value(moved_along(x, d, h)) - energy.value(moved_along(x, d, -h))) / (2 * h)).epsilon(1e-5));
      CHECK(curvature > 0);
      energy.set_regularization(0);
      CHECK(std::isinf(energy.value(x)));
    }
}

TEST_CASE("cells of curved meshes weigh as they are told to", "[elements]") {
  const VolumeMesh mesh = lattice(2, 1, 1);
  const ElementSpace space(mesh, Basis::legendre, 2);
  HighOrderEnergy energy(space, std::vector(2, Vec3(1, 1, 1)), points_of(space, 5));
  HighOrderMesh curved(space, mesh);
  for (std::size_t v = 0; v < mesh.num_vertices(); ++v)
    if (curved.coefficients[v].x() == 2) curved.coefficients[v].x() = 3;  // the second cell is twice as long
  const double alone = 2 * energy.value(curved.coefficients);
  CHECK(alone == Approx(0.5 * std::log(2) * std::log(2)));
  energy.set_weights(std::vector{1.0, 3.0});
  CHECK(energy.value(curved.coefficients) == Approx(0.75 * alone));
  energy.densify(std::vector<Index>{0}, curved.coefficients);
  CHECK(energy.value(curved.coefficients) == Approx(0.75 * alone));
  CHECK_THROWS_AS(energy.set_weights(std::vector{1.0}), InputError);
  CHECK_THROWS_AS(energy.set_weights(std::vector{1.0, 0.0}), InputError);
  CHECK_THROWS_AS(energy.set_regularization(-1), InputError);
}

TEST_CASE("gradient and Hessian of a mesh of all kinds and mixed orders agree with differences", "[elements]") {
  PointSource source(3);
  const VolumeMesh mesh = mixed_cells();
  const MeshTopology topology(mesh);
  EntityOrders orders = EntityOrders::uniform(topology, 1);
  std::uniform_int_distribution<int> uniform(1, 4);
  for (auto* list : {&orders.edges, &orders.faces, &orders.cells})
    for (int& order : *list) order = uniform(source.random());
  orders.raise_borders(topology);
  const ElementSpace space(mesh, Basis::fourier, orders);
  HighOrderEnergy energy(space, std::vector(space.num_cells(), Vec3(0.8, 0.8, 0.8)), points_of(space, 7));
  std::vector<Vec3> d(space.num_nodes());
  for (Vec3& v : d) v = source.vector() - Vec3::Constant(0.5);
  check_derivatives(energy, bent(space, mesh, source, 0.01), d);
}

TEST_CASE("the hinge of curved cells is that of scaled Jacobians, with their derivatives", "[elements]") {
  PointSource source(6);
  constexpr double kWeight = 1e6, kBelow = 1e-4, kStep = 1e-6;
  Mat3 shear = Mat3::Identity();
  shear(0, 1) = 0.4, shear(1, 2) = -0.3;
  for (CellKind kind : kAllKinds) {
    VolumeMesh mesh = single_cell(kind);
    for (Vec3& p : mesh.positions) p = shear * p;  // s is the same everywhere
    const double s = measure_quality(mesh).min_scaled_jacobian;
    const ElementSpace space(mesh, Basis::legendre, 2);
    const std::vector<Vec3> x = HighOrderMesh(space, mesh).coefficients;
    HighOrderEnergy plain(space, std::vector{Vec3(1, 1, 1)}, points_of(space, 3)),
        hinged(space, std::vector{Vec3(1, 1, 1)}, points_of(space, 3));
    hinged.set_hinge(kWeight, s - kBelow);
    CHECK(hinged.value(x) == plain.value(x));
    hinged.set_hinge(kWeight, s + kBelow);
    CHECK(hinged.value(x) - plain.value(x) == Approx(kWeight * kBelow * kBelow).epsilon(1e-9));

    std::vector<Vec3> d(x.size()), g(x.size(), Vec3::Zero()), h = g, of_plain(x.size()), of_hinged(x.size());
    for (Vec3& v : d) v = source.vector() - Vec3::Constant(0.5);
    const auto penalty = [&](double t) {
      std::vector<Vec3> moved = x;
      for (std::size_t i = 0; i < x.size(); ++i) moved[i] += t * d[i];
      return hinged.value(moved) - plain.value(moved);
    };
    plain.linearize(x, 1, g);
    hinged.linearize(x, 1, h);
    plain.multiply(d, of_plain);
    hinged.multiply(d, of_hinged);
    double slope = 0, curvature = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      slope += (h[i] - g[i]).dot(d[i]);
      curvature += (of_hinged[i] - of_plain[i]).dot(d[i]);
    }
    CHECK(slope == Approx((penalty(kStep) - penalty(-kStep)) / (2 * kStep)).epsilon(1e-4));
    // The Hessian is that of Gauss-Newton, which lacks a term that is proportional to kBelow.
    const double difference = (penalty(kStep) - 2 * penalty(0) + penalty(-kStep)) / (kStep * kStep);
    CHECK(curvature == Approx(difference).epsilon(0.01));
  }
  const ElementSpace space(single_cell(CellKind::hex), Basis::legendre, 2);
  HighOrderEnergy energy(space, std::vector{Vec3(1, 1, 1)}, points_of(space, 3));
  CHECK_THROWS_AS(energy.set_hinge(-1, 0.5), InputError);
  CHECK_THROWS_AS(energy.set_hinge(1, 1.5), InputError);
}

TEST_CASE("curved cells are undistorted against references that follow them", "[elements]") {
  PointSource source(4);
  for (CellKind kind : kAllKinds) {
    const VolumeMesh mesh = single_cell(kind);
    const ElementSpace space(mesh, Basis::legendre, 3);
    HighOrderMesh curved(space, mesh);
    for (std::size_t i = mesh.num_vertices(); i < curved.coefficients.size(); ++i)
      curved.coefficients[i] = 0.05 * source.vector();
    for (QuadratureRule rule : {QuadratureRule::trapezoidal, QuadratureRule::gauss_lobatto}) {
      const HighOrderEnergy energy(
          space, [&](Index c, const Vec3& u) { return curved.jacobian(c, u); }, points_of(space, 5), rule);
      CHECK(energy.value(curved.coefficients) < 1e-26);
    }
    CHECK_THROWS_AS(HighOrderEnergy(
                        space, [](Index, const Vec3&) { return Mat3(-Mat3::Identity()); }, points_of(space, 3)),
                    InputError);
  }
}

TEST_CASE("an inverted curved cell costs infinity and leaves the gradient alone; max_step stops before", "[elements]") {
  const VolumeMesh mesh = single_cell(CellKind::hex);
  const ElementSpace space(mesh, Basis::fourier, 2);
  HighOrderEnergy energy(space, std::vector{Vec3(1, 1, 1)}, points_of(space, 5));
  std::vector<Vec3> x = HighOrderMesh(space, mesh).coefficients, d(x.size(), Vec3::Zero());
  CHECK(energy.value(x) < 1e-28);
  CHECK(energy.uncertified(x).empty());
  d[space.cell_nodes(0)] = Vec3(10, 0, 0);
  const std::vector<Vec3> folded = moved_along(x, d, 1);
  std::vector<Vec3> gradient(x.size(), Vec3::Zero());
  CHECK(energy.value(folded) == std::numeric_limits<double>::infinity());
  CHECK(energy.add_gradient(folded, 1, gradient) == std::numeric_limits<double>::infinity());
  for (const Vec3& g : gradient) CHECK(g.norm() == 0);
  CHECK(energy.uncertified(folded) == std::vector<Index>{0});
  const double step = energy.max_step(x, d);
  CHECK((step > 0 && step < 1));
  CHECK(std::isfinite(energy.value(moved_along(x, d, step))));
  CHECK(energy.points_per_direction()[0] == 5);
  energy.densify(std::vector<Index>{0}, x);
  CHECK(energy.points_per_direction()[0] == 9);
  CHECK(energy.num_points() == 9 * 9 * 9);
}

TEST_CASE("points of poor shape weigh more, the mean of all weights staying 1", "[elements]") {
  // Two hexes, the second sheared to a scaled Jacobian of 0.3: it lacks half of 0.6, and weighs 1 + k / 4.
  const VolumeMesh cube = single_cell(CellKind::hex);
  VolumeMesh sheared = cube;
  for (Vec3& p : sheared.positions) p = 1.1 * Vec3(p.x() + std::sqrt(1 - 0.3 * 0.3) * p.y(), 0.3 * p.y(), p.z());
  VolumeMesh both = cube;
  both.positions.insert(both.positions.end(), sheared.positions.begin(), sheared.positions.end());
  for (const Index v : sheared.cell(0)) both.cell_vertices.push_back(v + static_cast<Index>(cube.num_vertices()));
  both.cell_offsets.push_back(both.cell_vertices.size());
  both.kinds.push_back(CellKind::hex);
  const auto of_one = [](const VolumeMesh& mesh) {
    const ElementSpace space(mesh, Basis::fourier, 2);
    return HighOrderEnergy(space, std::vector{Vec3(0.9, 1, 1)}, points_of(space, 5))
        .value(HighOrderMesh(space, mesh).coefficients);
  };
  const double good = of_one(cube), poor = of_one(sheared);
  const auto weighed = [&](double k) {
    const double mean = (2 + k / 4) / 2;
    return (good + (1 + k / 4) * poor) / (2 * mean);
  };
  const ElementSpace space(both, Basis::fourier, 2);
  HighOrderEnergy energy(space, std::vector(2, Vec3(0.9, 1, 1)), points_of(space, 5));
  const std::vector<Vec3> x = HighOrderMesh(space, both).coefficients;
  CHECK(energy.value(x) == Approx(weighed(0)));
  energy.emphasize_poor(x, 8);
  CHECK(energy.value(x) == Approx(weighed(8)));
  energy.densify(std::vector<Index>{0}, x);  // finer, and of good shape
  CHECK(energy.value(x) == Approx(weighed(8)));
  energy.emphasize_poor(x, 0);
  CHECK(energy.value(x) == Approx(weighed(0)));
  for (const double k : {4, 8, 16}) {
    energy.densify(std::vector<Index>{1}, x);
    CHECK(energy.value(x) == Approx(weighed(k)));
  }
  HighOrderEnergy plain(space, std::vector(2, Vec3(0.9, 1, 1)), points_of(space, 5));
  plain.set_most_own_emphasis(0);
  plain.densify(std::vector<Index>{1}, x);
  CHECK(plain.value(x) == Approx(weighed(0)));
  for (const double k : {-1.0, 2000.0, std::numeric_limits<double>::quiet_NaN()})
    CHECK_THROWS_AS(plain.emphasize_poor(x, k), InputError);
}

TEST_CASE("the derivatives of an energy with emphasis match it, and inverted points may be weighed", "[elements]") {
  PointSource source(6);
  const VolumeMesh mesh = mixed_cells();
  const ElementSpace space(mesh, Basis::fourier, 2);
  HighOrderEnergy energy(space, std::vector(space.num_cells(), Vec3(0.8, 0.8, 0.8)), points_of(space, 5));
  const std::vector<Vec3> x = bent(space, mesh, source, 0.01);
  std::vector<Vec3> poor = x;
  for (Vec3& p : poor) p.x() += 3 * p.y();  // other shapes for other kinds
  std::vector<Vec3> d(space.num_nodes());
  for (Vec3& v : d) v = source.vector() - Vec3::Constant(0.5);
  const double equal = energy.value(x);
  energy.emphasize_poor(poor, 50);
  CHECK(energy.value(x) != Approx(equal).epsilon(1e-6));
  check_derivatives(energy, x, d);
  energy.emphasize_poor(std::vector<Vec3>(x.size(), Vec3::Zero()), 50);  // all alike
  CHECK(energy.value(x) == Approx(equal));
}

TEST_CASE("points that would stop a step short are made stiffer, others are not", "[elements]") {
  const VolumeMesh mesh = single_cell(CellKind::hex);
  const ElementSpace space(mesh, Basis::fourier, 2);
  HighOrderEnergy energy(space, std::vector{Vec3(1, 1, 1)}, points_of(space, 5));
  const std::vector<Vec3> x = HighOrderMesh(space, mesh).coefficients;
  std::vector<Vec3> d(x.size(), Vec3::Zero()), gradient = d, soft = d, stiff = d;
  d[space.cell_nodes(0)] = Vec3(10, 0, 0);
  energy.linearize(x, 1, gradient);
  energy.multiply(d, soft);
  const double step = energy.max_step(x, d);
  CHECK(!energy.stiffen(x, d, 0.99 * step));
  energy.multiply(d, stiff);
  CHECK(stiff == soft);
  CHECK(energy.stiffen(x, d, 1.5 * step));
  energy.multiply(d, stiff);
  const double ratio = stiff[space.cell_nodes(0)].x() / soft[space.cell_nodes(0)].x();
  CHECK((ratio > 1 && ratio < 10));
}

/// Products are with numbers kept in single precision.
TEST_CASE("cells are made stiffer as a whole, others are not", "[elements]") {
  PointSource source(8);
  const VolumeMesh mesh = mixed_cells();
  const ElementSpace space(mesh, Basis::fourier, 2);
  HighOrderEnergy energy(space, std::vector(space.num_cells(), Vec3(0.8, 0.8, 0.8)), points_of(space, 5));
  const std::vector<Vec3> x = bent(space, mesh, source, 0.01);
  std::vector<Vec3> d(x.size()), gradient(x.size(), Vec3::Zero()), soft(x.size()), stiff = soft;
  for (Vec3& v : d) v = source.vector();
  energy.linearize(x, 1, gradient);
  energy.multiply(d, soft);
  CHECK(!energy.stiffen(std::vector<Index>{}));
  CHECK(energy.stiffen(std::vector<Index>{0}));
  energy.multiply(d, stiff);
  std::vector<bool> touched(x.size()), shared(x.size());
  for (const Index node : space.nodes(0)) touched[node] = true;
  for (std::size_t c = 1; c < space.num_cells(); ++c)
    for (const Index node : space.nodes(c)) shared[node] = true;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!touched[i]) CHECK(stiff[i] == soft[i]);
    if (touched[i] && !shared[i]) CHECK((stiff[i] - 10 * soft[i]).norm() < 1e-6 * stiff[i].norm());
  }
}

/// Products are with numbers kept in single precision, the blocks are not.
TEST_CASE("the diagonal blocks of an affine mesh are those of its Hessian", "[elements]") {
  for (CellKind kind : kAllKinds) {
    const VolumeMesh mesh = single_cell(kind);
    const ElementSpace space(mesh, Basis::legendre, 3);
    HighOrderEnergy energy(space, std::vector{Vec3(0.7, 0.8, 0.6)}, points_of(space, 5));
    const std::vector<Vec3> x = HighOrderMesh(space, mesh).coefficients;
    std::vector<Vec3> gradient(x.size(), Vec3::Zero()), unit(x.size(), Vec3::Zero()), column(x.size());
    energy.linearize(x, 1, gradient);
    const SparseMap identity = identity_map(x.size());
    std::vector<Mat3> diagonal(x.size(), Mat3::Zero());
    energy.add_diagonal_blocks(identity, identity, diagonal);
    for (std::size_t i = 0; i < x.size(); ++i)
      for (int r = 0; r < 3; ++r) {
        unit[i][r] = 1;
        energy.multiply(unit, column);
        unit[i][r] = 0;
        CHECK((column[i] - diagonal[i].col(r)).norm() < 1e-6 * (1 + column[i].norm()));
      }
  }
}

TEST_CASE("the energy of curved cells has the same bits for one and two threads", "[elements]") {
  PointSource source(5);
  const VolumeMesh mesh = mixed_cells();
  const ElementSpace space(mesh, Basis::fourier, 3);
  HighOrderEnergy energy(space, std::vector(space.num_cells(), Vec3(0.8, 0.8, 0.8)), points_of(space, 5));
  const std::vector<Vec3> x = bent(space, mesh, source, 0.01);
  test::ThreadGuard guard;
  std::vector<std::vector<Vec3>> results;
  for (int n : {1, 2}) {
    guard.use(n);
    std::vector<Vec3> gradient(x.size(), Vec3::Zero()), product(x.size());
    gradient[0][0] += energy.linearize(x, 1, gradient);
    energy.multiply(x, product);
    gradient.insert(gradient.end(), product.begin(), product.end());
    results.push_back(std::move(gradient));
  }
  CHECK(results[0] == results[1]);
}
