// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/solver/levenberg_marquardt.h"

#include "subvol/fit/energies/quality_energy.h"
#include "subvol/fit/quality/quality.h"
#include "tests/support/sample_meshes.h"

#include <catch2/catch.hpp>

#include <memory>
#include <omp.h>
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

}  // namespace

TEST_CASE("Levenberg-Marquardt raises scaled Jacobians, keeps certificates, the same bits for any number of threads") {
  const VolumeMesh mesh = disturbed_lattice();
  const QualityReport before = measure_quality(mesh);
  std::vector<std::vector<Vec3>> results;
  for (const int threads : {1, 3}) {
    omp_set_num_threads(threads);
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
  omp_set_num_threads(omp_get_num_procs());
  CHECK(results[0] == results[1]);
  VolumeMesh after = mesh;
  after.positions = results[0];
  const QualityReport quality = measure_quality(after);
  CHECK(quality.certificate.not_certified.size() <= before.certificate.not_certified.size());
  CHECK(quality.min_scaled_jacobian > 0.6);
  CHECK(quality.mean_scaled_jacobian > before.mean_scaled_jacobian);
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
