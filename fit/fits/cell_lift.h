// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

namespace subvol::internal {

/// Values of a setting that lifts poor curved cells: the first one, multiplied each time by the factor, up to the last.
struct LiftValues {
  double first, factor, last;
};
/// Emphasis on places of poor shape, and weight of the hinge (`HighOrderEnergy`).
inline constexpr LiftValues kEmphases{4, 2, 512}, kHinges{10, 4, 1e5};

/// Returns the cells whose least scaled Jacobian is below this quality, the poorest first.
inline std::vector<Index> poor_cells(std::span<const double> cell_minima, double quality) {
  std::vector<Index> cells;
  for (std::size_t c = 0; c < cell_minima.size(); ++c)
    if (cell_minima[c] < quality) cells.push_back(static_cast<Index>(c));
  std::ranges::stable_sort(cells, {}, [&](Index c) { return cell_minima[c]; });
  return cells;
}

/// Outcome of a repeated minimization; ended: it was interrupted.
enum class Again { kept, undone, ended };

/// Repeats a minimization around poor cells with higher and higher values of a setting. A value that does not help may
/// be too low to change the worst cell, so higher ones are attempted as well before this ends.
///
/// most_failed       number of values in a row without a gain that end it (`CurvedTuning::most_failed_lifts`).
/// is_poor()         true while there are cells to lift.
/// run_again(value)  minimizes with this value, and rolls back if the result is not better.
/// returns           `ended`, or else `kept`.
template <class IsPoor, class RunAgain>
Again lift(double setting, const LiftValues& values, int most_failed, const IsPoor& is_poor,
           const RunAgain& run_again) {
  double attempted = setting;
  for (int failures = 0; failures < most_failed && is_poor() && attempted < values.last;) {
    attempted = attempted == 0 ? values.first : values.factor * attempted;
    const Again last = run_again(attempted);
    if (last == Again::ended) return last;
    failures = last == Again::kept ? 0 : failures + 1;
  }
  return Again::kept;
}

}  // namespace subvol::internal
