// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/automatic_attempts.h"
#include "subvol/templates/auto_template.h"

#include <catch2/catch.hpp>

#include <span>
#include <vector>

using namespace subvol;
using namespace subvol::internal;

TEST_CASE("Attempts have more and more cells, and edges are followed on grids through planes first") {
  const std::vector<AutomaticAttempt> smooth = attempts_of({}, false), edges = attempts_of({}, true);
  for (const AutomaticAttempt& attempt : smooth) CHECK(attempt.kind == AutomaticAttempt::Kind::smooth);
  for (std::size_t i = 0; i + 1 < smooth.size(); ++i)
    CHECK(cells_after(smooth[i].template_cells, smooth[i].levels) <=
          cells_after(smooth[i + 1].template_cells, smooth[i + 1].levels));
  REQUIRE(edges.size() == 2 * kAutomaticEdgeCells.size());
  for (std::size_t i = 0; i < edges.size(); ++i) {
    CHECK(edges[i].template_cells == kAutomaticEdgeCells[i / 2]);
    CHECK(edges[i].kind == (i % 2 == 0 ? AutomaticAttempt::Kind::aligned : AutomaticAttempt::Kind::edges));
    CHECK(edges[i].is_last_count == (i + 2 >= edges.size()));
  }
  CHECK(attempts_of({.cells = 7000}, true).front().template_cells == 7000);
}

TEST_CASE("Cages are tried with up to the largest number of cells, and no template twice") {
  const std::vector<AutomaticAttempt> once = attempts_of({.makes_cage = true}, false);
  REQUIRE(once.size() == kAutomaticCells.size() + 1);
  CHECK(once.back().template_cells == kMostAutomaticCells / 8);
  CHECK(attempts_of({.makes_cage = true, .levels = 6}, false).size() == 1);
  CHECK(cells_before(64, 1) == 8);
  CHECK(cells_before(64, 6) == kLeastTemplateCells);
}

TEST_CASE("The work of attempts is forecast from the distances of the best trial") {
  const AutomaticFitOptions options;
  const std::vector<AutomaticAttempt> attempts = attempts_of(options, false);
  REQUIRE(attempts.size() >= 3);
  const auto cells = [&](std::size_t i) {
    return static_cast<double>(cells_after(attempts[i].template_cells, attempts[i].levels));
  };
  CHECK(expected_portion(attempts, nullptr, options) == Approx(0.95 * cells(0) / (cells(0) + cells(1))));
  const auto rest = std::span(attempts).subspan(1);
  AutomaticFitTrial trial{.cells = static_cast<std::size_t>(cells(0)), .mean_percent = options.mean_tolerance_percent};
  CHECK(expected_portion(rest, &trial, options) == Approx(0.95));  // only the quality is missed: one more attempt
  trial.max_percent = 4 * options.max_tolerance_percent;           // eight times as many cells
  CHECK(expected_portion(rest, &trial, options) == Approx(0.95 * cells(1) / (cells(1) + cells(2))));
  trial.max_percent = 1e6;  // all attempts
  CHECK(expected_portion(rest, &trial, options) < 0.95 * cells(1) / (cells(1) + cells(2)));
  CHECK(expected_portion(std::span(attempts).last(1), nullptr, options) == Approx(0.95));
}
