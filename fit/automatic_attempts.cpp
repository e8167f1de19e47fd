// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/automatic_attempts.h"

#include "subvol/fit/fits/fitted_cage.h"
#include "subvol/templates/auto_template.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace subvol::internal {

namespace {

/// Portions of the attempts with these numbers of cells: each costs about three times as much as the one before. Few
/// fits end with the first. In the middle of one that ends with the second or the third, the share is 0.34 or 0.68.
constexpr std::array<double, kAutomaticEdgeCells.size()> kEdgePortions{0.2, 0.5, 0.67};

}  // namespace

std::size_t cells_before(std::size_t cells, int levels) {
  for (int level = 0; level < levels; ++level) cells /= kChildren;
  return std::max(cells, kLeastTemplateCells);
}

std::size_t cells_after(std::size_t cells, int levels) {
  for (int level = 0; level < levels; ++level) cells *= kChildren;
  return cells;
}

void drop_equal_templates(int levels, std::vector<std::size_t>& counts) {
  const auto same = [&](std::size_t a, std::size_t b) { return cells_before(a, levels) == cells_before(b, levels); };
  counts.erase(std::unique(counts.begin(), counts.end(), same), counts.end());
}

std::vector<AutomaticAttempt> attempts_of(const AutomaticFitOptions& options, bool has_edges) {
  using Kind = AutomaticAttempt::Kind;
  std::vector<AutomaticAttempt> attempts;
  if (has_edges) {
    std::vector<std::size_t> counts(kAutomaticEdgeCells.begin(), kAutomaticEdgeCells.end());
    if (options.cells) counts = {options.makes_cage ? cells_before(*options.cells, 1) : *options.cells};
    for (std::size_t i = 0; i < counts.size(); ++i)
      for (const Kind kind : {Kind::aligned, Kind::edges})
        attempts.push_back(
            {kind, counts[i], 0, i + 1 == counts.size(), options.cells ? kAttemptPortion : kEdgePortions[i]});
  } else if (options.makes_cage) {
    std::vector<std::size_t> counts(kAutomaticCells.begin(), kAutomaticCells.end());
    counts.push_back(kMostAutomaticCells);
    if (options.cells) counts = {*options.cells};
    drop_equal_templates(options.levels, counts);
    for (const std::size_t cells : counts)
      attempts.push_back({Kind::smooth, cells_before(cells, options.levels), options.levels});
  } else {
    std::vector<std::size_t> counts(kAutomaticCells.begin(), kAutomaticCells.end());
    counts.push_back(kMostAutomaticCells);
    if (options.cells) counts = {*options.cells};
    for (std::size_t i = 0; i < counts.size(); ++i) {
      const bool has_unrefined = i + 2 >= counts.size();  // the last two
      if (counts[i] >= kChildren * kLeastTemplateCells)
        attempts.push_back({.kind = Kind::smooth,
                            .template_cells = counts[i] / kChildren,
                            .levels = 1,
                            .precedes_unrefined = has_unrefined});
      if (has_unrefined) attempts.push_back({Kind::smooth, counts[i], 0});
    }
  }
  return attempts;
}

double expected_portion(std::span<const AutomaticAttempt> attempts, const AutomaticFitTrial* best,
                        const AutomaticFitOptions& options) {
  constexpr double kPortionOfAllAttempts = 0.95;  // of the work; what follows them takes the rest
  const auto cells_of = [](const AutomaticAttempt& attempt) {
    return static_cast<double>(cells_after(attempt.template_cells, attempt.levels));
  };
  const double first = cells_of(attempts.front());
  double needed = 1.5 * first;
  if (best) {
    const double excess = std::max(
        {best->mean_percent / options.mean_tolerance_percent, best->max_percent / options.max_tolerance_percent, 1.0});
    needed = static_cast<double>(best->cells) * std::pow(excess, 1.5);
  }
  double work = 0;
  for (const AutomaticAttempt& attempt : attempts) {
    work += cells_of(attempt);
    if (cells_of(attempt) >= needed) break;
  }
  if (!best && std::ranges::none_of(attempts, [&](const auto& a) { return cells_of(a) >= needed; })) work = first;
  return kPortionOfAllAttempts * first / work;
}

}  // namespace subvol::internal
