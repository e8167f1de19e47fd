// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace subvol {

/// How boundary vertices move when a mesh is refined.
enum class BoundaryRule {
  catmull_clark,  ///< rows equal OpenSubdiv's: the boundary is an artist's subdivision surface (default)
  averaging       ///< the paper's plain multi-linear averaging of the boundary quads
};

}  // namespace subvol
