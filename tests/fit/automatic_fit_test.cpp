// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/automatic_fit.h"

#include "subvol/base/error.h"
#include "subvol/fit/automatic_attempts.h"
#include "subvol/fit/automatic_trials.h"
#include "subvol/fit/mesh_check.h"
#include "subvol/io/surface_io.h"
#include "subvol/subdivision/limit_surface.h"
#include "subvol/subdivision/subdivision.h"
#include "tests/support/feature_fixtures.h"
#include "tests/support/require_data.h"
#include "tests/support/surface_fixtures.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

using namespace subvol;

TEST_CASE("A ball is filled with well shaped cells, no more than allowed", "[slow]") {
  const TriangleMesh ball = test::cube_surface(12, true);
  const AutomaticFitResult result = fit_automatically(ball, {.cells = 3000, .crease_angle_degrees = std::nullopt});
  const MeshCheck check = check_mesh(result.mesh, &ball, {});
  CHECK(result.mesh.num_cells() <= 3000);
  CHECK(check.valid());
  CHECK(check.quality->min_scaled_jacobian > 0.6);
  CHECK(check.max_distance_percent() < kAutomaticMaxPercent);
  CHECK(result.report.stop_reason == StopReason::converged);
  CHECK(result.topology == BettiNumbers{1, 0, 0});
  CHECK(result.trials[result.chosen].cells == result.mesh.num_cells());
}

TEST_CASE("Stages that led to the chosen trial are kept in the report, others are not", "[slow]") {
  AutomaticFitOptions options{.cells = 400, .quality = kMostQuality};  // out of reach: several trials
  AutomaticFitResult result = fit_automatically(test::tetrahedron_surface(), options);
  REQUIRE(result.trials.size() > 1);
  const std::vector<StageRecord>& stages = result.report.stages;
  CHECK(std::ranges::any_of(stages, [](const StageRecord& stage) { return !stage.kept; }));
  REQUIRE(result.report.last_kept_stage() != nullptr);
  CHECK(result.report.last_kept_stage()->cells == result.mesh.num_cells());
}

TEST_CASE("A plate a hundred times as wide as thick keeps its thickness", "[slow]") {
  TriangleMesh plate = test::cube_surface(2, false);
  for (Vec3& p : plate.positions) p.z() /= 100;
  const AutomaticFitResult result = fit_automatically(plate, {.cells = 300});
  const AutomaticFitTrial& chosen = result.trials[result.chosen];
  CHECK(chosen.solid_volume_percent < 1e-6);
  CHECK(chosen.max_percent < 1e-6);
  CHECK(result.report.stop_reason == StopReason::converged);
}

TEST_CASE("A result of another volume is far off, however near it is") {
  AutomaticFitTrial trial;
  trial.least_scaled_jacobian = trial.least_share = 0.7;
  trial.self_intersections = 0;
  trial.solid_volume_percent = 3;
  CHECK(internal::merit_of(trial, {}) < 2);
  AutomaticFitResult result;
  result.trials = {trial};
  result.report.stop_reason = StopReason::converged;
  internal::mark_if_far_off(result, {}, "edges");
  CHECK(result.report.stop_reason == StopReason::converged);
  result.trials[0].solid_volume_percent = 8;
  internal::mark_if_far_off(result, {}, "edges");
  CHECK(result.report.stop_reason == StopReason::tolerance_missed);
  CHECK_FALSE(internal::is_good_enough(
      [&] {
        trial.solid_volume_percent = 8;
        trial.merit = internal::merit_of(trial, {});
        return trial;
      }(),
      {}));
}

TEST_CASE("All oblique faces of a part get pads, also where five of them meet at a corner", "[slow]") {
  const TriangleMesh target = test::icosahedron_surface();
  const AutomaticFitResult result = fit_automatically(target, {.cells = 3500});
  const MeshCheck check = check_mesh(result.mesh, &target, {});
  CHECK(check.valid());
  CHECK(result.trials[result.chosen].pads == 1);
  CHECK(check.quality->min_scaled_jacobian > 0.45);
  CHECK(check.normals->mean_degrees < 3);
}

TEST_CASE("Both edges of a chamfer narrower than a cell are followed", "[slow]") {
  const TriangleMesh target = test::plate_with_chamfered_hole(0.2);
  const AutomaticFitResult result = fit_automatically(target, {.cells = 2000});
  CHECK(result.report.stop_reason == StopReason::converged);
  CHECK(result.missed_edges.empty());
  CHECK(result.trials[result.chosen].followed_curves == result.trials[result.chosen].curves);
  const MeshCheck check = check_mesh(result.mesh, &target, {});
  CHECK(check.valid());
  CHECK(check.quality->min_scaled_jacobian > 0.5);
}

