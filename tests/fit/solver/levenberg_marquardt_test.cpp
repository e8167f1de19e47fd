// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/solver/levenberg_marquardt.h"

#include "subvol/fit/elements/boundary_samples.h"
#include "subvol/fit/energies/closest_point_energy.h"
#include "subvol/fit/energies/quality_energy.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/fit/target/target_surface.h"
#include "tests/support/region_fixtures.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/threads.h"

#include <catch2/catch.hpp>

#include <array>
#include <memory>
#include <numeric>
#include <random>

using namespace subvol;
using namespace subvol::internal;

namespace {

/// A lattice of hexes, disturbed inside, with all vertices free.
VolumeMesh disturbed_lattice() {
  VolumeMesh mesh = test::lattice(4, 4, 4);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> shift(-0.3, 0.3);
  for (Vec3& p : mesh.positions) p += Vec3(shift(random), shift(random), shift(random));
  return mesh;
}

FitProblem problem_of(const VolumeMesh& mesh) {
  const std::size_t n = mesh.num_vertices();
  auto energy = std::make_unique<QualityEnergy>(mesh, std::vector<Vec3>(mesh.num_cells(), Vec3::Ones()));
  energy->set_weights({.threshold = 0.8});
  return FitProblem(identity_map(n), SparseMap{n, {0}, {}, {}}, std::move(energy), nullptr, 1);
}

MinimizerOptions options_of(int steps) {
  MinimizerOptions options;
  options.max_iterations = steps;
  options.cg_tolerance = 0.05;
  options.longest_move = 1;
  return options;
}

/// A lattice whose boundary is drawn to a ball that has moved along itself: the correspondences slide.
FitProblem ball_problem(const VolumeMesh& mesh, const TargetSurface& target) {
  FitProblem problem = problem_of(mesh);
  BoundarySamples samples = make_boundary_samples(ElementSpace(mesh, Basis::legendre, 1), 2, {});
  problem.surface = std::make_unique<ClosestPointEnergy>(target, samples.triangles, samples.positions.num_rows(), 0.02,
                                                         1, SurfacePull::straight_both_ways);
  return FitProblem(problem.nodes, samples.positions, std::move(problem.volume), std::move(problem.surface), 1e-5);
}

}  // namespace

TEST_CASE("Accelerated steps of Levenberg-Marquardt reach a lower energy in the same number of steps") {
  const VolumeMesh mesh = test::lattice(4, 4, 4);
  const TargetSurface target(test::ball_surface(Vec3(2, 2, 2), 2.5, 8));
  std::array<double, 2> energies;
  for (const bool accelerates : {false, true}) {
    FitProblem problem = ball_problem(mesh, target);
    std::vector<Vec3> x = mesh.positions;
    MinimizerOptions options = options_of(8);
    options.relative_decrease = 0;
    options.accelerates = accelerates;
    const MinimizerResult result = minimize_levenberg_marquardt(problem, x, options);
    for (std::size_t i = 1; i < result.iterations.size(); ++i) {
      const IterationRecord &before = result.iterations[i - 1], &now = result.iterations[i];
      CHECK(now.surface_energy + 1e-5 * now.volume_energy <
            1.01 * (before.surface_energy + 1e-5 * before.volume_energy));
    }
    problem.surface->assign(problem.samples.apply(x));
    energies[accelerates] =
        problem.surface->value(problem.samples.apply(x)) + problem.lambda * problem.volume->value(x);
  }
  CHECK(energies[1] < 0.99 * energies[0]);
}

