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

/// Cuts of the columns of hexes that follow an edge: where the faces at the ends of each hex are cut into triangles.
class ColumnCuts {
 public:
  ColumnCuts(const VolumeMesh& mesh, const MeshTopology& topology, Index v0, Index v1)
      : mesh_(mesh),
        topology_(topology),
        axes_(carried_axes(mesh, topology, v0, v1)),
        cut_at_(topology.num_faces(), kNoIndex),
        seen_(mesh.num_cells(), 0) {
    for (std::size_t seed = 0; seed < mesh.num_cells(); ++seed) {
      if (axes_[seed] == kNoIndex)
        throw InputError("split: cell " + std::to_string(seed) + " is not connected with the edge");
      if (cut_at_[end_faces(seed)[0]] == kNoIndex) cut_column(seed);
    }
  }

  /// Returns the lower face of a hex in right-hand order about its axis, and then the corners above.
  std::array<Index, 8> upright(std::size_t c) const {
    constexpr std::array<std::array<int, 8>, 3> kUpright{
        {{0, 3, 7, 4, 1, 2, 6, 5}, {0, 4, 5, 1, 3, 7, 6, 2}, {0, 1, 2, 3, 4, 5, 6, 7}}};
    std::array<Index, 8> corners{};
    for (std::size_t i = 0; i < 8; ++i) corners[i] = mesh_.cell(c)[kUpright[axes_[c]][i]];
    return corners;
  }
  /// Returns the place among the first four of these corners of an end of the diagonal that cuts the lower face.
  std::size_t cut_corner(std::size_t c) const {
    const auto corners = upright(c);
    return static_cast<std::size_t>(std::find(corners.begin(), corners.begin() + 4, cut_at_[end_faces(c)[0]]) -
                                    corners.begin());
  }

 private:
  /// Returns the lower and the upper face of a hex.
  std::array<Index, 2> end_faces(std::size_t c) const {
    const auto corners = upright(c);
    std::array<Index, 2> ends{kNoIndex, kNoIndex};
    for (Index f : topology_.cell_faces(c)) {
      const auto face = topology_.face(f);
      const auto in_face = [&](std::size_t first) {
        return std::all_of(corners.begin() + static_cast<std::ptrdiff_t>(first),
                           corners.begin() + static_cast<std::ptrdiff_t>(first) + 4,
                           [&](Index v) { return std::find(face.begin(), face.end(), v) != face.end(); });
      };
      if (in_face(0)) ends[0] = f;
      if (in_face(4)) ends[1] = f;
    }
    return ends;
  }
  /// Cuts the lower face of a hex, and the other faces of its column alike.
  void cut_column(std::size_t seed) {
    const Index first = end_faces(seed)[0];
    const auto face = topology_.face(first);
    cut_at_[first] = *std::min_element(face.begin(), face.end());
    std::vector<std::size_t> column{seed};
    seen_[seed] = 1;
    for (std::size_t q = 0; q < column.size(); ++q) {
      const auto ends = end_faces(column[q]);
      carry_cut(upright(column[q]), ends);
      for (Index f : ends)
        for (Index other : topology_.face_cells(f))
          if (other != kNoIndex && !seen_[other]) {
            seen_[other] = 1;
            column.push_back(static_cast<std::size_t>(other));
          }
    }
  }
  /// Carries the cut from one end of a hex to the other.
  void carry_cut(const std::array<Index, 8>& corners, const std::array<Index, 2>& ends) {
    for (int side = 0; side < 2; ++side) {
      if (cut_at_[ends[side]] == kNoIndex) continue;
      const auto i = std::find(corners.begin(), corners.end(), cut_at_[ends[side]]) - corners.begin();
      Index& other = cut_at_[ends[1 - side]];
      if (other == kNoIndex) other = corners[static_cast<std::size_t>((i + 4) % 8)];
    }
  }

  const VolumeMesh& mesh_;
  const MeshTopology& topology_;
  std::vector<int> axes_;      // of each hex: see carried_axes
  std::vector<Index> cut_at_;  // one end of the diagonal that cuts each face; kNoIndex: it is not cut
  std::vector<char> seen_;     // not zero for the hexes of columns that were cut
};

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
  const ColumnCuts cuts(mesh, topology, v0, v1);
  VolumeMesh result;
  result.positions = mesh.positions;
  result.tags = mesh.tags;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const auto corners = cuts.upright(c);
    const std::size_t at = cuts.cut_corner(c);
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
