// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/target/target_report.h"

#include "subvol/base/error.h"

namespace subvol {

namespace {

/// Returns nothing if the surface does not bound a solid.
std::optional<BettiNumbers> betti_numbers(const TriangleMesh& surface) {
  try {
    return solid_boundary(surface).topology;
  } catch (const InputError&) {
    return std::nullopt;
  }
}

/// Adds the Euler number of the boundary, which is twice that of the solid.
std::string words(const BettiNumbers& numbers) {
  return to_string(numbers) + " (Euler number of its boundary " + std::to_string(2 * numbers.euler_number()) + ")";
}

std::string counted(std::size_t n, const char* what) { return "target: " + std::to_string(n) + ' ' + what; }

}  // namespace

TargetReport describe_target(const TargetSurface& target, const TriangleMesh& boundary) {
  TargetReport report;
  report.area = target.area();
  report.volume = target.volume();
  report.volume_source = target.volume_source();
  if (target.is_cloud()) {
    report.num_points = target.samples().size();
    return report;
  }
  report.edges = target.edges();
  if (report.edges.open_edges > 0 || report.edges.crowded_edges > 0) return report;
  report.topology = betti_numbers({target.positions(), target.triangles()});
  if (report.topology) report.template_topology = betti_numbers(boundary);
  return report;
}

std::vector<std::string> warnings_of(const TargetReport& target) {
  std::vector<std::string> warnings;
  const SoupTopology& edges = target.edges;
  if (edges.open_edges > 0)
    warnings.push_back(counted(edges.open_edges, "open edges: nothing draws the fitted surface where holes are"));
  if (edges.turned_edges > 0)
    warnings.push_back(
        counted(edges.turned_edges, "edges whose triangles disagree about what is outside: it does not matter"));
  if (edges.crowded_edges > 0)
    warnings.push_back(counted(edges.crowded_edges,
                               "edges of three triangles or more: its topology is not compared with the "
                               "template's"));
  if (target.volume_source == VolumeSource::flood && target.num_points == 0)
    warnings.push_back(
        "target: it bounds no solid as it stands; its volume is that of a grid which the outside cannot reach");
  if (target.volume_source == VolumeSource::given)
    warnings.push_back("target: it encloses nothing; the template's volume is taken for the one wanted");
  if (target.topology && target.template_topology && !target.same_topology())
    warnings.push_back("topology differs: the target's solid has " + words(*target.topology) + ", the template's " +
                       words(*target.template_topology) + "; no fit can change that");
  return warnings;
}

}  // namespace subvol
