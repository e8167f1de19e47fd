// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/automatic_fit.h"

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace subvol::internal {

/// Portion of the work that is left, for forecasts, if nothing is known about the attempts that follow: in the middle
/// of a fit, the share that is done is then between a quarter and three quarters, whether the first attempt is the last
/// or the second is.
inline constexpr double kAttemptPortion = 0.62;

/// One attempt of an automatic fit of one solid: a template of at most so many cells, and the number of times it is
/// subdivided.
struct AutomaticAttempt {
  enum class Kind {
    smooth,  ///< a pillowed template
    edges,   ///< a padded grid
    aligned  ///< a padded grid through the target's planes
  };
  Kind kind;
  std::size_t template_cells;
  int levels;
  bool is_last_count = true;        ///< no attempt with more cells follows
  std::optional<double> portion{};  ///< of the work that is left, for forecasts; nothing: `expected_portion`
  bool precedes_unrefined = false;  ///< an attempt follows whose template has as many cells as this result
};

/// Returns the number of cells that a template of so many becomes if it is subdivided so many times.
std::size_t cells_after(std::size_t cells, int levels);

/// Returns the number of cells from which a mesh gets about this many if it is subdivided so many times; at least
/// `kLeastTemplateCells`.
std::size_t cells_before(std::size_t cells, int levels);

/// Drops numbers of cells whose templates, which are subdivided so many times, have as many cells as those of the
/// number before.
void drop_equal_templates(int levels, std::vector<std::size_t>& counts);

/// Returns the attempts to make, in this order, until a fit is good.
/// has_edges  the target has sharp edges to follow.
std::vector<AutomaticAttempt> attempts_of(const AutomaticFitOptions& options, bool has_edges);

/// Returns the portion of the work that is left that the first of some attempts is expected to take, if work grows with
/// the number of cells.
///
/// attempts  those that are left, at least one.
/// best      the best trial so far: distances fall with the square of the cells' size, so it tells which attempt will
///           be the last. If null, the next larger number of cells is expected to be the last.
double expected_portion(std::span<const AutomaticAttempt> attempts, const AutomaticFitTrial* best,
                        const AutomaticFitOptions& options);

}  // namespace subvol::internal
