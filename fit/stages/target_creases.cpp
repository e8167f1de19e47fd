// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/stages/target_creases.h"

#include "subvol/fit/features/crisp_edges.h"
#include "subvol/fit/features/feature_curves.h"
#include "subvol/mesh/interfaces.h"

#include <array>
#include <vector>

namespace subvol::internal {

FollowedCreases creases_along_target(const FitTarget& target, const CreaseRule& rule, VolumeMesh& template_mesh) {
  if (target.surface.is_cloud()) return {};
  std::vector<std::array<Index, 2>> borders;
  if (rule.keeps_groups) borders = group_borders(target.mesh, target.mesh);
  std::optional<double> angle = rule.angle_degrees;
  if (!rule.follows_all_edges &&
      (!template_mesh.tags.creases.empty() || !has_edges_to_follow(target.mesh, angle, rule.follows_all_edges)))
    angle.reset();
  if (!angle && !borders.empty()) angle = kNoCreaseAngle;
  if (!angle && template_mesh.tags.creases.empty()) return {};
  return {target.mesh, angle, template_mesh, borders};
}

void keep_interfaces(const CreaseRule& rule, FitTarget& target, FollowedCreases& creases, VolumeMesh& template_mesh,
                     FitReport& report) {
  using InnerCurves = FollowedCreases::InnerCurves;
  const bool has_own = target.has_interfaces();
  target.keep_interfaces(template_mesh);
  if (target.has_interfaces())
    creases.keep_interfaces(template_mesh, rule.angle_degrees.value_or(kUsualCreaseAngle),
                            has_own ? InnerCurves::nothing : InnerCurves::themselves);
  else if (region_references(template_mesh).size() > 1)
    report.warnings.push_back("points do not say where regions meet: their interfaces are not kept in place");
}

}  // namespace subvol::internal
