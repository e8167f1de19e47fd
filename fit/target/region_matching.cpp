// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/target/region_matching.h"

#include "subvol/mesh/interfaces.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/surface/winding_number.h"

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

namespace subvol::internal {

namespace {

/// Returns so many regions of a target, if that is the number that a rule finds. Whatever the mesh fills is no void, so
/// closed parts that face inward may be regions, too.
std::optional<RegionSurface> find_so_many_regions(const TriangleMesh& target, std::size_t count) {
  for (const RegionRule rule : {RegionRule::automatic, RegionRule::keep})
    if (std::optional<RegionSurface> regions = find_regions(target, rule); regions && regions->regions.size() == count)
      return regions;
  return std::nullopt;
}

}  // namespace

std::optional<RegionSurface> regions_as_in(const TriangleMesh& target, const VolumeMesh& mesh) {
  constexpr double kInside = 0.5;
  const std::vector<int> references = region_references(mesh);
  if (references.size() < 2) return std::nullopt;
  std::optional<RegionSurface> regions = find_so_many_regions(target, references.size());
  if (!regions) return std::nullopt;
  std::vector<Vec3> centers;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    Vec3 sum = Vec3::Zero();
    for (const Index v : mesh.cell(c)) sum += mesh.positions[v];
    centers.push_back(sum / static_cast<double>(mesh.cell(c).size()));
  }
  std::map<int, std::map<int, std::size_t>> votes;  // by reference, then by region of the target
  for (const Group& region : regions->regions) {
    const std::vector<double> inside = WindingNumber(boundary_of_region(*regions, region.number)).at(centers);
    for (std::size_t c = 0; c < centers.size(); ++c)
      if (inside[c] > kInside) ++votes[mesh.references[c]][region.number];
  }
  std::map<int, int> reference_of;
  for (const auto& [reference, vote] : votes)
    reference_of[std::max_element(vote.begin(), vote.end(), [](const auto& a, const auto& b) {
                   return a.second < b.second;
                 })->first] = reference;
  if (reference_of.size() != references.size()) return std::nullopt;
  reference_of[kOutside] = kOutside;
  for (auto& sides : regions->sides)
    for (int& side : sides) side = reference_of[side];
  for (Group& region : regions->regions) region.number = reference_of[region.number];
  std::ranges::sort(regions->regions, {}, &Group::number);
  orient_sheets(*regions);
  std::vector<std::array<int, 2>> inner;
  for (const auto& pair : region_pairs(*regions))
    if (pair[0] != kOutside) inner.push_back(pair);
  if (find_interfaces(mesh, MeshTopology(mesh)).pairs != inner) return std::nullopt;
  return regions;
}

}  // namespace subvol::internal
