// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/target/region_matching.h"

#include "subvol/base/disjoint_sets.h"
#include "subvol/fit/target/touching_solids.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/surface/boundary.h"
#include "subvol/surface/triangle_geometry.h"
#include "subvol/surface/winding_number.h"

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <utility>
#include <vector>

namespace subvol::internal {

namespace {

/// Returns so many regions of a target, if that is the number that a rule finds. Whatever the mesh fills is no void, so
/// closed parts that face inward may be regions, too.
std::optional<RegionSurface> find_so_many_regions(const TriangleMesh& target, std::size_t count,
                                                  const std::function<bool()>& cancelled) {
  if (std::optional<TouchingSolids> solids = touching_solids(target, cancelled);
      solids && solids->regions.regions.size() == count)
    return std::move(solids->regions);
  for (const RegionRule rule : {RegionRule::automatic, RegionRule::keep})
    if (std::optional<RegionSurface> regions = find_regions(target, rule); regions && regions->regions.size() == count)
      return regions;
  return std::nullopt;
}

/// Returns the reference of each region: of all pairs of a reference and a region, those with the most votes first, as
/// long as neither has been taken.
std::map<int, int> one_to_one(const std::map<std::array<int, 2>, std::size_t>& votes) {
  std::vector<std::pair<std::size_t, std::array<int, 2>>> pairs;
  for (const auto& [pair, count] : votes) pairs.push_back({count, pair});
  std::ranges::stable_sort(pairs, [](const auto& a, const auto& b) { return a.first > b.first; });
  std::map<int, int> reference_of;
  std::set<int> taken;
  for (const auto& [count, pair] : pairs)
    if (!taken.contains(pair[0]) && reference_of.try_emplace(pair[1], pair[0]).second) taken.insert(pair[0]);
  return reference_of;
}

/// Returns true if a part of the mesh's boundary faces inward as a whole: the wall of a void.
bool has_cavity(const VolumeMesh& mesh) {
  const TriangleMesh boundary = triangulate(boundary_surface(mesh, MeshTopology(mesh)));
  DisjointSets parts(boundary.positions.size());
  for (const auto& t : boundary.triangles) {
    parts.join(t[0], t[1]);
    parts.join(t[0], t[2]);
  }
  std::map<Index, double> volumes;
  for (const auto& t : boundary.triangles)
    volumes[parts.of(t[0])] += sixfold_volume(boundary.positions, t, boundary.positions.front());
  return std::ranges::any_of(volumes, [](const auto& part) { return part.second < 0; });
}

}  // namespace

std::optional<RegionSurface> regions_as_in(const TriangleMesh& target, const VolumeMesh& mesh,
                                           const std::function<bool()>& cancelled) {
  constexpr double kLeastInsideWindingNumber = 0.5;  // from here on a point is inside: halfway between 0 and 1
  const std::vector<int> references = region_references(mesh);
  if (references.size() < 2) return std::nullopt;
  std::optional<RegionSurface> regions = find_so_many_regions(target, references.size(), cancelled);
  if (!regions) return std::nullopt;
  std::vector<Vec3> centers;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    Vec3 sum = Vec3::Zero();
    for (const Index v : mesh.cell(c)) sum += mesh.positions[v];
    centers.push_back(sum / static_cast<double>(mesh.cell(c).size()));
  }
  std::map<std::array<int, 2>, std::size_t> votes;  // by reference and region of the target
  const std::vector<TriangleMesh> boundaries = boundaries_of_regions(*regions);
  for (std::size_t r = 0; r < boundaries.size(); ++r) {
    const std::vector<double> inside = WindingNumber(boundaries[r]).at(centers);
    for (std::size_t c = 0; c < centers.size(); ++c)
      if (inside[c] > kLeastInsideWindingNumber) ++votes[{mesh.references[c], regions->regions[r].number}];
  }
  std::map<int, int> reference_of = one_to_one(votes);
  if (reference_of.size() != references.size()) return std::nullopt;
  reference_of[kOutsideRegion] = kOutsideRegion;
  for (auto& sides : regions->sides)
    for (int& side : sides) side = reference_of[side];
  for (Group& region : regions->regions) region.number = reference_of[region.number];
  std::ranges::sort(regions->regions, {}, &Group::number);
  orient_sheets(*regions);
  std::vector<std::array<int, 2>> inner;
  for (const auto& pair : region_pairs(*regions))
    if (pair[0] != kOutsideRegion) inner.push_back(pair);
  if (find_interfaces(mesh, MeshTopology(mesh)).pairs != inner) return std::nullopt;
  return regions;
}

MatchedTarget matched_target(const TriangleMesh& target, const VolumeMesh& template_mesh,
                             const std::function<bool()>& cancelled) {
  const auto is_vertex = [&](Index v) { return v >= 0 && static_cast<std::size_t>(v) < template_mesh.num_vertices(); };
  if (!std::ranges::all_of(template_mesh.cell_vertices, is_vertex)) return {};  // the fit refuses it
  MatchedTarget matched{.regions = regions_as_in(target, template_mesh, cancelled), .outer = {}, .warning = {}};
  if (matched.regions) {
    matched.outer = outer_surface(*matched.regions);
    return matched;
  }
  const auto is_cancelled = [&] { return cancelled && cancelled(); };
  if (is_cancelled()) return {};
  std::optional<TouchingSolids> solids = touching_solids(target, cancelled);
  if (is_cancelled()) return {};
  const std::optional<RegionSurface> others = solids ? std::optional(std::move(solids->regions)) : find_regions(target);
  if (!others || has_cavity(template_mesh)) return matched;
  matched.outer = outer_surface(*others);
  const std::size_t count = std::max<std::size_t>(1, region_references(template_mesh).size());
  matched.warning = "the target has " + std::to_string(others->regions.size()) + " regions, and the template " +
                    (count == others->regions.size() ? "has others" : "has " + std::to_string(count)) +
                    ": only the target's outer surface is reproduced" +
                    (count > 1 ? ", and interfaces keep the template's shape" : "");
  return matched;
}

}  // namespace subvol::internal
