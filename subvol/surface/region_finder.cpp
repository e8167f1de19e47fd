// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/disjoint_sets.h"
#include "subvol/base/format.h"
#include "subvol/surface/named_solids.h"
#include "subvol/surface/region_surface.h"
#include "subvol/surface/triangle_geometry.h"
#include "subvol/surface/welded_surface.h"
#include "subvol/surface/winding_number.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <string>
#include <utility>

namespace subvol {

using namespace internal;

namespace {

/// The named solids behind each triangle and in front of it, as places in the list of groups, or kNoIndex.
using SolidSides = std::vector<std::array<Index, 2>>;

/// Returns the named solids on the sides of triangles without copies; nothing if there are no named solids, or if two
/// of them are on the same side of a triangle.
/// mesh  welded, with copies.  kept, kept_as: its triangles without them, and what has become of each.
std::optional<SolidSides> solids_at_sides(const TriangleMesh& mesh, std::span<const std::array<Index, 3>> kept,
                                          std::span<const Index> kept_as) {
  const std::vector<double> volumes = volumes_of_named_solids(mesh);
  if (volumes.empty()) return std::nullopt;
  const auto turned_to_least = [](std::array<Index, 3> t) {
    std::rotate(t.begin(), std::ranges::min_element(t), t.end());
    return t;
  };
  SolidSides solids(kept.size(), {kNoIndex, kNoIndex});
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Index group = mesh.face_groups.of_face[t];
    const bool is_turned = turned_to_least(mesh.triangles[t]) != turned_to_least(kept[kept_as[t]]);
    Index& solid = solids[kept_as[t]][is_turned != (volumes[group] < 0) ? 1 : 0];
    if (solid != kNoIndex && solid != group) return std::nullopt;
    solid = group;
  }
  return solids;
}

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

/// Finds the components of space and decides which are regions. A triangle t has two sides: 2t is behind it, 2t + 1 in
/// front.
class RegionFinder {
 public:
  RegionFinder(TriangleMesh mesh, std::vector<char> has_copy, std::optional<SolidSides> solids, RegionRule rule)
      : mesh_(std::move(mesh)),
        has_copy_(std::move(has_copy)),
        solids_(std::move(solids)),
        rule_(rule),
        cells_(2 * mesh_.triangles.size()),
        parts_(mesh_.triangles.size()) {}

  std::optional<RegionSurface> run() {
    if (mesh_.triangles.empty() || !join_around_edges()) return std::nullopt;
    list_cells();
    if (parts_with_cells_.size() == 1 && is_manifold(0)) return std::nullopt;
    place_parts();
    number_regions();
    take_solids();
    return result();
  }

 private:
  /// A component of space as far as one part of the surface tells.
  struct Cell {
    Index side;  ///< the least of its sides
    std::size_t part = 0;
    double volume = 0;  ///< signed: negative for the one around the part
    double area = 0;
    /// Returns true if the cell encloses more than rounding.
    bool has_volume() const {
      constexpr double kRoundingVolumeShare = 1e-9;  // of area^(3/2)
      return volume > kRoundingVolumeShare * area * std::sqrt(area);
    }
    std::vector<Index> sides;
  };
  struct Part {
    std::vector<std::size_t> cells;  ///< places in cells_of_parts_
    std::size_t outer = 0;           ///< of these, the one around the part
    std::vector<Index> triangles;
    bool has_curves = false;            ///< edges of more than two triangles
    double own_volume = 0;              ///< sum over its triangles as they are oriented
    std::optional<std::size_t> inside;  ///< the cell of another part that it lies in
    Eigen::AlignedBox3d box;
  };

  bool is_manifold(std::size_t part) const { return !parts_with_cells_[part].has_curves; }

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

