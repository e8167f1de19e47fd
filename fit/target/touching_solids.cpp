// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/target/touching_solids.h"

#include "subvol/fit/geometry/contact_imprint.h"
#include "subvol/fit/geometry/self_intersection.h"
#include "subvol/fit/geometry/triangle_meeting.h"
#include "subvol/surface/named_solids.h"
#include "subvol/surface/welded_surface.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

namespace subvol::internal {

namespace {

/// Returns true if regions are the solids that groups name, and not what these divide each other into.
bool are_named_solids(const RegionSurface& regions, std::size_t num_solids) {
  return regions.regions.size() == num_solids &&
         std::ranges::none_of(regions.regions, [](const Group& region) { return region.name.empty(); });
}

/// Returns true if triangles cross or overlap, or if the search was cancelled.
bool crosses(const TriangleMesh& mesh, const std::function<bool()>& cancelled) {
  const SelfIntersections found = self_intersections(mesh, cancelled);
  const auto corners = [&](Index t) {
    const auto& [a, b, c] = mesh.triangles[t];
    return std::array<Vec3, 3>{mesh.positions[a], mesh.positions[b], mesh.positions[c]};
  };
  return !found.is_complete || std::ranges::any_of(found.pairs, [&](const std::array<Index, 2>& pair) {
    const MeetingKind kind = meeting_of(corners(pair[0]), corners(pair[1])).kind;
    return kind == MeetingKind::crossing || kind == MeetingKind::face;
  });
}

}  // namespace

std::string TouchingSolids::text() const {
  constexpr std::size_t kMostSolidNames = 10;
  const std::size_t count = regions.regions.size(), listed = std::min(count, kMostSolidNames);
  std::string names;
  for (std::size_t r = 0; r < listed; ++r)
    names += (r == 0 ? "" : r + 1 == count ? " and " : ", ") + regions.regions[r].name;
  if (listed < count) names += " and " + std::to_string(count - listed) + " more";
  return std::to_string(count) + " solids touch: they become the regions " + names +
         "; --regions merge makes one of them";
}

std::optional<TouchingSolids> touching_solids(const TriangleMesh& surface, const std::function<bool()>& cancelled,
                                              RegionRule rule) {
  if (rule == RegionRule::merge || surface.face_groups.groups.size() < 2) return std::nullopt;
  TriangleMesh mesh = welded(surface).mesh;
  const std::vector<double> volumes = volumes_of_named_solids(mesh);
  if (volumes.empty()) return std::nullopt;
  if (std::optional<TriangleMesh> imprinted = imprinted_contacts(mesh, cancelled)) mesh = *std::move(imprinted);
  std::optional<RegionSurface> regions = find_regions(mesh, rule);
  const auto num_solids = static_cast<std::size_t>(std::ranges::count_if(volumes, [](double v) { return v != 0; }));
  if (!regions || regions->mesh.triangles.size() == mesh.triangles.size()) return std::nullopt;  // nothing touches
  if (!are_named_solids(*regions, num_solids) || crosses(regions->mesh, cancelled)) return std::nullopt;
  return TouchingSolids{std::move(mesh), *std::move(regions)};
}

}  // namespace subvol::internal