TEST_CASE("If a fit loses long edges, a grid that loses none is looked for and fitted as well", "[slow]") {
  const auto data = test::require_data();
  if (!data) return;
  const TriangleMesh target = read_triangle_mesh(*data / "auto/parts/Drag_Chain_Spacer_x1.stl");
  // So few cells are 1.1 % of the diagonal away at one place, which is beyond twice the usual largest distance.
  const AutomaticFitResult result = fit_automatically(target, {.cells = 2500, .max_tolerance_percent = 1});
  CHECK(result.trials.front().grids == 1);
  CHECK(result.trials.front().long_edges_lost > 0);
  CHECK(result.trials[result.chosen].template_cells != result.trials.front().template_cells);
  CHECK(result.trials[result.chosen].long_edges_lost == 0);
  CHECK(result.report.stop_reason == StopReason::converged);
}

TEST_CASE("A good automatic fit is polished beyond the quality aimed at", "[slow]") {
  const TriangleMesh ball = test::cube_surface(12, true);
  const AutomaticFitResult result =
      fit_automatically(ball, {.cells = 3000, .quality = 0.6, .mean_tolerance_percent = 0.1, .keep_states = true});
  REQUIRE(result.trials.size() >= 2);
  const AutomaticFitTrial &polished = result.trials.back(), &before = result.trials[result.trials.size() - 2];
  REQUIRE(polished.is_polished);
  CHECK_FALSE(before.is_polished);
  CHECK(result.chosen + 1 == result.trials.size());
  CHECK(polished.least_scaled_jacobian > before.least_scaled_jacobian);
  CHECK(polished.least_scaled_jacobian > 0.7);
  CHECK(polished.max_percent <= kAutomaticMaxPercent);
  CHECK(check_mesh(result.mesh, &ball, {}).valid());
  REQUIRE(result.states.size() > 3);  // those of the trial before belong to the same mesh
  CHECK(result.states.front().name == "start");
  CHECK(result.states[1].name.find("polished") == std::string::npos);
  CHECK(result.states.back().name.find("polished") != std::string::npos);
}

TEST_CASE("A gap narrower than the mesh's distance stays open, and the relaxed trial is judged like any other",
          "[slow]") {
  TriangleMesh balls = test::cube_surface(12, true);
  const auto first = static_cast<Index>(balls.positions.size());
  const TriangleMesh ball = balls;
  constexpr double kRadius = 0.3, kGap = 3e-4;
  for (const Vec3& p : ball.positions) balls.positions.push_back(kRadius * p + (1 + kRadius + kGap) * Vec3::UnitX());
  for (const auto& [a, b, c] : ball.triangles) balls.triangles.push_back({first + a, first + b, first + c});
  const AutomaticFitResult result = fit_automatically(balls, {.cells = 4000});
  CHECK(result.topology == BettiNumbers{2, 0, 0});
  CHECK(check_mesh(result.mesh, &balls, {}).valid());
  const auto relaxed =
      std::ranges::find_if(result.trials, [](const AutomaticFitTrial& trial) { return trial.relaxed_at.has_value(); });
  REQUIRE(relaxed != result.trials.end());
  CHECK(relaxed->self_intersections == std::size_t{0});
  const double share = std::min(1.0, relaxed->least_scaled_jacobian / kUsualQuality);
  CHECK(std::abs(relaxed->least_share - share) < 0.05);
}

TEST_CASE("A gap that the first grids close is held by finer ones", "[slow]") {
  const TriangleMesh ball = test::cube_surface(12, true);
  TriangleMesh bearing;  // a ball, a void around another ball, and that ball
  constexpr double kInner = 0.6, kGap = 0.013;
  for (const double radius : {1.0, kInner + kGap, kInner}) {
    const auto first = static_cast<Index>(bearing.positions.size());
    const bool is_void = radius == kInner + kGap;  // its wall is turned inward
    for (const Vec3& p : ball.positions) bearing.positions.push_back(radius * p);
    for (auto [i, j, k] : ball.triangles) {
      if (is_void) std::swap(j, k);
      bearing.triangles.push_back({first + i, first + j, first + k});
    }
  }
  const AutomaticFitResult result = fit_automatically(bearing, {.quality = 0.3});
  CHECK(result.topology == BettiNumbers{2, 0, 1});
  CHECK(check_mesh(result.mesh, &bearing, {}).valid());
  CHECK(result.trials.front().template_cells > kAutomaticCells.front());
  CHECK(result.trials.front().level == 0);
}

