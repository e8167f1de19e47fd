// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/templates/cell_split.h"

#include "subvol/base/error.h"
#include "subvol/mesh/inherited_groups.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/mesh/validate.h"

#include <algorithm>
#include <array>
#include <string>
#include <vector>

namespace subvol {

using namespace internal;

namespace {

/// Adds the tets that join the cell's smallest vertex to the faces that do not contain it. A quad is cut at its
/// smallest vertex.
void fan_tets(const VolumeMesh& mesh, std::size_t c, VolumeMesh& result) {
  const auto cell = mesh.cell(c);
  const CellTopology& local = cell_topology(mesh.kinds[c]);
  const Index apex = *std::min_element(cell.begin(), cell.end());
  const auto add = [&](Index a, Index b, Index d) {  // in the order seen from outside
    result.add_cell(CellKind::tet, std::array<Index, 4>{a, d, b, apex});
    if (!mesh.references.empty()) result.references.push_back(mesh.references[c]);
  };
  for (int f = 0; f < local.num_faces; ++f) {
    std::array<Index, 4> face{};
    const auto size = static_cast<std::size_t>(local.face_sizes[f]);
    for (std::size_t i = 0; i < size; ++i) face[i] = cell[local.faces[f][i]];
    const auto end = face.begin() + static_cast<std::ptrdiff_t>(size);
    if (std::find(face.begin(), end, apex) != end) continue;
    std::rotate(face.begin(), std::min_element(face.begin(), end), end);
    add(face[0], face[1], face[2]);
    if (size == 4) add(face[0], face[2], face[3]);
  }
}

/// For every hex, the axis that the direction runs along: 0, 1 or 2 for local edge 0-1, 0-3 or 0-4; kNoIndex if not
/// reached.
std::vector<int> carried_axes(const VolumeMesh& mesh, const MeshTopology& topology, Index v0, Index v1) {
  const CellTopology& hex = cell_topology(CellKind::hex);
  // The axis of a local edge: every edge of a hex is parallel to 0-1, 0-3 or 0-4.
  const auto axis_of = [&](std::size_t c, Index a, Index b) {
    const auto cell = mesh.cell(c);
    const auto i = std::find(cell.begin(), cell.end(), a) - cell.begin(),
               j = std::find(cell.begin(), cell.end(), b) - cell.begin();
    if (i / 4 != j / 4) return 2;
    const auto low = std::min(i % 4, j % 4), high = std::max(i % 4, j % 4);
    return (low == 0 && high == 1) || (low == 2 && high == 3) ? 0 : 1;
  };
  const auto edge_along = [&](std::size_t c, int axis, std::span<const Index> face) -> std::array<Index, 2> {
    for (int e = 0; e < hex.num_edges; ++e) {
      const Index a = mesh.cell(c)[hex.edges[e][0]], b = mesh.cell(c)[hex.edges[e][1]];
      const auto holds = [&](Index v) { return std::find(face.begin(), face.end(), v) != face.end(); };
      if (holds(a) && holds(b) && axis_of(c, a, b) == axis) return {a, b};
    }
    return {kNoIndex, kNoIndex};
  };
  // The axis of the edges that leave a face.
  const auto axis_across = [&](std::size_t c, std::span<const Index> face) {
    for (int axis = 0; axis < 3; ++axis)
      if (edge_along(c, axis, face)[0] == kNoIndex) return axis;
    return 0;
  };
  std::vector<int> axes(mesh.num_cells(), kNoIndex);
  std::vector<std::size_t> queue;
  const Index start = v0 >= 0 && v1 >= 0 && v0 != v1 && std::max<std::size_t>(v0, v1) < mesh.num_vertices()
                          ? topology.find_edge(v0, v1)
                          : kNoIndex;
  if (start == kNoIndex)
    throw InputError("split: there is no edge between vertices " + std::to_string(v0) + " and " + std::to_string(v1));
  const auto give = [&](std::size_t c, int axis) {
    if (axes[c] == kNoIndex) {
      axes[c] = axis;
      queue.push_back(c);
    } else if (axes[c] != axis) {
      throw InputError("split: the direction of the edge cannot be carried around to cell " + std::to_string(c));
    }
  };
  for (std::size_t c = 0; c < mesh.num_cells() && queue.empty(); ++c) {
    const auto edges = topology.cell_edges(c);
    if (std::find(edges.begin(), edges.end(), start) != edges.end()) give(c, axis_of(c, v0, v1));
  }
  for (std::size_t q = 0; q < queue.size(); ++q) {
    const std::size_t c = queue[q];
    for (Index f : topology.cell_faces(c)) {
      const auto& cells = topology.face_cells(f);
      const Index other = cells[0] == static_cast<Index>(c) ? cells[1] : cells[0];
      if (other == kNoIndex) continue;
      const auto along = edge_along(c, axes[c], topology.face(f));
      give(other, along[0] == kNoIndex ? axis_across(other, topology.face(f)) : axis_of(other, along[0], along[1]));
    }
  }
  return axes;
}

/// Gives the parts of faces the groups of the faces.
void inherit_groups(const VolumeMesh& mesh, VolumeMesh& result) {
  result.regions = mesh.regions;
  if (!mesh.face_groups.empty()) result.face_groups = inherited_groups(mesh.face_groups, MeshTopology(result));
}

}  // namespace

VolumeMesh split_into_tets(const VolumeMesh& mesh) {
  require_valid(mesh, "split");
  VolumeMesh result;
  result.positions = mesh.positions;
  result.tags = mesh.tags;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) fan_tets(mesh, c, result);
  require_valid(result, "split");
  inherit_groups(mesh, result);
  return result;
}

