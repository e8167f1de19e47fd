// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <string>
#include <vector>

namespace subvol {

/// Where a mesh was at some time of a fit, by the numbers of the mesh that the fit ended with.
struct FitState {
  std::string name;             ///< "template", or of the minimisation that came to it
  std::vector<Vec3> positions;  ///< of the finished mesh's vertices; of a high-order mesh its coefficients
};

}  // namespace subvol
