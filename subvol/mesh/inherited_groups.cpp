// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/mesh/inherited_groups.h"

#include "subvol/base/sort_unique.h"

#include <algorithm>
#include <optional>

namespace subvol::internal {

namespace {

/// Returns the vertices of the smallest old face or edge that contains all corners; nothing if they are too many, or if
/// a corner is inside a cell.
std::optional<VertexSupport> union_of(std::span<const Index> corners, std::span<const VertexSupport> support) {
  VertexSupport all = support_of({});
  std::size_t size = 0;
  for (const Index corner : corners) {
    if (support[corner][0] == kNoIndex) return std::nullopt;
    for (const Index v : support[corner]) {
      if (v == kNoIndex || std::find(all.begin(), all.begin() + size, v) != all.begin() + size) continue;
      if (size == all.size()) return std::nullopt;
      all[size++] = v;
    }
  }
  return all;
}

bool holds(const FaceKey& face, const VertexSupport& vertices) {
  return std::all_of(vertices.begin(), vertices.end(),
                     [&](Index v) { return v == kNoIndex || std::find(face.begin(), face.end(), v) != face.end(); });
}

}  // namespace

VertexSupport support_of(std::span<const Index> vertices) {
  VertexSupport support;
  support.fill(kNoIndex);
  if (vertices.size() <= support.size()) std::copy(vertices.begin(), vertices.end(), support.begin());
  return support;
}

VolumeFaceGroups inherited_groups(const VolumeFaceGroups& old, const MeshTopology& refined,
                                  std::span<const VertexSupport> support) {
  VolumeFaceGroups result{old.groups, {}};
  if (old.faces.empty()) return result;
  // The old faces by their smallest vertex; `old.faces` is sorted by it.
  const auto before = [](const GroupedFace& entry, Index v) { return entry.face[0] < v; };
  const auto add = [&](std::span<const Index> corners, const VertexSupport& vertices, Index smallest) {
    for (auto entry = std::lower_bound(old.faces.begin(), old.faces.end(), smallest, before);
         entry != old.faces.end() && entry->face[0] == smallest; ++entry)
      if (holds(entry->face, vertices)) result.faces.push_back({face_key(corners), entry->group});
  };
  // The smallest vertex of an old face need not be among those of a part of it, so all faces around one vertex are
  // tried.
  std::vector<std::pair<Index, Index>> smallest_around;  // a vertex of an old face, and the face's smallest vertex
  for (const GroupedFace& entry : old.faces)
    for (const Index v : entry.face)
      if (v != kNoIndex) smallest_around.emplace_back(v, entry.face[0]);
  sort_unique(smallest_around);
  for (std::size_t f = 0; f < refined.num_faces(); ++f) {
    const auto corners = refined.face(static_cast<Index>(f));
    const std::optional<VertexSupport> vertices = union_of(corners, support);
    if (!vertices) continue;
    const auto first =
        std::lower_bound(smallest_around.begin(), smallest_around.end(), std::pair(vertices->front(), kNoIndex));
    for (auto at = first; at != smallest_around.end() && at->first == vertices->front(); ++at)
      add(corners, *vertices, at->second);
  }
  normalize(result);
  return result;
}

VolumeFaceGroups inherited_groups(const VolumeFaceGroups& old, const MeshTopology& refined) {
  std::vector<VertexSupport> support;
  for (std::size_t v = 0; v < refined.num_vertices(); ++v) support.push_back(kept_vertex(static_cast<Index>(v)));
  return inherited_groups(old, refined, support);
}

}  // namespace subvol::internal
