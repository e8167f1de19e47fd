// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/templates/vertex_merge.h"

#include "subvol/base/disjoint_sets.h"
#include "subvol/base/error.h"
#include "subvol/base/sort_unique.h"
#include "subvol/base/text_scanner.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/mesh/validate.h"
#include "subvol/templates/template_edit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>
#include <vector>

namespace subvol {

using namespace internal;

namespace {

using Corners = std::vector<Index>;

bool are_distinct(Corners corners) {
  std::sort(corners.begin(), corners.end());
  return std::adjacent_find(corners.begin(), corners.end()) == corners.end();
}

/// Corners of a cell after merging.
Corners merged_corners(const VolumeMesh& mesh, std::size_t c, std::span<const Index> target) {
  Corners corners;
  for (Index v : mesh.cell(c)) corners.push_back(target[v]);
  return corners;
}

/// Returns a face without repeated consecutive corners; empty if nothing of it remains.
Corners reduced_face(const CellTopology& local, int f, std::span<const Index> corners) {
  Corners face;
  for (int i = 0; i < local.face_sizes[f]; ++i) {
    const Index v = corners[local.faces[f][i]];
    if (face.empty() || face.back() != v) face.push_back(v);
  }
  while (face.size() > 1 && face.front() == face.back()) face.pop_back();
  return face.size() < 3 || !are_distinct(face) ? Corners{} : face;
}

/// True if the remaining faces cover each other in pairs.
bool is_flat(const CellTopology& local, std::span<const Index> corners) {
  std::map<Corners, int> count;
  for (int f = 0; f < local.num_faces; ++f) {
    Corners face = reduced_face(local, f, corners);
    if (face.empty()) continue;
    std::sort(face.begin(), face.end());
    ++count[face];
  }
  return std::all_of(count.begin(), count.end(), [](const auto& entry) { return entry.second == 2; });
}

/// Returns the prism that a hex has become if two parallel edges of one face collapsed; empty if it has become none.
std::optional<std::array<Index, 6>> prism_of(const CellTopology& hex, std::span<const Index> corners) {
  std::vector<int> triangles;  // local faces
  for (int f = 0; f < hex.num_faces; ++f)
    if (reduced_face(hex, f, corners).size() == 3) triangles.push_back(f);
  Corners distinct(corners.begin(), corners.end());
  sort_unique(distinct);
  if (distinct.size() != 6 || triangles.size() != 2) return std::nullopt;
  std::array<Index, 6> prism{};
  std::size_t n = 0;
  // Seen from inside the cell, the bottom runs against its outward order.
  for (int i = 3; i >= 0; --i) {
    const int bottom = hex.faces[triangles[0]][i];
    if (std::find(prism.begin(), prism.begin() + static_cast<std::ptrdiff_t>(n), corners[bottom]) !=
        prism.begin() + static_cast<std::ptrdiff_t>(n))
      continue;
    int top = -1;
    for (int e = 0; e < hex.num_edges; ++e)
      for (int side = 0; side < 2; ++side) {
        const int from = hex.edges[e][side], to = hex.edges[e][1 - side];
        const auto& other = hex.faces[triangles[1]];
        if (from == bottom && std::find(other.begin(), other.end(), to) != other.end()) top = to;
      }
    if (top < 0 || n == 3) return std::nullopt;
    prism[n] = corners[bottom];
    prism[n + 3] = corners[top];
    ++n;
  }
  return prism;
}

/// A quad two of whose corners become one keeps its group as a triangle.
VolumeFaceGroups merged_groups(const VolumeFaceGroups& groups, std::span<const Index> target) {
  VolumeFaceGroups merged{groups.groups, {}};
  for (const GroupedFace& entry : groups.faces) {
    Corners corners;
    for (const Index v : entry.face)
      if (v != kNoIndex) corners.push_back(target[v]);
    sort_unique(corners);
    if (corners.size() >= 3) merged.faces.push_back({face_key(corners), entry.group});
  }
  normalize(merged);
  return merged;
}

/// Adds the regions of b to those of the joined mesh. Returns the new numbers of those that had to get one.
std::map<int, int> append_regions(VolumeMesh& result, const VolumeMesh& b) {
  std::vector<Group> taken = result.regions;
  for (const int reference : result.references) taken.push_back({"", reference, 3});
  for (const int reference : b.references) taken.push_back({"", reference, 3});
  for (const Group& region : b.regions) taken.push_back(region);
  std::map<int, int> renumbered;
  for (Group region : b.regions) {
    const auto has_number = [&](const Group& other) { return other.number == region.number; };
    const auto same = std::ranges::find_if(result.regions, has_number);
    if (same != result.regions.end() && same->name == region.name) continue;
    if (same != result.regions.end()) {
      const int number = free_number(taken);
      renumbered[std::exchange(region.number, number)] = number;
      taken.push_back(region);
    }
    result.regions.push_back(std::move(region));
  }
  return renumbered;
}

}  // namespace

VolumeMesh merge_vertices(const VolumeMesh& mesh, std::span<const Index> target, const std::string& name) {
  VolumeMesh merged;
  merged.positions = mesh.positions;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const Corners corners = merged_corners(mesh, c, target);
    const CellTopology& local = cell_topology(mesh.kinds[c]);
    if (are_distinct(corners)) {
      merged.add_cell(mesh.kinds[c], corners);
    } else if (is_flat(local, corners)) {
      continue;
    } else if (const auto prism = mesh.kinds[c] == CellKind::hex ? prism_of(local, corners) : std::nullopt) {
      merged.add_cell(CellKind::prism, *prism);
    } else {
      throw InputError(name + ": cell " + std::to_string(c) + " would become neither flat nor a tet, prism or hex");
    }
    if (!mesh.references.empty()) merged.references.push_back(mesh.references[c]);
  }
  if (merged.num_cells() == 0) throw InputError(name + ": no cell would be left");
  merged.tags = mesh.tags;
  for (CreaseEdge& crease : merged.tags.creases) crease.v0 = target[crease.v0], crease.v1 = target[crease.v1];
  for (CornerVertex& corner : merged.tags.corners) corner.vertex = target[corner.vertex];
  normalize_tags(merged.tags);
  const std::vector<char> all(merged.num_cells(), 1);
  FeatureTags tags = std::move(merged.tags);  // checked only after the cells have proved valid
  merged.tags = {};
  require_valid(merged, name);
  merged.tags = std::move(tags);
  merged.regions = mesh.regions;
  merged.face_groups = merged_groups(mesh.face_groups, target);
  return kept_cells(merged, all);
}

