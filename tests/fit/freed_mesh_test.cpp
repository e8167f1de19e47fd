// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/freed_mesh.h"
#include "samples/shapes.h"
#include "subvol/base/error.h"
#include "subvol/fit/mesh_check.h"
#include "subvol/fit/subdivision_fit.h"
#include "subvol/subdivision/audit.h"
#include "subvol/templates/cell_split.h"
#include "tests/support/carved_torus.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <string>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

TEST_CASE("A mesh that its cage keeps poor is freed, and gets a layer of cells", "[slow]") {
  const auto [name, torus, carved] = carved_torus_sample();
  REQUIRE(!audit(carved).warnings.empty());
  const FitResult kept = fit_subdivision_volume(torus, carved, {.levels = 1});
  const FitResult freed = fit_subdivision_volume(torus, carved, {.levels = 1, .frees_mesh = true});
  const MeshCheck before = check_mesh(kept.mesh, &torus), after = check_mesh(freed.mesh, &torus);
  CHECK(kept.cage.num_cells() > 0);
  CHECK(freed.cage.num_cells() == 0);
  CHECK(freed.states.empty());
  CHECK(after.valid());
  CHECK(before.quality->min_scaled_jacobian < 0.3);
  CHECK(after.quality->min_scaled_jacobian > 0.5);
  CHECK(after.mean_distance_percent() <= 1.05 * before.mean_distance_percent());
  CHECK(after.max_distance_percent() <= 1.05 * before.max_distance_percent());
  CHECK(freed.mesh.num_cells() > kept.mesh.num_cells());
  CHECK(freed.report.explanation.find("freed from the cage, with a layer of ") != std::string::npos);
  CHECK(freed.report.stop_reason == StopReason::converged);
}

TEST_CASE("A fit whose cage stalls goes on from the freed mesh", "[slow]") {
  const samples::Sample ball = samples::ball_sample();
  const VolumeMesh tets = split_into_tets(ball.template_mesh);
  const FitResult stalled = fit_subdivision_volume(ball.target, tets, {.levels = 2});
  CHECK(stalled.report.stop_reason == StopReason::stalled);
  CHECK(stalled.level == 1);
  FitOptions options{.levels = 2, .frees_mesh = true};
  double last = 0;
  bool falls = false;
  options.control.progress = [&](const FitProgress& progress) {
    falls = falls || progress.fraction < last;
    last = progress.fraction;
    return true;
  };
  const FitResult freed = fit_subdivision_volume(ball.target, tets, options);
  CHECK(freed.report.stop_reason == StopReason::converged);
  CHECK(freed.level == 2);
  CHECK(freed.mesh.num_cells() >= 8 * stalled.mesh.num_cells());
  CHECK(freed.report.explanation.find("level 1 could not be reached") == 0);
  CHECK(freed.report.explanation.find("the levels from 2 on were fitted from that mesh") != std::string::npos);
  CHECK(std::ranges::any_of(freed.report.stages,
                            [](const StageRecord& stage) { return stage.kept && stage.level == 2; }));
  CHECK_FALSE(falls);
  const MeshCheck check = check_mesh(freed.mesh, &ball.target);
  CHECK(check.valid());
  CHECK(check.quality->min_scaled_jacobian > 0.3);
  CHECK(check.mean_distance_percent() < 0.5);
}

TEST_CASE("A level that the cage could not reach counts as reached by a freed mesh close to the target", "[slow]") {
  const samples::Sample ball = samples::ball_sample();
  const VolumeMesh tets = split_into_tets(ball.template_mesh);
  const FitResult freed = fit_subdivision_volume(ball.target, tets, {.levels = 1, .frees_mesh = true});
  CHECK(freed.report.stop_reason == StopReason::converged);
  CHECK(freed.level == 1);
  CHECK(check_mesh(freed.mesh).valid());
}

TEST_CASE("A fit that goes on from a freed mesh can be cancelled at any time", "[slow]") {
  const samples::Sample ball = samples::ball_sample();
  const VolumeMesh tets = split_into_tets(ball.template_mesh);
  for (const double share : {0.1, 0.3, 0.6}) {
    FitOptions options{.levels = 2, .frees_mesh = true};
    options.control.progress = [share](const FitProgress& progress) { return progress.fraction < share; };
    const FitResult result = fit_subdivision_volume(ball.target, tets, options);
    CHECK(result.report.stop_reason == StopReason::cancelled);
    CHECK(check_mesh(result.mesh).valid());
  }
}

TEST_CASE("A mesh whose cells are good keeps its cage", "[slow]") {
  const samples::Sample ball = samples::ball_sample();
  const FitOptions options{.levels = 1, .quality = 0.2, .frees_mesh = true};
  CHECK(fit_subdivision_volume(ball.target, ball.template_mesh, options).cage.num_cells() > 0);
}

TEST_CASE("A mesh that must keep its cage is not freed") {
  const samples::Sample ball = samples::ball_sample();
  const auto fit = [&](const FitOptions& options) {
    return fit_subdivision_volume(ball.target, ball.template_mesh, options);
  };
  CHECK_THROWS_AS(fit({.cage_only = true, .frees_mesh = true}), InputError);
  CHECK_THROWS_AS(fit({.frees_mesh = true, .keep_states = true}), InputError);
  CHECK(can_be_freed(ball.template_mesh, {}));
  CHECK_FALSE(can_be_freed(ball.template_mesh, {.keeps_groups = true}));
  CHECK_FALSE(can_be_freed(ball.template_mesh, {.quality = 0}));
  VolumeMesh two = ball.template_mesh;
  two.references.assign(two.num_cells(), 1);
  two.references[0] = 2;
  CHECK_FALSE(can_be_freed(two, {}));
}

TEST_CASE("A fit that frees its mesh reports progress that never falls, and can be cancelled", "[slow]") {
  const auto [name, torus, carved] = carved_torus_sample();
  double last = 0;
  bool falls = false, cancels = false;
  FitOptions options{.levels = 1, .frees_mesh = true};
  options.control.progress = [&](const FitProgress& progress) {
    falls = falls || progress.fraction < last;
    last = progress.fraction;
    return !(cancels && progress.fraction > 1 - kShareOfFreeing);
  };
  CHECK(fit_subdivision_volume(torus, carved, options).cage.num_cells() == 0);
  CHECK_FALSE(falls);
  CHECK(last > 1 - kShareOfFreeing / 2);  // the layer is the second half
  cancels = true;
  const FitResult cancelled = fit_subdivision_volume(torus, carved, options);
  CHECK(cancelled.report.stop_reason == StopReason::cancelled);
  CHECK(check_mesh(cancelled.mesh).valid());
}

TEST_CASE("A template far off its target is fitted as before", "[slow]") {
  auto [name, torus, carved] = carved_torus_sample();
  for (Vec3& p : carved.positions) p = 25 * p + Vec3(30, 0, 0);
  FitOptions options{.levels = 1, .frees_mesh = true};
  options.control.max_iterations = 1;
  CHECK(fit_subdivision_volume(torus, carved, options).mesh.num_cells() > 0);
}

TEST_CASE("A freed mesh has sharp edges only if they are asked for", "[slow]") {
  const samples::Sample bracket = samples::bracket_sample();
  VolumeMesh smooth = bracket.template_mesh;
  smooth.tags = {};
  FitOptions options{.levels = 1, .quality = 0.8, .frees_mesh = true};
  CHECK_FALSE(fit_subdivision_volume(bracket.target, smooth, options).report.creases);
  options.crease_angle_degrees = 40;
  CHECK(fit_subdivision_volume(bracket.target, smooth, options).report.creases);
}
