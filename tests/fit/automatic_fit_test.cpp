// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/automatic_fit.h"

#include "subvol/base/error.h"
#include "subvol/fit/mesh_check.h"
#include "tests/support/surface_fixtures.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <string>

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

TEST_CASE("A good automatic fit is polished beyond the quality aimed at", "[slow]") {
  const TriangleMesh ball = test::cube_surface(12, true);
  const AutomaticFitResult result = fit_automatically(ball, {.cells = 3000, .quality = 0.6});
  REQUIRE(result.trials.size() >= 2);
  const AutomaticFitTrial &polished = result.trials.back(), &before = result.trials[result.trials.size() - 2];
  REQUIRE(polished.is_polished);
  CHECK_FALSE(before.is_polished);
  CHECK(result.chosen + 1 == result.trials.size());
  CHECK(polished.least_scaled_jacobian > before.least_scaled_jacobian);
  CHECK(polished.least_scaled_jacobian > 0.7);
  CHECK(polished.max_percent <= kAutomaticMaxPercent);
  CHECK(check_mesh(result.mesh, &ball, {}).valid());
}

TEST_CASE("An automatic fit that ends early gives what it has, or nothing") {
  const TriangleMesh ball = test::cube_surface(6, true);
  AutomaticFitOptions options{.cells = 1000};
  int calls = 0;
  options.progress = [&](const FitProgress& progress) {
    if (progress.level == 1) ++calls;
    return calls < 3;
  };
  const AutomaticFitResult cut = fit_automatically(ball, options);
  CHECK(cut.report.stop_reason == StopReason::cancelled);
  CHECK(check_mesh(cut.mesh, &ball, {}).valid());
  options.progress = [](const FitProgress&) { return false; };
  CHECK(fit_automatically(ball, options).mesh.num_cells() == 0);
  options.progress = {};
  options.time_limit_seconds = 1e-6;
  CHECK(fit_automatically(ball, options).report.stop_reason == StopReason::time_limit);
}

TEST_CASE("An automatic fit says so if it needs more cells than allowed") {
  constexpr std::size_t kTooFew = 10;
  const AutomaticFitResult result = fit_automatically(test::cube_surface(4, true), {.cells = kTooFew});
  REQUIRE(result.mesh.num_cells() > kTooFew);
  CHECK(std::ranges::any_of(result.report.warnings, [](const std::string& warning) {
    return warning.find("more than the 10 allowed") != std::string::npos;
  }));
}

TEST_CASE("An automatic fit refuses options out of range") {
  const TriangleMesh ball = test::cube_surface(4, true);
  CHECK_THROWS_AS(fit_automatically(ball, {.cells = 5}), InputError);
  CHECK_THROWS_AS(fit_automatically(ball, {.quality = 0.95}), InputError);
  CHECK_THROWS_AS(fit_automatically(ball, {.crease_angle_degrees = 200}), InputError);
  CHECK_THROWS_AS(fit_automatically({}, {}), InputError);
}
