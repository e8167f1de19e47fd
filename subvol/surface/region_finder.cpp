// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/format.h"
#include "subvol/surface/named_solids.h"
#include "subvol/surface/region_names.h"
#include "subvol/surface/region_surface.h"
#include "subvol/surface/space_cells.h"
#include "subvol/surface/welded_surface.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <string>
#include <utility>

namespace subvol {

using namespace internal;

namespace {

/// Decides which components of space are regions. A triangle t has two sides: 2t is behind it, 2t + 1 in front.
class RegionFinder {
 public:
  RegionFinder(TriangleMesh mesh, std::vector<char> has_copy, std::optional<SolidSides> solids, RegionRule rule)
      : mesh_(std::move(mesh)), has_copy_(std::move(has_copy)), solids_(std::move(solids)), rule_(rule) {}

  std::optional<RegionSurface> run() {
    if (mesh_.triangles.empty()) return std::nullopt;
    const std::optional<SpaceCells> space = find_space_cells(mesh_);
    if (!space || (space->parts.size() == 1 && !space->parts[0].has_curves)) return std::nullopt;
    number_regions(*space);
    take_solids();
    return result();
  }

 private:
  /// Returns true if each triangle of a part is there twice, for the solids on either side of it.
  bool has_copies(const PartWithCells& part) const {
    return std::ranges::all_of(part.triangles, [&](Index t) { return has_copy_[t] != 0; });
  }

  void number_regions(const SpaceCells& space) {
    constexpr double kLeastFacingShare = 0.5;  // of `SpaceCells::facing`
    // Parts that contain others come first.
    std::vector<std::size_t> order(space.parts.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return space.cells[space.parts[a].outer].volume < space.cells[space.parts[b].outer].volume;
    });
    std::vector<char> is_region(space.cells.size(), 0);
    std::vector<std::size_t> joined(space.cells.size());
    std::iota(joined.begin(), joined.end(), std::size_t{0});
    std::vector<double> root_facing(space.parts.size(), 1);
    for (const std::size_t p : order) {
      const PartWithCells& part = space.parts[p];
      const bool is_manifold = !part.has_curves;
      bool is_void = false;
      if (part.inside) {
        const std::size_t parent = space.cells[*part.inside].part;
        root_facing[p] = root_facing[parent];
        joined[part.outer] = joined[*part.inside];
        const bool in_region = is_region[joined[*part.inside]] != 0;
        is_void = rule_ == RegionRule::automatic && in_region && is_manifold &&
                  space.facing(p) * root_facing[p] < -kLeastFacingShare && !has_copies(part);
        if (in_region && !is_void && is_manifold && rule_ == RegionRule::automatic) ++nested_;
      } else {
        root_facing[p] = is_manifold && space.facing(p) < -kLeastFacingShare ? -1 : 1;
      }
      for (const std::size_t c : part.cells)
        if (c != part.outer) is_region[c] = !is_void && space.cells[c].has_volume();
    }
    region_of_side_.assign(2 * mesh_.triangles.size(), kOutsideRegion);
    std::vector<std::size_t> cell_of(2 * mesh_.triangles.size());
    for (std::size_t c = 0; c < space.cells.size(); ++c)
      for (const Index side : space.cells[c].sides) cell_of[side] = joined[c];
    std::vector<int> number(space.cells.size(), kOutsideRegion);
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
    if (names_.empty()) name_regions_by_groups(surface);
    if (nested_ > 0)
      surface.notes.push_back(
          formatted("%zu closed part%s not face inward though inside another, and bound%s a region; "
                    "--regions merge makes voids of %s",
                    nested_, nested_ == 1 ? " does" : "s do", nested_ == 1 ? "s" : "", nested_ == 1 ? "it" : "them"));
    if (loose > 0) surface.notes.push_back(formatted("%zu triangles divide nothing and were left out", loose));
    return surface;
  }

  TriangleMesh mesh_;
  std::vector<char> has_copy_;
  std::optional<SolidSides> solids_;
  RegionRule rule_;
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
