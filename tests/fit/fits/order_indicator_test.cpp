// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/fits/order_indicator.h"
#include "samples/shapes.h"
#include "subvol/fit/elements/boundary_samples.h"
#include "subvol/fit/energies/closest_point_energy.h"
#include "subvol/fit/energies/high_order_energy.h"
#include "tests/support/element_fixtures.h"
#include "tests/support/sample_meshes.h"

#include <Eigen/LU>
#include <catch2/catch.hpp>

#include <algorithm>
#include <memory>
#include <random>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

FitProblem ball_problem(const HighOrderMesh& mesh, const TargetSurface& target, double lambda) {
  const BoundarySamples samples = make_boundary_samples(mesh.space, 8);
  FitProblem problem(
      identity_map(mesh.space.num_nodes()), samples.positions,
      std::make_unique<HighOrderEnergy>(mesh.space, std::vector(mesh.space.num_cells(), Vec3(0.5, 0.5, 0.5)),
                                        std::vector(mesh.space.num_cells(), 5)),
      std::make_unique<ClosestPointEnergy>(target, samples.triangles, samples.points.size(), 0.1, 1), lambda);
  problem.tables.emplace(mesh.space, samples.points);
  return problem;
}

}  // namespace

TEST_CASE("orders rise by half of what they are, up to the greatest, and keep the rule", "[elements]") {
  std::mt19937 random(1);
  const MeshTopology topology(mixed_cells());
  EntityOrders orders = EntityOrders::uniform(topology, 1);
  std::uniform_int_distribution<int> uniform(1, 6);
  for (auto* list : {&orders.edges, &orders.faces, &orders.cells})
    for (int& order : *list) order = uniform(random);
  orders.raise_borders(topology);
  const int expected[] = {0, 2, 3, 4, 6, 7, 7, 7};
  const EntityOrders next = next_orders(orders, 7);
  for (std::size_t e = 0; e < next.edges.size(); ++e) CHECK(next.edges[e] == expected[orders.edges[e]]);
  CHECK_NOTHROW(ElementSpace(mixed_cells(), Basis::fourier, next));
}

TEST_CASE("the gain of one new mode is what its own Newton step takes off the surface energy", "[elements]") {
  const samples::Sample sample = samples::ball_sample();
  const ElementSpace space(sample.template_mesh, Basis::fourier, 1);
  const EntityOrders& now = space.orders();
  const HighOrderMesh raised = HighOrderMesh(space, sample.template_mesh).with_orders(next_orders(now, 2));
  const TargetSurface target(sample.target);
  constexpr double kNoShape = 1e-12;
  FitProblem problem = ball_problem(raised, target, kNoShape);
  const EntityValues gains = order_gains(problem, raised.space, now, raised.coefficients);
  const EntityValues none = order_gains(problem, raised.space, raised.space.orders(), raised.coefficients);
  CHECK(none.sum() == 0);

  std::vector<Vec3> z = problem.samples.apply(raised.coefficients), g(z.size(), Vec3::Zero());
  problem.surface->assign(z);
  problem.surface->add_gradient(z, g);
  const std::vector<Vec3> gradient = problem.samples_transposed.apply(g);
  std::vector<Mat3> diagonal(gradient.size(), Mat3::Zero());
  add_diagonal_blocks(problem.samples, problem.samples_transposed, problem.surface->hessian(), diagonal);
  const double before = problem.surface->value(z);
  int looked_at = 0;
  for (std::size_t e = 0; e < now.edges.size(); ++e) {
    const std::size_t node = raised.space.edge_nodes(e);
    if (!raised.space.topology().is_boundary_edge(static_cast<Index>(e))) continue;
    std::vector<Vec3> x = raised.coefficients;
    x[node] -= diagonal[node].inverse() * gradient[node];
    const double decrease = before - problem.surface->value(problem.samples.apply(x));
    CHECK(gains.edges[e] == Approx(decrease).epsilon(1e-3));  // the Hessian is in single precision
    ++looked_at;
  }
  CHECK(looked_at > 0);
}

TEST_CASE("orders rise where most is gained for a node, and on the borders of that", "[elements]") {
  const VolumeMesh mesh = mixed_cells();
  const ElementSpace space(mesh, Basis::fourier, 2);
  const MeshTopology& topology = space.topology();
  const EntityOrders next = next_orders(space.orders(), 4);
  EntityValues gains{std::vector<double>(topology.num_edges()), std::vector<double>(topology.num_faces()),
                     std::vector<double>(topology.num_cells())};
  CHECK(raised_where_it_pays(space, next, gains, 0.8).edges == space.orders().edges);
  gains.faces[0] = 9;
  gains.edges[0] = 0.1;
  const EntityOrders raised = raised_where_it_pays(space, next, gains, 0.8);
  CHECK(raised.faces[0] == 3);
  CHECK(std::ranges::count(raised.faces, 3) == 1);
  CHECK(std::ranges::count(raised.cells, 3) == 0);
  const auto corners = topology.face(0);
  for (std::size_t i = 0; i < corners.size(); ++i)
    CHECK(raised.edges[topology.find_edge(corners[i], corners[(i + 1) % corners.size()])] == 3);
  const EntityOrders all = raised_where_it_pays(space, next, gains, 1);
  CHECK(all.edges[0] == 3);
}