VolumeMesh joined(const VolumeMesh& a, const VolumeMesh& b) {
  VolumeMesh result = a;
  const auto first = static_cast<Index>(a.num_vertices());
  result.positions.insert(result.positions.end(), b.positions.begin(), b.positions.end());
  Corners corners;
  for (std::size_t c = 0; c < b.num_cells(); ++c) {
    corners.clear();
    for (Index v : b.cell(c)) corners.push_back(first + v);
    result.add_cell(b.kinds[c], corners);
  }
  const std::map<int, int> renumbered = append_regions(result, b);
  if (!a.references.empty() || !b.references.empty()) {
    result.references.clear();
    for (std::size_t c = 0; c < a.num_cells(); ++c) result.references.push_back(reference_of(a, c));
    for (std::size_t c = 0; c < b.num_cells(); ++c) {
      const auto at = renumbered.find(reference_of(b, c));
      result.references.push_back(at == renumbered.end() ? reference_of(b, c) : at->second);
    }
  }
  for (const CreaseEdge& c : b.tags.creases) result.tags.creases.push_back({first + c.v0, first + c.v1, c.sharpness});
  for (const CornerVertex& c : b.tags.corners) result.tags.corners.push_back({first + c.vertex, c.sharpness});
  append_groups(result.face_groups, b.face_groups, first);
  return result;
}

VolumeMesh glue(const VolumeMesh& mesh, double distance) {
  if (!(distance >= 0) || !std::isfinite(distance)) throw InputError("merge: the distance must be finite and >= 0");
  const MeshTopology topology(mesh);
  // Sweeps along a direction in which few vertices of a grid have the same height.
  const Vec3 along = Vec3(1, std::sqrt(2.0), std::sqrt(3.0)).normalized();
  std::vector<std::pair<double, Index>> order;  // height, vertex
  double largest = 0;
  for (std::size_t v = 0; v < mesh.num_vertices(); ++v) {
    if (!topology.is_boundary_vertex(static_cast<Index>(v))) continue;
    order.push_back({along.dot(mesh.positions[v]), static_cast<Index>(v)});
    largest = std::max(largest, mesh.positions[v].norm());
  }
  std::stable_sort(order.begin(), order.end());
  const double reach = distance + 4e-15 * largest;  // tolerance for the rounding of heights
  DisjointSets merged(mesh.num_vertices());
  for (std::size_t i = 0; i < order.size(); ++i)
    for (std::size_t j = i + 1; j < order.size() && order[j].first - order[i].first <= reach; ++j) {
      const Index v = order[i].second, w = order[j].second;
      if ((mesh.positions[w] - mesh.positions[v]).norm() <= distance) merged.join(v, w);
    }
  std::vector<Index> target(mesh.num_vertices());
  for (std::size_t v = 0; v < target.size(); ++v) target[v] = merged.of(static_cast<Index>(v));
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    if (!are_distinct(merged_corners(mesh, c, target))) {
      std::string message = "merge: two corners of cell " + std::to_string(c) + " would become one at the distance ";
      append_number(message, distance);
      throw InputError(message + ", which must be well below the shortest edge");
    }
  return merge_vertices(mesh, target, "merge");
}

}  // namespace subvol
