// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/untangle_before_fit.h"

#include "subvol/base/error.h"
#include "subvol/fit/certificate/certificate.h"

#include <string>
#include <utility>

namespace subvol {

UntangledStart untangle_before_fit(VolumeMesh& mesh, const OptimizeOptions& given) {
  const std::size_t tangled = certify(mesh).not_certified.size();
  if (tangled == 0) return {};
  OptimizeOptions options = given;
  options.quality = 0;  // the fit moves all vertices afterwards, and raises the quality itself
  OptimizeResult result = optimize_mesh(mesh, nullptr, options);
  const std::vector<Index>& left = result.uncertified;
  const StopReason reason = result.report.stop_reason;
  if (reason == StopReason::cancelled || reason == StopReason::time_limit) return {tangled, left.size(), reason};
  if (!left.empty())
    throw InputError(std::to_string(left.size()) + " cells could not be made valid before the fit, the first is cell " +
                     std::to_string(left[0]));
  mesh = std::move(result.mesh);
  return {tangled};
}

}  // namespace subvol