  void list_cells() {
    const std::size_t n = mesh_.triangles.size();
    std::vector<std::size_t> part_of(n), cell_of(2 * n);
    for (std::size_t t = 0; t < n; ++t) {
      const auto root = static_cast<std::size_t>(parts_.of(static_cast<Index>(t)));
      if (root == t) {
        part_of[t] = parts_with_cells_.size();
        parts_with_cells_.emplace_back();
      }
      Part& part = parts_with_cells_[part_of[t] = part_of[root]];
      part.triangles.push_back(static_cast<Index>(t));
      for (const Index v : mesh_.triangles[t]) part.box.extend(mesh_.positions[v]);
      const Vec3& origin = mesh_.positions[mesh_.triangles[static_cast<std::size_t>(part.triangles[0])][0]];
      const double below = sixfold_volume(mesh_.positions, mesh_.triangles[t], origin) / 6;
      part.own_volume += below;
      const double area = triangle_area(mesh_, mesh_.triangles[t]);
      for (const std::size_t side : {2 * t, 2 * t + 1}) {
        const auto first = static_cast<std::size_t>(cells_.of(static_cast<Index>(side)));
        if (first == side) {
          cell_of[side] = cells_of_parts_.size();
          part.cells.push_back(cells_of_parts_.size());
          cells_of_parts_.push_back({static_cast<Index>(side), part_of[t], 0, 0, {}});
        }
        Cell& cell = cells_of_parts_[cell_of[first]];
        cell.area += area;
        cell.volume += side == 2 * t ? below : -below;  // what is behind a triangle has it as its outer side
        cell.sides.push_back(static_cast<Index>(side));
      }
    }
    for (const Index t : curve_triangles_) parts_with_cells_[part_of[t]].has_curves = true;
    for (Part& part : parts_with_cells_)
      part.outer = *std::min_element(part.cells.begin(), part.cells.end(), [&](std::size_t a, std::size_t b) {
        return cells_of_parts_[a].volume < cells_of_parts_[b].volume;
      });
  }

  /// Returns the triangles around a cell, turned outward.
  TriangleMesh boundary_of(const Cell& cell) const {
    TriangleMesh boundary{mesh_.positions, {}};
    for (const Index side : cell.sides) {
      std::array<Index, 3> t = mesh_.triangles[static_cast<std::size_t>(side / 2)];
      if (side % 2 != 0) std::swap(t[1], t[2]);
      boundary.triangles.push_back(t);
    }
    return boundary;
  }

  /// Finds the cell that each part lies in: the smallest that contains all of some of its points.
  void place_parts() {
    constexpr std::size_t kMostContainmentPoints = 16;  // of a part, to bound the time
    for (std::size_t around = 0; around < parts_with_cells_.size(); ++around) {
      std::vector<std::size_t> candidates;
      for (std::size_t k = 0; k < parts_with_cells_.size(); ++k)
        if (k != around && parts_with_cells_[around].box.contains(parts_with_cells_[k].box)) candidates.push_back(k);
      if (candidates.empty()) continue;
      for (const std::size_t c : parts_with_cells_[around].cells) {
        const Cell& cell = cells_of_parts_[c];
        if (c == parts_with_cells_[around].outer || !cell.has_volume()) continue;
        const WindingNumber winding(boundary_of(cell));
        for (const std::size_t k : candidates) {
          Part& part = parts_with_cells_[k];
          if (part.inside && cells_of_parts_[*part.inside].volume <= cell.volume) continue;
          bool contained = true;
          const std::size_t step = std::max<std::size_t>(1, part.triangles.size() / kMostContainmentPoints);
          for (std::size_t i = 0; i < part.triangles.size() && contained; i += step) {
            const auto& [a, b, d] = mesh_.triangles[part.triangles[i]];
            contained = winding.at((mesh_.positions[a] + mesh_.positions[b] + mesh_.positions[d]) / 3) > 0.5;
          }
          if (contained) part.inside = c;
        }
      }
    }
  }

  /// Returns how a part faces: 1 if all of it faces outward, -1 inward.
  double facing(const Part& part) const {
    const double whole = -cells_of_parts_[part.outer].volume;
    return whole > 0 ? part.own_volume / whole : 1;
  }

  /// Returns true if each triangle of a part is there twice, for the solids on either side of it.
  bool has_copies(const Part& part) const {
    return std::ranges::all_of(part.triangles, [&](Index t) { return has_copy_[t] != 0; });
  }

