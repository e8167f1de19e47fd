// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace subvol {

/// The purpose for which a surface is mended decides what is a fault.
enum class MendingGoal {
  /// Layers of cells are to stand on it: a vertex from which no direction sees all faces around is a fault.
  layers,
  solid,             ///< it is to bound a solid: such a vertex is none
  solid_with_cracks  ///< as `solid`, and its rims are cracks: those that are close to each other are closed
};

}  // namespace subvol
