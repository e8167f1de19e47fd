// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/face_groups.h"

#include "cli/runs/writing.h"
#include "subvol/export/export.h"

#include <utility>
#include <variant>

namespace subvol::cli {

using namespace internal;
namespace {

/// The target if it is a surface with groups, else null.
const TriangleMesh* grouped_surface(const Target& target) {
  const auto* surface = std::get_if<TriangleMesh>(&target);
  return surface && !surface->face_groups.empty() ? surface : nullptr;
}

GroupsFound carry(const TriangleMesh& target, const CurvedBoundary& boundary, const MeshTopology& topology,
                  VolumeFaceGroups& own) {
  std::vector<Index> carried = carried_groups(target, boundary, topology.boundary_faces().size());
  GroupsFound found{areas_of_groups(target, boundary, carried), {}};
  for (const std::string& warning : warnings_of_groups(found.groups)) found.warnings.push_back(as_utf8(warning));
  own = with_carried_groups(target, std::move(carried), own, topology);
  return found;
}

/// The place of a group among others, or kNoIndex.
Index place_of(const Group& group, const std::vector<Group>& others) {
  for (std::size_t i = 0; i < others.size(); ++i) {
    const bool have_names = !group.name.empty() && !others[i].name.empty();
    if (have_names ? group.name == others[i].name : group.number == others[i].number) return static_cast<Index>(i);
  }
  return kNoIndex;
}

GroupsFound compare(const TriangleMesh& target, const CurvedBoundary& boundary, const MeshTopology& topology,
                    const VolumeFaceGroups& own) {
  std::vector<Index> places;
  for (const Group& group : own.groups) places.push_back(place_of(group, target.face_groups.groups));
  std::vector<Index> found = groups_of_boundary(own, topology);
  for (Index& group : found)
    if (group != kNoIndex) group = places[static_cast<std::size_t>(group)];
  GroupsFound result{areas_of_groups(target, boundary, found), {}};
  for (const std::string& warning : warnings_of_groups(result.groups)) result.warnings.push_back(as_utf8(warning));
  return result;
}

}  // namespace

GroupsFound compare_groups(const Target& target, const VolumeMesh& mesh) {
  const TriangleMesh* surface = grouped_surface(target);
  if (!surface || mesh.face_groups.empty() || mesh.num_cells() == 0) return {};
  const MeshTopology topology(mesh);
  return compare(*surface, linear_boundary(mesh, topology), topology, mesh.face_groups);
}

GroupsFound compare_groups(const Target& target, const HighOrderFile& file) {
  const TriangleMesh* surface = grouped_surface(target);
  if (!surface || file.face_groups.empty()) return {};
  return compare(*surface, curved_boundary(file.mesh, WritingOptions{}.chord_percent), file.mesh.space.topology(),
                 file.face_groups);
}

GroupsFound carry_groups(const Target& target, VolumeMesh& mesh) {
  const TriangleMesh* surface = grouped_surface(target);
  if (!surface || mesh.num_cells() == 0) return {};
  const MeshTopology topology(mesh);
  return carry(*surface, linear_boundary(mesh, topology), topology, mesh.face_groups);
}

GroupsFound carry_groups(const Target& target, HighOrderFile& file) {
  const TriangleMesh* surface = grouped_surface(target);
  if (!surface) return {};
  const CurvedBoundary boundary = curved_boundary(file.mesh, WritingOptions{}.chord_percent);
  return carry(*surface, boundary, file.mesh.space.topology(), file.face_groups);
}

Json groups_json(const std::vector<CarriedGroup>& groups) {
  Json json = Json::array();
  for (const CarriedGroup& found : groups)
    json.push_back({{"name", as_utf8(found.group.name)},
                    {"number", found.group.number},
                    {"target_area", found.target_area},
                    {"area", found.area},
                    {"faces", found.faces}});
  return json;
}

}  // namespace subvol::cli