  void number_regions() {
    constexpr double kMostly = 0.5;  // share of a part's area
    // Parts that contain others come first.
    std::vector<std::size_t> order(parts_with_cells_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return cells_of_parts_[parts_with_cells_[a].outer].volume < cells_of_parts_[parts_with_cells_[b].outer].volume;
    });
    std::vector<char> is_region(cells_of_parts_.size(), 0);
    std::vector<std::size_t> joined(cells_of_parts_.size());
    std::iota(joined.begin(), joined.end(), std::size_t{0});
    std::vector<double> root_facing(parts_with_cells_.size(), 1);
    for (const std::size_t p : order) {
      const Part& part = parts_with_cells_[p];
      bool is_void = false;
      if (part.inside) {
        const std::size_t parent = cells_of_parts_[*part.inside].part;
        root_facing[p] = root_facing[parent];
        joined[part.outer] = joined[*part.inside];
        const bool in_region = is_region[joined[*part.inside]] != 0;
        is_void = rule_ == RegionRule::automatic && in_region && is_manifold(p) &&
                  facing(part) * root_facing[p] < -kMostly && !has_copies(part);
        if (in_region && !is_void && is_manifold(p) && rule_ == RegionRule::automatic) ++nested_;
      } else {
        root_facing[p] = is_manifold(p) && facing(part) < -kMostly ? -1 : 1;
      }
      for (const std::size_t c : part.cells)
        if (c != part.outer) is_region[c] = !is_void && cells_of_parts_[c].has_volume();
    }
    region_of_side_.assign(2 * mesh_.triangles.size(), kOutsideRegion);
    std::vector<std::size_t> cell_of(2 * mesh_.triangles.size());
    for (std::size_t c = 0; c < cells_of_parts_.size(); ++c)
      for (const Index side : cells_of_parts_[c].sides) cell_of[side] = joined[c];
    std::vector<int> number(cells_of_parts_.size(), kOutsideRegion);
    for (std::size_t side = 0; side < cell_of.size(); ++side) {
      const std::size_t c = cell_of[side];
      if (!is_region[c]) continue;
      if (number[c] == kOutsideRegion) number[c] = ++num_regions_;
      region_of_side_[side] = number[c];
    }
  }

  /// Makes one region of all that lies in one named solid, and none of what lies in no solid, unless everything that is
  /// enclosed is to be a region. Does nothing if regions are other than the solids, or if no two solids touch.
  void take_solids() {
    if (!solids_) return;
    constexpr Index kUnknownSolid = kNoIndex - 1;
    std::vector<Index> solid_of(static_cast<std::size_t>(num_regions_) + 1, kUnknownSolid);
    const auto solid_at = [&](std::size_t side) { return (*solids_)[side / 2][side % 2]; };
    for (std::size_t side = 0; side < region_of_side_.size(); ++side) {
      Index& solid = solid_of[region_of_side_[side]];
      if (region_of_side_[side] == kOutsideRegion) continue;
      if (solid != kUnknownSolid && solid != solid_at(side)) return;
      solid = solid_at(side);
    }
    solid_of[kOutsideRegion] = kNoIndex;
    const auto touches = [&](std::size_t t) {
      const Index behind = solid_of[region_of_side_[2 * t]], front = solid_of[region_of_side_[2 * t + 1]];
      return behind != front && behind != kNoIndex && front != kNoIndex;
    };
    std::size_t t = 0;
    while (t < mesh_.triangles.size() && !touches(t)) ++t;
    if (t == mesh_.triangles.size()) return;
    std::vector<int> number(solid_of.size(), kOutsideRegion);
    std::map<Index, int> number_of_solid;
    num_regions_ = 0;
    for (std::size_t r = 1; r < solid_of.size(); ++r) {  // they are numbered by their first sides
      const Index solid = solid_of[r];
      if (solid == kNoIndex) {
        if (rule_ != RegionRule::keep) continue;
        number[r] = ++num_regions_;
      } else {
        const auto [it, is_new] = number_of_solid.try_emplace(solid, num_regions_ + 1);
        num_regions_ += is_new;
        number[r] = it->second;
      }
    }
    for (int& region : region_of_side_) region = number[region];
    names_.assign(static_cast<std::size_t>(num_regions_) + 1, "");
    for (const auto& [solid, region] : number_of_solid) names_[region] = mesh_.face_groups.groups[solid].name;
    nested_ = 0;
  }