VolumeMesh split_into_prisms(const VolumeMesh& mesh, Index v0, Index v1) {
  require_valid(mesh, "split");
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    if (mesh.kinds[c] != CellKind::hex) throw InputError("split: cell " + std::to_string(c) + " is no hex");
  const MeshTopology topology(mesh);
  const std::vector<int> axes = carried_axes(mesh, topology, v0, v1);
  // For each axis, the lower face in right-hand order about it, and then the corners above.
  constexpr std::array<std::array<int, 8>, 3> kUpright{
      {{0, 3, 7, 4, 1, 2, 6, 5}, {0, 4, 5, 1, 3, 7, 6, 2}, {0, 1, 2, 3, 4, 5, 6, 7}}};
  // One end of the diagonal that cuts each face, or kNoIndex for a face that is not cut.
  std::vector<Index> cut_at(topology.num_faces(), kNoIndex);
  const auto upright = [&](std::size_t c) {
    std::array<Index, 8> corners{};
    for (std::size_t i = 0; i < 8; ++i) corners[i] = mesh.cell(c)[kUpright[axes[c]][i]];
    return corners;
  };
  const auto end_faces = [&](std::size_t c) {
    const auto corners = upright(c);
    std::array<Index, 2> ends{kNoIndex, kNoIndex};
    for (Index f : topology.cell_faces(c)) {
      const auto face = topology.face(f);
      const auto in_face = [&](std::size_t first) {
        return std::all_of(corners.begin() + static_cast<std::ptrdiff_t>(first),
                           corners.begin() + static_cast<std::ptrdiff_t>(first) + 4,
                           [&](Index v) { return std::find(face.begin(), face.end(), v) != face.end(); });
      };
      if (in_face(0)) ends[0] = f;
      if (in_face(4)) ends[1] = f;
    }
    return ends;
  };
  std::vector<char> seen(mesh.num_cells(), 0);
  std::vector<std::size_t> column;
  for (std::size_t seed = 0; seed < mesh.num_cells(); ++seed) {
    if (axes[seed] == kNoIndex)
      throw InputError("split: cell " + std::to_string(seed) + " is not connected with the edge");
    const Index first = end_faces(seed)[0];
    if (cut_at[first] != kNoIndex) continue;
    const auto face = topology.face(first);
    cut_at[first] = *std::min_element(face.begin(), face.end());
    column.assign(1, seed);
    seen[seed] = 1;
    for (std::size_t q = 0; q < column.size(); ++q) {
      const std::size_t c = column[q];
      const auto corners = upright(c);
      const auto ends = end_faces(c);
      for (int side = 0; side < 2; ++side) {  // carries the cut from one end to the other
        if (cut_at[ends[side]] == kNoIndex) continue;
        const auto i = std::find(corners.begin(), corners.end(), cut_at[ends[side]]) - corners.begin();
        if (cut_at[ends[1 - side]] == kNoIndex) cut_at[ends[1 - side]] = corners[static_cast<std::size_t>((i + 4) % 8)];
      }
      for (Index f : ends)
        for (Index other : topology.face_cells(f))
          if (other != kNoIndex && !seen[other]) {
            seen[other] = 1;
            column.push_back(static_cast<std::size_t>(other));
          }
    }
  }
  VolumeMesh result;
  result.positions = mesh.positions;
  result.tags = mesh.tags;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const auto corners = upright(c);
    const auto at = static_cast<std::size_t>(std::find(corners.begin(), corners.begin() + 4, cut_at[end_faces(c)[0]]) -
                                             corners.begin());
    for (std::size_t half = 0; half < 2; ++half) {
      const std::size_t a = at % 4, b = (at + 1 + half) % 4, d = (at + 2 + half) % 4;
      result.add_cell(CellKind::prism, std::array<Index, 6>{corners[a], corners[b], corners[d], corners[a + 4],
                                                            corners[b + 4], corners[d + 4]});
      if (!mesh.references.empty()) result.references.push_back(mesh.references[c]);
    }
  }
  require_valid(result, "split");
  inherit_groups(mesh, result);
  return result;
}

}  // namespace subvol
