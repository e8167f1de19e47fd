// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/patch_fans.h"

#include "subvol/base/error.h"

#include <algorithm>
#include <string>

namespace subvol::internal {

namespace {

std::vector<Index> paths_of_edges(const PatchedMesh& patched, const MeshTopology& topology,
                                  const BoundarySurface& boundary) {
  std::vector<Index> surface_edge(topology.num_edges(), kNoIndex);
  for (std::size_t e = 0; e < boundary.edges.size(); ++e) surface_edge[boundary.edges[e]] = static_cast<Index>(e);
  std::vector<Index> path_of_edge(boundary.edges.size(), kNoIndex);
  for (std::size_t p = 0; p < patched.paths.size(); ++p)
    for (Index edge : edges_of_path(topology, patched.paths[p].vertices))
      path_of_edge[surface_edge[edge]] = static_cast<Index>(p);
  return path_of_edge;
}

}  // namespace

PatchFans::PatchFans(const PatchedMesh& patched)
    : topology(patched.mesh),
      boundary(tagged_boundary(patched.mesh, topology)),
      path_of_edge(paths_of_edges(patched, topology, boundary)) {
  if (patched.patches.of_face.size() != topology.boundary_faces().size())
    throw InputError("pads: one patch is needed for each boundary face");
  if (patched.fitted.size() != patched.mesh.num_vertices())
    throw InputError("pads: one fitted position is needed for each vertex");
  for (Index p : patched.patches.of_face)
    if (p < 0 || static_cast<std::size_t>(p) >= patched.patches.count)
      throw InputError("pads: there is no patch " + std::to_string(p));
}

void PatchFans::fan_at(Index surface_vertex, std::vector<Place>& fan) const {
  fan.clear();
  const Index first = surface().vertex_corners[surface_vertex];
  Index corner = first;
  do {
    fan.push_back({surface().corner_faces[corner], surface().corner_edges[corner], corner});
    corner = surface().rotate(corner);
  } while (corner != first);
}

std::array<Index, 2> PatchFans::faces_at(Index edge) const {
  const Index corner = surface().edge_corners[edge];
  return {surface().corner_faces[corner], surface().corner_faces[surface().twins[corner]]};
}

FanState fan_state(const PatchFans& fans, const PatchedMesh& patched, std::span<const PatchFans::Place> fan,
                   std::span<const std::uint8_t> is_padded) {
  FanState state;
  for (std::size_t i = 0; i < fan.size(); ++i) {
    const bool before = is_padded[patched.patches.of_face[fan[(i + fan.size() - 1) % fan.size()].face]];
    const bool after = is_padded[patched.patches.of_face[fan[i].face]];
    state.any |= after;
    state.changes += before != after;
    state.free_paths += !before && !after && fans.path_of_edge[fan[i].edge] != kNoIndex;
    state.shared |= !after && !patched.shared.empty() && patched.shared[patched.patches.of_face[fan[i].face]] != 0;
  }
  return state;
}

std::optional<PadProblem> FanState::problem() const {
  if (any && changes > 2) return PadProblem::touches_itself;
  if (any && free_paths > 1) return PadProblem::too_many_paths;
  if (any && shared) return PadProblem::moves_shared;
  return std::nullopt;
}

std::optional<PadRefusal> topological_refusal(const PatchFans& fans, const PatchedMesh& patched,
                                              std::span<const std::uint8_t> is_padded) {
  std::vector<PatchFans::Place> fan;
  for (std::size_t v = 0; v < fans.boundary.vertices.size(); ++v) {
    fans.fan_at(static_cast<Index>(v), fan);
    if (const auto problem = fan_state(fans, patched, fan, is_padded).problem())
      return PadRefusal{*problem, fans.boundary.vertices[v]};
  }
  return std::nullopt;
}

}  // namespace subvol::internal
