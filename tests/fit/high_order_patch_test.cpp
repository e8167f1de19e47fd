// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/high_order_patch.h"
#include "subvol/fit/energies/high_order_energy.h"
#include "subvol/fit/features/followed_creases.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/surface/boundary.h"
#include "tests/support/element_fixtures.h"
#include "tests/support/sample_meshes.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <memory>
#include <numeric>
#include <random>
#include <vector>

using namespace subvol;
using namespace subvol::internal;

namespace {

constexpr double kLambda = 0.3;

std::unique_ptr<HighOrderEnergy> volume_of(const ElementSpace& space, std::size_t num_cells) {
  auto volume = std::make_unique<HighOrderEnergy>(space, std::vector<Vec3>(space.num_cells(), Vec3::Ones()),
                                                  std::vector<int>(space.num_cells(), 5));
  volume->count_as_part(num_cells);
  return volume;
}

/// The gradient of E_S + lambda E_W over the unknowns, with the correspondences of x.
std::vector<Vec3> gradient_of(FitProblem& problem, const std::vector<Vec3>& x) {
  std::vector<Vec3> nodes(problem.nodes.num_rows()), samples(problem.samples.num_rows());
  problem.apply_nodes(x, nodes);
  problem.apply_samples(x, samples);
  std::vector<Vec3> of_nodes(nodes.size(), Vec3::Zero()), of_samples(samples.size(), Vec3::Zero());
  std::vector<Vec3> gradient(x.size()), part(x.size());
  problem.volume->add_gradient(nodes, problem.lambda, of_nodes);
  problem.nodes_transposed.apply(of_nodes, gradient);
  problem.surface->assign(samples);
  problem.surface->add_gradient(samples, of_samples);
  problem.pull_back_samples(of_samples, part);
  for (std::size_t i = 0; i < x.size(); ++i) gradient[i] += part[i];
  return gradient;
}

}  // namespace

TEST_CASE("The gradient of a patch of curved cells is that of the whole", "[elements]") {
  std::mt19937 random(4);
  VolumeMesh bar = test::renumbered(test::lattice(9, 3, 3), random);
  TriangleMesh triangles = refined_triangles(boundary_surface(bar, MeshTopology(bar)));
  for (Vec3& p : triangles.positions) p += Vec3(0.02, -0.03, 0.01);
  const TargetSurface target(triangles);
  const FollowedCreases creases(triangles, kUsualCreaseAngle, bar);
  REQUIRE(creases.hold_the_surface());

  EntityOrders orders = EntityOrders::uniform(MeshTopology(bar), 1);
  for (auto* list : {&orders.edges, &orders.faces, &orders.cells})
    for (int& order : *list) order = 1 + static_cast<int>(random() % 4);
  orders.raise_borders(MeshTopology(bar));
  HighOrderMesh mesh(ElementSpace(bar, Basis::legendre, orders), bar);
  std::uniform_real_distribution<double> shake(-0.02, 0.02);
  for (Vec3& c : mesh.coefficients) c += Vec3(shake(random), shake(random), shake(random));

  const BoundarySamples samples = make_boundary_samples(mesh.space, 4, bar.tags.creases);
  const auto surface = [&] {
    auto term = std::make_unique<ClosestPointEnergy>(target, samples.triangles, samples.points.size(), 0.1, 3);
    term->add_creases(creases.energy(samples.crease_edges, samples.points.size(), target.length(), 0.1));
    return term;
  };
  FitProblem whole(identity_map(mesh.space.num_nodes()), samples.positions, volume_of(mesh.space, bar.num_cells()),
                   surface(), kLambda);
  const std::vector<Vec3> expected = gradient_of(whole, mesh.coefficients);

  const auto at = std::ranges::find(bar.positions, Vec3(0, 0, 0)) - bar.positions.begin();
  Index center = 0;
  while (std::ranges::count(bar.cell(center), static_cast<Index>(at)) == 0) ++center;
  const auto patch = high_order_patch(bar, mesh.space, std::vector<Index>{center}, 1, 27);
  REQUIRE(patch);
  CHECK(patch->cells.size() == 27);  // the cells at the vertices of 2 x 2 x 2 cells
  CHECK(std::ranges::is_sorted(patch->unknowns));
  CHECK_FALSE(high_order_patch(bar, mesh.space, std::vector<Index>{center}, 1, 26));

  const std::unique_ptr<ClosestPointEnergy> assigned = surface();
  assigned->assign_target(samples.positions.apply(mesh.coefficients));
  FitProblem part =
      patch_problem(*patch, mesh.coefficients, volume_of(patch->space, bar.num_cells()), samples, *assigned, kLambda);
  std::vector<Vec3> x;
  for (const Index node : patch->unknowns) x.push_back(mesh.coefficients[node]);
  const std::vector<Vec3> gradient = gradient_of(part, x);
  double largest = 0, difference = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    largest = std::max(largest, gradient[i].norm());
    difference = std::max(difference, (gradient[i] - expected[patch->unknowns[i]]).norm());
  }
  CHECK(largest > 1e-3);
  CHECK(difference < 1e-6 * largest);  // the Hessian of E_S, which its gradient is computed by, is in single precision
}