TEST_CASE("An automatic fit makes a cage whose mesh is well shaped", "[slow]") {
  const TriangleMesh ball = test::cube_surface(12, true);
  const AutomaticFitResult result = fit_automatically(ball, {.cells = 3000, .makes_cage = true});
  CHECK(result.mesh.num_cells() <= 3000);
  CHECK(result.mesh.num_cells() == 8 * result.cage.num_cells());
  const MeshCheck check = check_mesh(result.mesh, &ball, {});
  CHECK(check.valid());
  CHECK(check.quality->min_scaled_jacobian > 0.6);
  CHECK(check.max_distance_percent() < kAutomaticMaxPercent);
  // The mesh is the one that anyone gets who subdivides the cage.
  const SubdivisionLevel level = subdivide(result.cage);
  const std::vector<Vec3> nodes = limit_map(level.fine).apply(level.fine.positions);
  double farthest = 0;
  for (std::size_t i = 0; i < nodes.size(); ++i)
    farthest = std::max(farthest, (nodes[i] - result.mesh.positions[i]).norm());
  CHECK(farthest < 1e-12);
}

TEST_CASE("The cage of a part has creases along its sharp edges", "[slow]") {
  const TriangleMesh cube = test::cube_surface(6, false);
  const AutomaticFitResult result = fit_automatically(cube, {.cells = 4000, .makes_cage = true});
  REQUIRE(result.cage.num_cells() > 0);
  REQUIRE(result.report.creases);
  CHECK(result.report.creases->num_followed == 12);
  CHECK(result.cage.tags.creases.size() >= 12);
  const MeshCheck check = check_mesh(result.mesh, &cube, {});
  CHECK(check.valid());
  CHECK(check.quality->min_scaled_jacobian > 0.9);
  CHECK(check.max_distance_percent() < 1e-9);
}

TEST_CASE("The template of a cage is subdivided as often as asked for", "[slow]") {
  const TriangleMesh ball = test::cube_surface(12, true);
  const AutomaticFitResult result = fit_automatically(ball, {.cells = 6000, .makes_cage = true, .levels = 2});
  const AutomaticFitTrial& chosen = result.trials[result.chosen];
  CHECK(chosen.level == 2);
  CHECK(result.mesh.num_cells() == 64 * chosen.template_cells);
  CHECK(result.mesh.num_cells() == 8 * result.cage.num_cells());
  CHECK(check_mesh(result.mesh, &ball, {}).valid());
}

TEST_CASE("An automatic fit with a cage that ends early has a cage") {
  AutomaticFitOptions options{.cells = 3000, .makes_cage = true};
  options.control.progress = [](const FitProgress& progress) { return std::string(progress.stage) == "template"; };
  const AutomaticFitResult result = fit_automatically(test::cube_surface(6, true), options);
  REQUIRE(result.mesh.num_cells() > 0);
  CHECK(result.mesh.num_cells() == 8 * result.cage.num_cells());
}

TEST_CASE("An automatic fit that ends early gives what it has, or nothing") {
  const TriangleMesh ball = test::cube_surface(6, true);
  AutomaticFitOptions options{.cells = 1000};
  int calls = 0;
  options.control.progress = [&](const FitProgress& progress) {
    if (progress.level == 1) ++calls;
    return calls < 3;
  };
  const AutomaticFitResult cut = fit_automatically(ball, options);
  CHECK(cut.report.stop_reason == StopReason::cancelled);
  CHECK(check_mesh(cut.mesh, &ball, {}).valid());
  options.control.progress = [](const FitProgress&) { return false; };
  CHECK(fit_automatically(ball, options).mesh.num_cells() == 0);
  options.control.progress = {};
  options.control.time_limit_seconds = 1e-6;
  CHECK(fit_automatically(ball, options).report.stop_reason == StopReason::time_limit);
}

TEST_CASE("An automatic fit says that it was canceled, wherever that was", "[slow]") {
  // A quality that is out of reach leads through all attempts: grids with small cells, refinements, relaxations.
  const auto [target, angle] = GENERATE(std::pair(test::cube_surface(4, true), std::optional<double>()),
                                        std::pair(test::tetrahedron_surface(), std::optional<double>(40)));
  AutomaticFitOptions options{.cells = 400, .quality = kMostQuality, .crease_angle_degrees = angle};
  std::atomic<int> questions = 0;
  int most = std::numeric_limits<int>::max();
  options.control.cancelled = [&] { return ++questions > most; };
  fit_automatically(target, options);
  const int all = questions;
  REQUIRE(all > 20);
  for (const double share : {0.02, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9}) {
    questions = 0;
    most = static_cast<int>(share * all);
    const AutomaticFitResult result = fit_automatically(target, options);
    CHECK(result.report.stop_reason == StopReason::cancelled);
    CHECK(result.report.explanation.substr(0, 12) == "cancelled in");
  }
}

