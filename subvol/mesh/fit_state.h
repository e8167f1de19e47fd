// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <string>
#include <vector>

namespace subvol {

/// Positions of a mesh at some moment of a fit, in the numbering of the mesh that the fit ended with.
struct FitState {
  std::string name;             ///< "template", or the name of the minimization that led to this state
  std::vector<Vec3> positions;  ///< of the finished mesh's vertices, or the coefficients of a high-order mesh
};

}  // namespace subvol
