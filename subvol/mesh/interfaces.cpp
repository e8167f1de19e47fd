// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/mesh/interfaces.h"

#include "subvol/base/sort_unique.h"

#include <algorithm>

namespace subvol::internal {

namespace {

std::array<int, 2> pair_of(const VolumeMesh& mesh, const MeshTopology& topology, std::size_t face) {
  const auto [first, second] = topology.face_cells(static_cast<Index>(face));
  if (second == kNoIndex) return {0, 0};
  const auto [low, high] = std::minmax(mesh.references[first], mesh.references[second]);
  return {low, high};
}

}  // namespace

Interfaces find_interfaces(const VolumeMesh& mesh, const MeshTopology& topology) {
  Interfaces result;
  const auto differs = [&](int reference) { return reference != mesh.references[0]; };
  if (mesh.references.size() != mesh.num_cells() || std::ranges::none_of(mesh.references, differs)) return result;
  for (std::size_t f = 0; f < topology.num_faces(); ++f) {
    const std::array<int, 2> pair = pair_of(mesh, topology, f);
    if (pair[0] == pair[1]) continue;
    result.faces.push_back(static_cast<Index>(f));
    result.pairs.push_back(pair);
  }
  sort_unique(result.pairs);
  for (const Index f : result.faces) {
    const auto at = std::ranges::lower_bound(result.pairs, pair_of(mesh, topology, static_cast<std::size_t>(f)));
    result.pair_of_face.push_back(static_cast<Index>(at - result.pairs.begin()));
  }
  return result;
}

std::array<Index, 4> oriented_face(const VolumeMesh& mesh, const MeshTopology& topology, Index face) {
  std::array<Index, 4> corners{kNoIndex, kNoIndex, kNoIndex, kNoIndex};
  const auto given = topology.face(face);
  std::copy(given.begin(), given.end(), corners.begin());
  const auto [first, second] = topology.face_cells(face);  // the normal points out of the first cell
  if (mesh.references[first] > mesh.references[second]) std::reverse(corners.begin(), corners.begin() + given.size());
  return corners;
}

InterfaceMarks mark_interfaces(const MeshTopology& topology, const Interfaces& interfaces) {
  InterfaceMarks marks;
  if (interfaces.empty()) return marks;
  marks.edges.assign(topology.num_edges(), 0);
  marks.vertices.assign(topology.num_vertices(), 0);
  std::vector<int> counts(topology.num_edges(), 0);
  for (const Index f : interfaces.faces) {
    const auto face = topology.face(f);
    for (std::size_t i = 0; i < face.size(); ++i) {
      const Index e = topology.find_edge(face[i], face[(i + 1) % face.size()]);
      marks.edges[e] = 1;
      marks.vertices[face[i]] = 1;
      ++counts[e];
    }
  }
  for (std::size_t e = 0; e < counts.size(); ++e)
    marks.curves.push_back(marks.edges[e] && (counts[e] != 2 || topology.is_boundary_edge(static_cast<Index>(e))));
  return marks;
}

std::vector<int> region_references(const VolumeMesh& mesh) {
  if (mesh.references.empty()) return {0};
  std::vector<int> references = mesh.references;
  sort_unique(references);
  return references;
}

void add_interface_groups(VolumeMesh& mesh) {
  const MeshTopology topology(mesh);
  const Interfaces interfaces = find_interfaces(mesh, topology);
  const auto first = static_cast<Index>(mesh.face_groups.groups.size());
  for (const auto& [a, b] : interfaces.pairs)
    mesh.face_groups.groups.push_back(
        {region_label(mesh, a) + "|" + region_label(mesh, b), free_number(mesh.face_groups.groups), 2});
  for (std::size_t i = 0; i < interfaces.faces.size(); ++i)
    mesh.face_groups.faces.push_back(
        {face_key(topology.face(interfaces.faces[i])), first + interfaces.pair_of_face[i]});
  normalize(mesh.face_groups);
}

std::string region_label(const VolumeMesh& mesh, int reference) {
  for (const Group& group : mesh.regions)
    if (group.number == reference && !group.name.empty()) return group.name;
  return "region " + std::to_string(reference);
}

}  // namespace subvol::internal