TEST_CASE("An automatic fit says so if it needs more cells than allowed") {
  constexpr std::size_t kTooFew = 10;
  const AutomaticFitResult result = fit_automatically(test::cube_surface(4, true), {.cells = kTooFew});
  REQUIRE(result.mesh.num_cells() > kTooFew);
  CHECK(std::ranges::any_of(result.report.warnings, [](const std::string& warning) {
    return warning.find("more than the 10 allowed") != std::string::npos;
  }));
}

TEST_CASE("A result that is far off says so, and why") {
  const AutomaticFitOptions options;
  const auto marked = [&](const AutomaticFitTrial& trial, std::vector<MissedEdge> missed) {
    AutomaticFitResult result;
    result.trials = {trial};
    result.missed_edges = std::move(missed);
    result.report.stop_reason = StopReason::converged;
    internal::mark_if_far_off(result, options, "sharp edges");
    CHECK(result.report.explanation.empty() == (result.report.stop_reason == StopReason::converged));
    return result.report.explanation;
  };
  CHECK(marked({.max_percent = 0.99}, {{NotFollowed::no_path_nearby, {}, 9.9}}).empty());
  CHECK(marked({.max_percent = 1.01}, {}) == "; the largest distance is above 1 % of the diagonal");
  CHECK(marked({}, {{NotFollowed::no_path_nearby, {}, 10.1}}) ==
        "; sharp edges longer than 10 % of the diagonal that are not followed: 1");
  const FeatureMiss noise{.share = 2, .distance = 0.2, .size = 0.1}, lost{.share = 1.2, .distance = 0.6, .size = 0.5};
  CHECK(marked({.feature_miss = noise, .lost_feature = lost}, {}) == "; a feature of radius 0.5 is missed by 0.6");
  CHECK(marked({.feature_miss = noise}, {}).empty());
  CHECK_FALSE(marked({.volume_percent = 1.1}, {}).empty());
}

TEST_CASE("A trial that loses a feature is never good enough") {
  const AutomaticFitOptions options;
  AutomaticFitTrial trial{.mean_percent = 0.01, .max_percent = 0.4, .least_scaled_jacobian = 0.7, .least_share = 1};
  trial.self_intersections = 0;
  const auto is_good = [&] {
    trial.merit = internal::merit_of(trial, options);
    return internal::is_good_enough(trial, options.tuning.automatic);
  };
  trial.feature_miss = FeatureMiss{.share = 1.1};
  CHECK(is_good());  // the feature is small: it may be noise of the triangulation
  trial.lost_feature = trial.feature_miss;
  CHECK_FALSE(is_good());
}

TEST_CASE("Templates are tried from small ones on, and at last ones that are not refined") {
  std::vector<std::size_t> most;
  std::vector<int> levels;
  for (const internal::AutomaticAttempt& attempt : internal::attempts_of({}, false)) {
    most.push_back(internal::cells_after(attempt.template_cells, attempt.levels));
    levels.push_back(attempt.levels);
  }
  CHECK(most == std::vector<std::size_t>{5000, 15000, 40000, 40000, 100000, 100000});
  CHECK(levels == std::vector<int>{1, 1, 1, 0, 1, 0});
  CHECK(internal::attempts_of({.cells = 20000}, false).size() == 2);
}

TEST_CASE("A trial meets the distances if neither is larger than allowed") {
  const AutomaticFitOptions options;
  const double mean = options.mean_tolerance_percent, max = options.max_tolerance_percent;
  CHECK(internal::meets_distances({.mean_percent = mean, .max_percent = max}, options));
  CHECK_FALSE(internal::meets_distances({.mean_percent = 1.01 * mean, .max_percent = max}, options));
  CHECK_FALSE(internal::meets_distances({.mean_percent = mean, .max_percent = 1.01 * max}, options));
}

TEST_CASE("An automatic fit refuses options out of range") {
  const TriangleMesh ball = test::cube_surface(4, true);
  CHECK_THROWS_AS(fit_automatically(ball, {.cells = 5}), InputError);
  CHECK_THROWS_AS(fit_automatically(ball, {.quality = 0.95}), InputError);
  CHECK_THROWS_AS(fit_automatically(ball, {.crease_angle_degrees = 200}), InputError);
  CHECK_THROWS_AS(fit_automatically(ball, {.makes_cage = true, .levels = 7}), InputError);
  CHECK_THROWS_AS(fit_automatically({}, {}), InputError);
}
