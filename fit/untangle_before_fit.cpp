// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/untangle_before_fit.h"

#include "subvol/base/error.h"
#include "subvol/fit/certificate/certificate.h"
#include "subvol/fit/certificate/high_order_certificate.h"

#include <string>
#include <utility>

namespace subvol {

namespace {

/// Takes over the mesh of a result of `optimize_mesh` or `optimize_curved`. tangled: number of its cells at the start.
template <class Result, class Mesh>
UntangledStart taken_over(Result result, std::size_t tangled, Mesh& mesh) {
  const std::vector<Index>& left = result.uncertified;
  const StopReason reason = result.report.stop_reason;
  if (reason == StopReason::cancelled || reason == StopReason::time_limit) return {tangled, left.size(), reason};
  if (!left.empty())
    throw InputError(std::to_string(left.size()) + " cells could not be made valid before the fit, the first is cell " +
                     std::to_string(left[0]));
  mesh = std::move(result.mesh);
  return {tangled};
}

}  // namespace

UntangledStart untangle_before_fit(VolumeMesh& mesh, const OptimizeOptions& given) {
  const std::size_t tangled = certify(mesh).not_certified.size();
  if (tangled == 0) return {};
  OptimizeOptions options = given;
  options.quality = 0;  // the fit moves all vertices afterwards, and raises the quality itself
  return taken_over(optimize_mesh(mesh, nullptr, options), tangled, mesh);
}

UntangledStart untangle_before_fit(HighOrderMesh& mesh, const VolumeMesh& labels, const CurvedOptimizeOptions& given) {
  const std::size_t tangled = internal::certify(mesh.space, mesh.coefficients).not_certified.size();
  if (tangled == 0) return {};
  CurvedOptimizeOptions options = given;
  options.quality = 0;
  return taken_over(optimize_curved(mesh, labels, options), tangled, mesh);
}

}  // namespace subvol
