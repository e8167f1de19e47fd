// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/loading.h"
#include "cli/runs/run_options.h"
#include "subvol/export/high_order_file.h"
#include "subvol/fit/target/carried_groups.h"
#include "subvol/mesh/volume_mesh.h"

#include <string>
#include <vector>

namespace subvol::cli {

using internal::CarriedGroup;

/// The groups of a target as they arrived on a result, and the warnings about them. Both are empty if the target has no
/// groups.
struct GroupsFound {
  std::vector<CarriedGroup> groups;
  std::vector<std::string> warnings;
};

/// These functions give each boundary face of a result the group of the target that it lies on (`carried_groups`).
/// Groups that the mesh has already stay where the target gives none. Points have no groups.
GroupsFound carry_groups(const Target& target, VolumeMesh& mesh);
GroupsFound carry_groups(const Target& target, HighOrderFile& file);

/// Compare the groups that a mesh has on its boundary with those of a target: a group of the same name or, if one of
/// the two has none, of the same number. Empty if the mesh or the target has no groups.
GroupsFound compare_groups(const Target& target, const VolumeMesh& mesh);
GroupsFound compare_groups(const Target& target, const HighOrderFile& file);

/// Entry "groups" of a report.
Json groups_json(const std::vector<CarriedGroup>& groups);

}  // namespace subvol::cli