  std::optional<RegionSurface> result() {
    RegionSurface surface;
    surface.mesh.positions = mesh_.positions;
    surface.mesh.face_groups.groups = mesh_.face_groups.groups;
    std::size_t loose = 0;
    bool has_interface = false;
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      const std::array<int, 2> sides{region_of_side_[2 * t], region_of_side_[2 * t + 1]};
      if (sides[0] == sides[1]) {  // a membrane in one region, or outside
        loose += names_.empty();
        continue;
      }
      has_interface = has_interface || (sides[0] != kOutsideRegion && sides[1] != kOutsideRegion);
      surface.mesh.triangles.push_back(mesh_.triangles[t]);
      surface.sides.push_back(sides);
      if (!mesh_.face_groups.empty()) surface.mesh.face_groups.of_face.push_back(mesh_.face_groups.of_face[t]);
    }
    if (!has_interface) return std::nullopt;
    for (int r = 1; r <= num_regions_; ++r) surface.regions.push_back({names_.empty() ? "" : names_[r], r, 3});
    orient_sheets(surface);
    if (names_.empty()) name_regions(surface);
    if (nested_ > 0)
      surface.notes.push_back(
          formatted("%zu closed part%s not face inward though inside another, and bound%s a region; "
                    "--regions merge makes voids of %s",
                    nested_, nested_ == 1 ? " does" : "s do", nested_ == 1 ? "s" : "", nested_ == 1 ? "it" : "them"));
    if (loose > 0) surface.notes.push_back(formatted("%zu triangles divide nothing and were left out", loose));
    return surface;
  }

  /// Gives regions the names of groups that bound them.
  static void name_regions(RegionSurface& surface) {
    constexpr double kLeastGroupShare = 0.5;       // of a region's area
    constexpr double kWholeGroupShare = 1 - 1e-9;  // of a group's area, up to rounding
    const auto& groups = surface.mesh.face_groups;
    if (groups.empty()) return;
    std::vector<double> of_group(groups.groups.size(), 0.0), of_region(surface.regions.size(), 0.0);
    std::map<std::pair<Index, std::size_t>, double> shared;  // by group and region
    for (std::size_t t = 0; t < surface.sides.size(); ++t) {
      const Index g = groups.of_face[t];
      const double one = triangle_area(surface.mesh, surface.mesh.triangles[t]);
      if (g != kNoIndex) of_group[g] += one;
      for (const int side : surface.sides[t]) {
        if (side == kOutsideRegion) continue;
        const auto r = static_cast<std::size_t>(side - 1);  // they are numbered from 1 on
        of_region[r] += one;
        if (g != kNoIndex) shared[{g, r}] += one;
      }
    }
    Index named = kNoIndex;  // the last group whose name was given
    for (const auto& [key, area] : shared) {
      const auto& [g, r] = key;
      std::string& name = surface.regions[r].name;
      if (g == named || !name.empty() || !(of_group[g] > 0)) continue;
      if (area < kWholeGroupShare * of_group[g] || of_group[g] < kLeastGroupShare * of_region[r]) continue;
      name = groups.groups[g].name;
      named = g;
    }
  }

  TriangleMesh mesh_;
  std::vector<char> has_copy_;
  std::optional<SolidSides> solids_;
  RegionRule rule_;
  DisjointSets cells_, parts_;
  std::vector<Index> curve_triangles_;
  std::vector<Cell> cells_of_parts_;
  std::vector<Part> parts_with_cells_;
  std::vector<int> region_of_side_;
  int num_regions_ = 0;
  std::vector<std::string> names_;  ///< of the regions, by number, if these are named solids; else empty
  std::size_t nested_ = 0;          ///< parts that are regions though they might be voids
};

}  // namespace

std::optional<RegionSurface> find_regions(const TriangleMesh& surface, RegionRule rule) {
  if (rule == RegionRule::merge) return std::nullopt;
  const TriangleMesh whole = welded(surface).mesh;
  TriangleMesh mesh = whole;
  const std::vector<Index> kept_as = drop_copies(mesh);
  std::vector<std::size_t> num_copies(mesh.triangles.size(), 0);
  for (const Index t : kept_as) ++num_copies[t];
  std::vector<char> has_copy;
  for (const std::size_t count : num_copies) has_copy.push_back(count > 1);
  std::optional<SolidSides> solids = solids_at_sides(whole, mesh.triangles, kept_as);
  return RegionFinder(std::move(mesh), std::move(has_copy), std::move(solids), rule).run();
}

}  // namespace subvol
