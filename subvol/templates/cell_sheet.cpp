// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/templates/cell_sheet.h"

#include "subvol/base/error.h"
#include "subvol/mesh/inherited_groups.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/mesh/validate.h"
#include "subvol/templates/template_edit.h"
#include "subvol/templates/vertex_merge.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <string>

namespace subvol {

using namespace internal;

namespace {

using Edge = std::array<Index, 2>;

std::string name_of(Index v0, Index v1) { return std::to_string(v0) + "-" + std::to_string(v1); }

Index edge_between(const MeshTopology& topology, Index v0, Index v1) {
  const auto count = static_cast<Index>(topology.num_vertices());
  const bool there = v0 >= 0 && v1 >= 0 && v0 < count && v1 < count && v0 != v1;
  const Index e = there ? topology.find_edge(v0, v1) : kNoIndex;
  if (e == kNoIndex) throw InputError("sheet: there is no edge " + name_of(v0, v1));
  return e;
}

/// For each edge, the quads that contain it.
std::vector<std::vector<Index>> quads_of_edges(const MeshTopology& topology) {
  std::vector<std::vector<Index>> quads(topology.num_edges());
  for (std::size_t f = 0; f < topology.num_faces(); ++f) {
    const auto face = topology.face(static_cast<Index>(f));
    for (std::size_t i = 0; face.size() == 4 && i < 4; ++i)
      quads[topology.find_edge(face[i], face[(i + 1) % 4])].push_back(static_cast<Index>(f));
  }
  return quads;
}

/// The edge opposite to (a, b) in a quad, in the same direction.
Edge across(std::span<const Index> quad, Index a, Index b) {
  for (std::size_t i = 0; i < 4; ++i) {
    if (quad[i] == a && quad[(i + 1) % 4] == b) return {quad[(i + 3) % 4], quad[(i + 2) % 4]};
    if (quad[i] == b && quad[(i + 1) % 4] == a) return {quad[(i + 2) % 4], quad[(i + 3) % 4]};
  }
  return {kNoIndex, kNoIndex};
}

/// Tells which vertices stay where they are if others are merged into them.
class Holds {
 public:
  Holds(const VolumeMesh& mesh, const MeshTopology& topology)
      : topology_(topology), interfaces_(mark_interfaces(topology, find_interfaces(mesh, topology))) {}
  /// Returns the number of sheets that hold a vertex: the boundary, and interfaces between regions.
  int count(Index v) const { return int{topology_.is_boundary_vertex(v)} + int{interfaces_.has_vertex(v)}; }

