// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/export/scene.h"

namespace subvol {

/// Returns the color of a scaled Jacobian: viridis from 0 (dark violet) to 1 (yellow), vermilion for every value <= 0.
///
/// The map is even in lightness and readable with any color vision; vermilion does not occur in viridis, so that an
/// inverted cell cannot be mistaken for a poor one. Values above 1 count as 1; NaN is vermilion.
LinearColor quality_color(double scaled_jacobian);

/// Name of the map as it appears in exported files.
inline constexpr const char* kQualityColorMap = "viridis over scaled Jacobian 0..1, vermilion at 0 and below";

}  // namespace subvol
