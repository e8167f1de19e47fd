// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/automatic_fit.h"

#include <cstddef>
#include <vector>

namespace subvol::internal {

/// Portion of the work that is left, for forecasts: in the middle of a fit, the share that is done is then between a
/// quarter and three quarters, whether the first attempt is the last or the second is.
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
  double portion = kAttemptPortion;  ///< of the work that is left
  bool precedes_unrefined = false;  ///< an attempt follows whose template has as many cells as this result
};

/// Returns the number of cells that a template of so many becomes if it is subdivided so many times.
std::size_t cells_after(std::size_t cells, int levels);

/// Returns the attempts to make, in this order, until a fit is good.
/// has_edges  the target has sharp edges to follow.
std::vector<AutomaticAttempt> attempts_of(const AutomaticFitOptions& options, bool has_edges);

}  // namespace subvol::internal