 private:
  const MeshTopology& topology_;
  InterfaceMarks interfaces_;
};

/// Position of the vertex that two merged ones become: that of the one that more sheets hold, or else `otherwise`.
Vec3 merged_place(const VolumeMesh& mesh, const Holds& holds, Index a, Index b, const Vec3& otherwise) {
  const int of_a = holds.count(a), of_b = holds.count(b);
  return of_a == of_b ? otherwise : mesh.positions[of_a > of_b ? a : b];
}

/// Throws InputError if a region of a mesh is not in a result. name: of the operation.
void require_regions_of(const VolumeMesh& mesh, const VolumeMesh& result, const std::string& name) {
  const std::vector<int> left = region_references(result);
  for (const int reference : region_references(mesh))
    if (!std::ranges::binary_search(left, reference))
      throw InputError(name + ": no cell of " + region_label(mesh, reference) + " would be left");
}

/// Merges pairs of vertices, each pair into its first vertex.
VolumeMesh merge_pairs(const VolumeMesh& mesh, const MeshTopology& topology, std::span<const Edge> pairs, bool half_way,
                       const std::string& name) {
  VolumeMesh moved = mesh;
  std::vector<Index> target(mesh.num_vertices());
  std::iota(target.begin(), target.end(), 0);
  const auto root = [&](Index v) {
    while (target[v] != v) v = target[v];
    return v;
  };
  const Holds holds(mesh, topology);
  for (const Edge& pair : pairs) {
    const Vec3 otherwise =
        half_way ? Vec3((mesh.positions[pair[0]] + mesh.positions[pair[1]]) / 2) : mesh.positions[pair[0]];
    const Index a = root(pair[0]), b = root(pair[1]);
    if (a == b) continue;
    target[b] = a;
    moved.positions[a] = merged_place(mesh, holds, pair[0], pair[1], otherwise);
  }
  for (std::size_t v = 0; v < target.size(); ++v) target[v] = root(static_cast<Index>(v));
  VolumeMesh result = merge_vertices(moved, target, name);
  require_regions_of(mesh, result, name);
  return result;
}

/// One corner of a cell that a sheet cuts: the lower end of the sheet's edge at that corner, and true if the corner is
/// the upper end.
struct CutCorner {
  Index lower;
  bool upper;
};
std::vector<CutCorner> cut_corners(const VolumeMesh& mesh, std::size_t c, const std::map<Index, Index>& above) {
  const auto cell = mesh.cell(c);
  const auto holds = [&](Index v) { return std::find(cell.begin(), cell.end(), v) != cell.end(); };
  std::vector<CutCorner> corners;
  for (Index v : cell) {
    const auto up = above.find(v);
    if (up != above.end() && holds(up->second)) corners.push_back({v, false});
    for (Index below : cell) {
      const auto edge = above.find(below);
      if (edge != above.end() && edge->second == v) corners.push_back({below, true});
    }
  }
  // Each corner must be found once: if the sheet crosses itself, some are found twice; if it runs into a triangle, some
  // are missing.
  bool sound = corners.size() == cell.size();
  for (std::size_t i = 0; sound && i < cell.size(); ++i)
    sound = (corners[i].upper ? above.at(corners[i].lower) : corners[i].lower) == cell[i];
  if (!sound) throw InputError("sheet: it crosses itself, or runs into a triangle, in cell " + std::to_string(c));
  return corners;
}

}  // namespace

std::vector<Edge> sheet_edges(const MeshTopology& topology, Index v0, Index v1) {
  const auto quads = quads_of_edges(topology);
  std::vector<Edge> directed(topology.num_edges(), Edge{kNoIndex, kNoIndex});
  std::vector<Edge> sheet{{v0, v1}};
  directed[edge_between(topology, v0, v1)] = {v0, v1};
  for (std::size_t i = 0; i < sheet.size(); ++i) {
    const Edge edge = sheet[i];
    for (Index f : quads[topology.find_edge(edge[0], edge[1])]) {
      const Edge opposite = across(topology.face(f), edge[0], edge[1]);
      Edge& known = directed[topology.find_edge(opposite[0], opposite[1])];
      if (known[0] == kNoIndex) {
        known = opposite;
        sheet.push_back(opposite);
      } else if (known != opposite) {
        throw InputError("sheet: it comes back to edge " + name_of(opposite[0], opposite[1]) + " the other way round");
      }
    }
  }
  return sheet;
}

VolumeMesh split_sheet(const VolumeMesh& mesh, Index v0, Index v1, int parts) {
  if (parts < 2) throw InputError("split: a sheet must be cut into at least 2 parts, got " + std::to_string(parts));
  require_valid(mesh, "split");
  const MeshTopology topology(mesh);
  const std::vector<Edge> sheet = sheet_edges(topology, v0, v1);
  std::map<Index, Index> above;    // upper end of the sheet's edge that starts at each lower end
  std::map<Index, Index> between;  // first new vertex of that edge
  VolumeMesh result;
  result.positions = mesh.positions;
  for (const Edge& edge : sheet) {
    if (!above.emplace(edge[0], edge[1]).second)
      throw InputError("sheet: it crosses itself at vertex " + std::to_string(edge[0]));
    between[edge[0]] = static_cast<Index>(result.positions.size());
    for (int k = 1; k < parts; ++k)
      result.positions.push_back(mesh.positions[edge[0]] +
                                 double(k) / parts * (mesh.positions[edge[1]] - mesh.positions[edge[0]]));
  }
  const auto vertex_at = [&](Index lower, int k) {
    return k == 0 ? lower : k == parts ? above.at(lower) : between.at(lower) + k - 1;
  };
  std::vector<char> cut_edge(topology.num_edges(), 0);
  for (const Edge& edge : sheet) cut_edge[topology.find_edge(edge[0], edge[1])] = 1;
  std::vector<Index> corners;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const auto edges = topology.cell_edges(c);
    const bool cut = std::any_of(edges.begin(), edges.end(), [&](Index e) { return cut_edge[e] != 0; });
    const std::vector<CutCorner> column = cut ? cut_corners(mesh, c, above) : std::vector<CutCorner>{};
    for (int k = 0; k < (cut ? parts : 1); ++k) {
      corners.assign(mesh.cell(c).begin(), mesh.cell(c).end());
      for (std::size_t i = 0; i < column.size(); ++i)
        corners[i] = vertex_at(column[i].lower, column[i].upper ? k + 1 : k);
      result.add_cell(mesh.kinds[c], corners);
      if (!mesh.references.empty()) result.references.push_back(mesh.references[c]);
    }
  }
  result.tags.corners = mesh.tags.corners;
  for (const CreaseEdge& crease : mesh.tags.creases) {
    if (!cut_edge[topology.find_edge(crease.v0, crease.v1)]) {
      result.tags.creases.push_back(crease);
      continue;
    }
    const auto up = above.find(crease.v0);
    const Index lower = up != above.end() && up->second == crease.v1 ? crease.v0 : crease.v1;
    for (int k = 0; k < parts; ++k)
      result.tags.creases.push_back({vertex_at(lower, k), vertex_at(lower, k + 1), crease.sharpness});
  }
  normalize_tags(result.tags);
  require_valid(result, "split");
  result.regions = mesh.regions;
  if (!mesh.face_groups.empty()) {
    std::vector<VertexSupport> support;
    for (std::size_t v = 0; v < mesh.num_vertices(); ++v) support.push_back(kept_vertex(static_cast<Index>(v)));
    for (const Edge& edge : sheet) support.insert(support.end(), static_cast<std::size_t>(parts - 1), support_of(edge));
    result.face_groups = inherited_groups(mesh.face_groups, MeshTopology(result), support);
  }
  return result;
}

