// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace subvol::cli {

/// Default chord error of curved surfaces that are drawn, in percent of the diagonal of their box: half a pixel of a
/// picture of a thousand. Surfaces that are measured are ten times closer (`measured_chord_percent`).
inline constexpr double kSceneChordPercent = 0.05;

}  // namespace subvol::cli
