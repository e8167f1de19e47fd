// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/surface/space_cells.h"

#include "subvol/base/disjoint_sets.h"
#include "subvol/surface/triangle_geometry.h"
#include "subvol/surface/welded_surface.h"
#include "subvol/surface/winding_number.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

namespace subvol::internal {

namespace {

/// The triangles at an edge in the order of their angles around it, and for each whether its front faces the next.
struct EdgeFan {
  std::vector<Index> triangles;
  std::vector<char> faces_next;
};

EdgeFan sorted_around(const TriangleMesh& mesh, std::span<const SurfaceHalfEdge> sides) {
  EdgeFan fan;
  for (const auto& [angle, i] : sorted_around_edge(mesh, sides)) {
    fan.triangles.push_back(sides[i].triangle);
    fan.faces_next.push_back(sides[i].forward);  // its normal is on the side of larger angles
  }
  return fan;
}

/// Joins the sides of triangles that bound one cell, and the triangles of one part.
class SpaceCellFinder {
 public:
  explicit SpaceCellFinder(const TriangleMesh& mesh)
      : mesh_(mesh), cells_(2 * mesh.triangles.size()), parts_(mesh.triangles.size()) {}

  /// Returns false if an edge has only one triangle, or if triangles lie on each other there.
  bool join_around_edges() {
    const std::vector<SurfaceHalfEdge> sides = sorted_half_edges(mesh_.triangles, mesh_.positions.size());
    bool closed = true;
    for_each_edge(sides, [&](std::span<const SurfaceHalfEdge> edge) {
      if (edge.size() < 2 || !contacts_at_edge(mesh_, edge).empty()) closed = false;
      if (edge.size() > 2) curve_triangles_.push_back(edge[0].triangle);
      if (!closed) return;
      const EdgeFan fan = sorted_around(mesh_, edge);
      for (std::size_t i = 0; i < fan.triangles.size(); ++i) {
        const std::size_t next = (i + 1) % fan.triangles.size();
        cells_.join(2 * fan.triangles[i] + (fan.faces_next[i] ? 1 : 0),
                    2 * fan.triangles[next] + (fan.faces_next[next] ? 0 : 1));
        parts_.join(fan.triangles[i], fan.triangles[next]);
      }
    });
    return closed;
  }

  /// Returns the cells of the joined sides, and the parts of the joined triangles.
  SpaceCells list() {
    SpaceCells result;
    const std::size_t n = mesh_.triangles.size();
    std::vector<std::size_t> part_of(n), cell_of(2 * n);
    for (std::size_t t = 0; t < n; ++t) {
      const auto root = static_cast<std::size_t>(parts_.of(static_cast<Index>(t)));
      if (root == t) {
        part_of[t] = result.parts.size();
        result.parts.emplace_back();
      }
      PartWithCells& part = result.parts[part_of[t] = part_of[root]];
      part.triangles.push_back(static_cast<Index>(t));
      for (const Index v : mesh_.triangles[t]) part.box.extend(mesh_.positions[v]);
      const Vec3& origin = mesh_.positions[mesh_.triangles[static_cast<std::size_t>(part.triangles[0])][0]];
      const double below = sixfold_volume(mesh_.positions, mesh_.triangles[t], origin) / 6;
      part.own_volume += below;
      const double area = triangle_area(mesh_, mesh_.triangles[t]);
      for (const std::size_t side : {2 * t, 2 * t + 1}) {
        const auto first = static_cast<std::size_t>(cells_.of(static_cast<Index>(side)));
        if (first == side) {
          cell_of[side] = result.cells.size();
          part.cells.push_back(result.cells.size());
          result.cells.push_back({.part = part_of[t]});
        }
        SpaceCell& cell = result.cells[cell_of[first]];
        cell.area += area;
        cell.volume += side == 2 * t ? below : -below;  // what is behind a triangle has it as its outer side
        cell.sides.push_back(static_cast<Index>(side));
      }
    }
    for (const Index t : curve_triangles_) result.parts[part_of[t]].has_curves = true;
    for (PartWithCells& part : result.parts)
      part.outer = *std::min_element(part.cells.begin(), part.cells.end(), [&](std::size_t a, std::size_t b) {
        return result.cells[a].volume < result.cells[b].volume;
      });
    return result;
  }

 private:
  const TriangleMesh& mesh_;
  DisjointSets cells_, parts_;
  std::vector<Index> curve_triangles_;
};

/// Returns the triangles around a cell, turned outward.
TriangleMesh boundary_of_cell(const TriangleMesh& mesh, const SpaceCell& cell) {
  TriangleMesh boundary{mesh.positions, {}};
  for (const Index side : cell.sides) {
    std::array<Index, 3> t = mesh.triangles[static_cast<std::size_t>(side / 2)];
    if (side % 2 != 0) std::swap(t[1], t[2]);
    boundary.triangles.push_back(t);
  }
  return boundary;
}

/// Finds the cell that each part lies in: the smallest that contains all of some of its points.
void place_parts(const TriangleMesh& mesh, SpaceCells& space) {
  constexpr std::size_t kMostContainmentPoints = 16;  // of a part, to bound the time
  for (std::size_t around = 0; around < space.parts.size(); ++around) {
    std::vector<std::size_t> candidates;
    for (std::size_t k = 0; k < space.parts.size(); ++k)
      if (k != around && space.parts[around].box.contains(space.parts[k].box)) candidates.push_back(k);
    if (candidates.empty()) continue;
    for (const std::size_t c : space.parts[around].cells) {
      const SpaceCell& cell = space.cells[c];
      if (c == space.parts[around].outer || !cell.has_volume()) continue;
      const WindingNumber winding(boundary_of_cell(mesh, cell));
      for (const std::size_t k : candidates) {
        PartWithCells& part = space.parts[k];
        if (part.inside && space.cells[*part.inside].volume <= cell.volume) continue;
        bool contained = true;
        const std::size_t step = std::max<std::size_t>(1, part.triangles.size() / kMostContainmentPoints);
        for (std::size_t i = 0; i < part.triangles.size() && contained; i += step) {
          const auto& [a, b, d] = mesh.triangles[part.triangles[i]];
          contained = winding.at((mesh.positions[a] + mesh.positions[b] + mesh.positions[d]) / 3) > 0.5;
        }
        if (contained) part.inside = c;
      }
    }
  }
}

}  // namespace

bool SpaceCell::has_volume() const { return volume > kRoundingVolumeShare * area * std::sqrt(area); }

double SpaceCells::facing(std::size_t part) const {
  const double whole = -cells[parts[part].outer].volume;
  return whole > 0 ? parts[part].own_volume / whole : 1;
}

std::optional<SpaceCells> find_space_cells(const TriangleMesh& mesh) {
  SpaceCellFinder finder(mesh);
  if (!finder.join_around_edges()) return std::nullopt;
  SpaceCells space = finder.list();
  place_parts(mesh, space);
  return space;
}

}  // namespace subvol::internal
