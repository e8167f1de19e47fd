// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/written_file.h"
#include "subvol/io/mesh_io.h"
#include "subvol/mesh/mesh_topology.h"

#include <algorithm>
#include <optional>
#include <tuple>

namespace subvol::internal {
namespace {

FeatureTags normal_form(FeatureTags tags) {
  for (CreaseEdge& crease : tags.creases) {
    if (crease.v0 > crease.v1) std::swap(crease.v0, crease.v1);
    crease.sharpness = std::min(crease.sharpness, kInfiniteSharpness);
  }
  for (CornerVertex& corner : tags.corners) corner.sharpness = std::min(corner.sharpness, kInfiniteSharpness);
  const auto edge = [](const CreaseEdge& crease) { return std::tie(crease.v0, crease.v1); };
  std::sort(tags.creases.begin(), tags.creases.end(), [&](const auto& a, const auto& b) { return edge(a) < edge(b); });
  std::sort(tags.corners.begin(), tags.corners.end(),
            [](const CornerVertex& a, const CornerVertex& b) { return a.vertex < b.vertex; });
  return tags;
}

/// Compares the group of each face by its number; 0 stands for another in a file.
void compare_groups(const WrittenFile& file, const VolumeMesh& found, const VolumeMesh& wanted) {
  if (wanted.face_groups.empty()) return;
  const MeshTopology topology(wanted);
  const auto number = [](const VolumeFaceGroups& groups, std::span<const Index> face) {
    const Index group = group_of(groups, face);
    return group == kNoIndex ? std::optional<int>() : groups.groups[group].number;
  };
  for (std::size_t f = 0; f < topology.num_faces(); ++f) {
    const auto face = topology.face(static_cast<Index>(f));
    const auto in_file = number(found.face_groups, face), expected = number(wanted.face_groups, face);
    file.same(expected == 0 ? in_file.has_value() : in_file == expected, "the group of face", f);
  }
}

}  // namespace

void compare_linear(const WrittenFile& file, const VolumeMesh& wanted, bool is_medit) {
  const VolumeMesh found = read_volume_mesh(file.path(), {.check = false});
  file.same_count("vertices", found.num_vertices(), wanted.num_vertices());
  file.same_count("cells", found.num_cells(), wanted.num_cells());
  for (std::size_t v = 0; v < wanted.num_vertices(); ++v)
    file.same(found.positions[v] == wanted.positions[v], "vertex", v);
  // Medit has one section for each kind: hexes, prisms, tets, pyramids.
  const auto section = [&](std::size_t c) {
    constexpr int kSections[] = {3, 2, 1, 4};
    return is_medit ? kSections[static_cast<std::size_t>(wanted.kinds[c])] : 0;
  };
  const std::vector<std::size_t> order = sorted_cells(wanted.num_cells(), section);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::size_t c = order[i];
    file.same(found.kinds[i] == wanted.kinds[c], "the kind of cell", c);
    file.same(std::ranges::equal(found.cell(i), wanted.cell(c)), "the corners of cell", c);
    file.same(reference_of(found.references, i) == reference_of(wanted.references, c), "the reference of cell", c);
  }
  if (!is_medit) return;
  compare_groups(file, found, wanted);
  const FeatureTags tags = normal_form(found.tags), tags_wanted = normal_form(wanted.tags);
  file.same_count("creases", tags.creases.size(), tags_wanted.creases.size());
  file.same_count("corners", tags.corners.size(), tags_wanted.corners.size());
  for (std::size_t i = 0; i < tags.creases.size(); ++i)
    file.same(tags.creases[i] == tags_wanted.creases[i], "crease", i);
  for (std::size_t i = 0; i < tags.corners.size(); ++i)
    file.same(tags.corners[i] == tags_wanted.corners[i], "corner", i);
}

}  // namespace subvol::internal
