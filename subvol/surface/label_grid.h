// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <array>
#include <cstddef>
#include <limits>
#include <vector>

namespace subvol {

/// A segmentation: a grid of voxels, each with the number of the region that it belongs to.
struct LabelGrid {
  std::array<int, 3> counts{0, 0, 0};  ///< voxels along each axis, >= 1
  Vec3 origin = Vec3::Zero();          ///< center of the first voxel
  Mat3 edges = Mat3::Identity();       ///< columns: from a voxel's center to the next along each axis; invertible
  /// Of voxel (i, j, k), at i + counts[0] (j + counts[1] k): >= 0; 0: outside.
  std::vector<int> labels;

  std::size_t num_voxels() const { return labels.size(); }
};

namespace internal {

/// Layers of empty voxels that are put around a segmentation.
inline constexpr int kLabelRim = 2;

/// Returns true if the corners of all voxels and of those layers can be numbered with 32 bits.
inline bool can_number_voxels(const std::array<int, 3>& counts) {
  double corners = 1;
  for (const int n : counts) corners *= n + (2 * kLabelRim + 1.0);
  return corners <= std::numeric_limits<Index>::max();
}

}  // namespace internal

}  // namespace subvol