TEST_CASE("Levenberg-Marquardt raises scaled Jacobians, keeps certificates, the same bits for any number of threads") {
  const VolumeMesh mesh = disturbed_lattice();
  const QualityReport before = measure_quality(mesh);
  std::vector<std::vector<Vec3>> results;
  test::ThreadGuard guard;
  for (const int threads : {1, 3}) {
    guard.use(threads);
    FitProblem problem = problem_of(mesh);
    std::vector<Vec3> x = mesh.positions;
    const MinimizerResult result = minimize_levenberg_marquardt(problem, x, options_of(12));
    double energy = 1e300;
    for (const IterationRecord& step : result.iterations) {
      CHECK(step.volume_energy < energy);
      energy = step.volume_energy;
    }
    results.push_back(std::move(x));
  }
  CHECK(results[0] == results[1]);
  VolumeMesh after = mesh;
  after.positions = results[0];
  const QualityReport quality = measure_quality(after);
  CHECK(quality.certificate.not_certified.size() <= before.certificate.not_certified.size());
  CHECK(quality.min_scaled_jacobian > 0.6);
  CHECK(quality.mean_scaled_jacobian > before.mean_scaled_jacobian);
}

TEST_CASE("Levenberg-Marquardt shortens steps where few cells are worse before it damps all of them") {
  const VolumeMesh mesh = disturbed_lattice();
  FitProblem problem = problem_of(mesh);
  std::vector<Vec3> x = mesh.positions;
  const MinimizerResult result = minimize_levenberg_marquardt(problem, x, options_of(8));
  REQUIRE(result.iterations.size() == 8);
  for (const IterationRecord& step : result.iterations) CHECK(step.evaluations == 1);
  CHECK(result.iterations.back().volume_energy < 0.1 * problem.volume->value(mesh.positions));
}

TEST_CASE("The energies of cells add up to that of the mesh") {
  const VolumeMesh mesh = disturbed_lattice();
  const FitProblem problem = problem_of(mesh);
  const std::vector<double> energies = problem.volume->cell_values(mesh.positions);
  REQUIRE(energies.size() == mesh.num_cells());
  CHECK(std::accumulate(energies.begin(), energies.end(), 0.0) == problem.volume->value(mesh.positions));
}

TEST_CASE("Levenberg-Marquardt resumes at the same bits") {
  const VolumeMesh mesh = disturbed_lattice();
  std::vector<Vec3> whole = mesh.positions, kept;
  MinimizerResult begun;
  MinimizerOptions options = options_of(10);
  options.keep = [&](std::span<const Vec3> x, const MinimizerResult& so_far) {
    kept.assign(x.begin(), x.end());
    begun = so_far;
  };
  FitProblem first = problem_of(mesh);
  const MinimizerResult all = minimize_levenberg_marquardt(first, whole, options);
  REQUIRE(!kept.empty());
  REQUIRE(begun.iterations.size() < all.iterations.size());
  options.keep = {};
  options.begun = &begun;
  FitProblem second = problem_of(mesh);
  CHECK(minimize_levenberg_marquardt(second, kept, options).iterations.size() == all.iterations.size());
  CHECK(kept == whole);
}

TEST_CASE("Levenberg-Marquardt ends where the caller wants, and at once where nothing is to be done") {
  const VolumeMesh cubes = test::lattice(2, 2, 2);
  FitProblem perfect = problem_of(cubes);
  std::vector<Vec3> x = cubes.positions;
  const MinimizerResult result = minimize_levenberg_marquardt(perfect, x, options_of(5));
  CHECK(result.stop == MinimizerStop::converged);
  CHECK(x == cubes.positions);
  const VolumeMesh mesh = disturbed_lattice();
  FitProblem problem = problem_of(mesh);
  MinimizerOptions options = options_of(5);
  options.ended = [] { return true; };
  x = mesh.positions;
  CHECK(minimize_levenberg_marquardt(problem, x, options).stop == MinimizerStop::cancelled);
  CHECK(x == mesh.positions);
}

TEST_CASE("The damping after some steps depends on their numbers of trials") {
  const std::vector<IterationRecord> steps{{.evaluations = 1}, {.evaluations = 3}, {.evaluations = 1}};
  CHECK(damping_after(1e-3, steps) == Approx(1e-3 * 0.3 * 36 * 0.3));
  CHECK(damping_after(1e-3, {}) == 1e-3);
}
