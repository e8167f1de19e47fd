// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/curve_mesh.h"

#include "fit/certificate.h"
#include "subvol/error.h"

#include <string>
#include <utility>

namespace subvol {

std::size_t untangle_before_fit(VolumeMesh& mesh, const OptimizeOptions& options) {
  const std::size_t before = certify(mesh).not_certified.size();
  if (before == 0) return 0;
  OptimizeResult result = optimize_mesh(mesh, nullptr, options);
  if (!result.uncertified.empty())
    throw InputError(std::to_string(result.uncertified.size()) +
                     " cells could not be made valid before the fit, the first is cell " +
                     std::to_string(result.uncertified[0]));
  mesh = std::move(result.mesh);
  return before;
}

}  // namespace subvol
