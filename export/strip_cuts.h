// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/work_progress.h"
#include "subvol/subdivision/patch_surface.h"

#include <array>
#include <span>
#include <vector>

namespace subvol::internal {

/// Cuts of all patches of a surface, such that neighbors agree.
///
/// A strip is a chain of patches joined at opposite sides; all of them are cut across at the same parameters.
class StripCuts {
 public:
  /// Without inner cuts: from 0 to PatchSurface::kPatchSideUnits.
  explicit StripCuts(const PatchSurface& patches);

  std::size_t num_strips() const { return cuts_.size(); }
  /// The strips whose cuts are at constant u, and at constant v.
  const std::array<Index, 2>& strips(Index patch) const { return strips_[patch]; }
  /// Cuts of a strip including its ends, ascending.
  std::span<const int> cuts(Index strip) const { return cuts_[strip]; }
  std::size_t num_intervals(Index strip) const { return cuts_[strip].size() - 1; }

  /// Halves the chosen intervals of a strip; `chosen` has one flag per interval.
  void halve(Index strip, std::span<const char> chosen);

 private:
  std::vector<std::array<Index, 2>> strips_;
  std::vector<std::vector<int>> cuts_;
};

/// Result of `cut_strips`.
struct CutResult {
  StripCuts cuts;
  double chord_error;  ///< the largest distance that remains
};

/// Cuts until no quad is farther from the surface than max_chord_error. max_quads, progress and the limit on halving
/// are as in `tessellate`. `patches` is prepared to the depth needed.
CutResult cut_strips(PatchSurface& patches, double max_chord_error, std::size_t max_quads,
                     const WorkProgress& progress = {});

}  // namespace subvol::internal
