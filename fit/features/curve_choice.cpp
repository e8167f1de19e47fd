// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/curve_choice.h"

#include "subvol/base/error.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace subvol::internal {

namespace {

void require_sizes(const PatchedMesh& patched, const SignedFeatures& features, std::span<const double> faults,
                   RoutingOptions& options) {
  const std::size_t curves = features.curves.curves.size();
  if (faults.size() != patched.mesh.num_cells())
    throw InputError("give_up_poor_curves: one fault is needed for each of the " +
                     std::to_string(patched.mesh.num_cells()) + " cells");
  for (const CreasePath& path : patched.paths)
    if (path.curve < 0 || static_cast<std::size_t>(path.curve) >= curves)
      throw InputError("give_up_poor_curves: there is no curve " + std::to_string(path.curve));
  for (auto* list : {&options.excluded, &options.not_joined}) {
    if (list->empty()) list->assign(curves, 0);
    if (list->size() != curves) throw InputError("give_up_poor_curves: options need one entry for each curve");
  }
}

/// Returns the fault of each vertex: the sum over its cells.
std::vector<double> vertex_faults(const VolumeMesh& mesh, std::span<const double> faults) {
  std::vector<double> sums(mesh.num_vertices(), 0.0);
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    for (Index v : mesh.cell(c)) sums[v] += faults[c];
  return sums;
}

/// Returns the curves at fault with their faults, the worst first.
std::vector<std::pair<double, Index>> curves_at_fault(const PatchedMesh& patched, const SignedFeatures& features,
                                                      const FeatureRouting& routing, std::span<const double> faults) {
  const std::vector<double> at_vertex = vertex_faults(patched.mesh, faults);
  std::map<Index, double> sums, parts;  // by curve; length of what is followed, of curves in parts
  for (const CreasePath& path : patched.paths)
    for (Index v : path.vertices) sums[path.curve] += at_vertex[v];
  for (const FollowedPart& part : routing.parts) parts[part.curve] += part.to - part.from;
  std::vector<std::pair<double, Index>> curves;
  for (const auto& [c, sum] : sums) {
    const auto part = parts.find(c);
    const double length = part != parts.end() ? part->second : features.curves.curves[c].length();
    if (sum > 0 && length > 0) curves.push_back({sum / length, c});
  }
  std::ranges::stable_sort(curves, [](const auto& a, const auto& b) { return a.first > b.first; });
  return curves;
}

}  // namespace

bool give_up_poor_curves(const PatchedMesh& patched, const SignedFeatures& features, const FeatureRouting& routing,
                         std::span<const double> faults, RoutingOptions& options) {
  require_sizes(patched, features, faults, options);
  const auto curves = curves_at_fault(patched, features, routing, faults);
  bool any_joined = false;
  for (const auto& [fault, c] : curves) {
    if (options.not_joined[c] || !std::ranges::binary_search(routing.joined, c)) continue;
    options.not_joined[c] = 1;
    any_joined = true;
  }
  if (any_joined) return true;
  const std::size_t count =
      curves.empty() ? 0 : std::max<std::size_t>(1, curves.size() / static_cast<std::size_t>(options.one_in));
  for (const auto& [fault, c] : std::span(curves).first(count)) options.excluded[c] = 1;
  return count > 0;
}

}  // namespace subvol::internal