VolumeMesh collapse_sheet(const VolumeMesh& mesh, Index v0, Index v1) {
  require_valid(mesh, "collapse");
  const MeshTopology topology(mesh);
  return merge_pairs(mesh, topology, sheet_edges(topology, v0, v1), false, "collapse");
}

VolumeMesh collapse_edge(const VolumeMesh& mesh, Index v0, Index v1) {
  require_valid(mesh, "collapse");
  const MeshTopology topology(mesh);
  edge_between(topology, v0, v1);
  const std::array<Edge, 1> pair{{{v0, v1}}};
  return merge_pairs(mesh, topology, pair, true, "collapse");
}

VolumeMesh collapse_face(const VolumeMesh& mesh, Index v0, Index v2) {
  require_valid(mesh, "collapse");
  const MeshTopology topology(mesh);
  std::vector<Edge> pairs;  // corners to join in each quad of the column, in the order of `faces`
  std::vector<Index> faces;
  std::vector<char> seen(topology.num_faces(), 0);
  const auto add = [&](Index f, const Edge& pair) {
    if (seen[f]) return;
    seen[f] = 1;
    faces.push_back(f);
    pairs.push_back(pair);
  };
  for (std::size_t f = 0; f < topology.num_faces(); ++f) {
    const auto face = topology.face(static_cast<Index>(f));
    for (std::size_t i = 0; face.size() == 4 && i < 4; ++i)
      if (face[i] == v0 && face[(i + 2) % 4] == v2) add(static_cast<Index>(f), {v0, v2});
  }
  if (faces.size() != 1)
    throw InputError("collapse: there is no single quad with opposite corners " + std::to_string(v0) + " and " +
                     std::to_string(v2));
  for (std::size_t i = 0; i < faces.size(); ++i)
    for (Index c : topology.face_cells(faces[i])) {
      if (c == kNoIndex) continue;
      if (mesh.kinds[c] != CellKind::hex)
        throw InputError("collapse: the column meets cell " + std::to_string(c) + ", which is no hex");
      // The corners across the cell are the other ends of the edges that leave the face.
      const auto face = topology.face(faces[i]);
      const auto partner = [&](Index v) {
        const CellTopology& local = cell_topology(CellKind::hex);
        for (int e = 0; e < local.num_edges; ++e)
          for (int side = 0; side < 2; ++side) {
            const Index a = mesh.cell(c)[local.edges[e][side]], b = mesh.cell(c)[local.edges[e][1 - side]];
            if (a == v && std::find(face.begin(), face.end(), b) == face.end()) return b;
          }
        return kNoIndex;
      };
      const Edge next{partner(pairs[i][0]), partner(pairs[i][1])};
      for (Index f : topology.cell_faces(c)) {
        const auto other = topology.face(f);
        const bool holds = std::find(other.begin(), other.end(), next[0]) != other.end() &&
                           std::find(other.begin(), other.end(), next[1]) != other.end();
        if (f != faces[i] && holds) add(f, next);
      }
    }
  return merge_pairs(mesh, topology, pairs, true, "collapse");
}

}  // namespace subvol
