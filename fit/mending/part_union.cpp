// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/mending/part_union.h"

#include "subvol/base/error.h"
#include "subvol/fit/geometry/self_intersection.h"
#include "subvol/fit/geometry/surface_union.h"
#include "subvol/fit/geometry/triangle_meeting.h"
#include "subvol/fit/target/surface_diagnosis.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <optional>
#include <utility>

namespace subvol::internal {

PartUnion::PartUnion(SurfaceParts parts, const std::function<bool()>& cancelled)
    : parts_(std::move(parts)), cancelled_(cancelled) {
  nesting_ = part_nesting(mesh(), parts_.part, static_cast<int>(parts_.num_parts()));
  turn_parts_outward(parts_);
  group_.resize(parts_.num_parts());
  std::iota(group_.begin(), group_.end(), 0);
}

std::string PartUnion::text_of(const Meeting& meeting) const {
  return "parts " + std::to_string(meeting.a) + " and " + std::to_string(meeting.b) + " meet at " +
         to_text(meeting.place);
}

bool PartUnion::group() {
  const SelfIntersections found = self_intersections(mesh(), cancelled_);
  if (cancelled_ && cancelled_()) return false;
  const auto join = [&](Index t, Index s, bool is_contact) {
    const auto a = static_cast<std::size_t>(parts_.part[t]), b = static_cast<std::size_t>(parts_.part[s]);
    if (root(a) == root(b) || !parts_.is_closed[a] || !parts_.is_closed[b]) return;
    const auto corners = [&](Index triangle) {
      const auto& [i, j, k] = mesh().triangles[triangle];
      return std::array<Vec3, 3>{mesh().positions[i], mesh().positions[j], mesh().positions[k]};
    };
    const TriangleMeeting meeting = meeting_of(corners(t), corners(s));
    if (!is_contact && meeting.kind != MeetingKind::crossing && meeting.kind != MeetingKind::face) return;
    meetings_.push_back({a, b, meeting.place});
    group_[std::max(root(a), root(b))] = std::min(root(a), root(b));
  };
  for (const auto& [t, s] : found.pairs) join(t, s, false);
  for (const auto& [t, s] : edge_contacts(parts_)) join(t, s, true);
  return true;
}

TriangleMesh PartUnion::part(std::size_t p) const {
  TriangleMesh result;
  std::vector<Index> number(mesh().positions.size(), kNoIndex);
  for (std::size_t t = 0; t < mesh().triangles.size(); ++t) {
    if (static_cast<std::size_t>(parts_.part[t]) != p) continue;
    std::array<Index, 3> corners = mesh().triangles[t];
    for (Index& v : corners) {
      if (number[v] == kNoIndex) {
        number[v] = static_cast<Index>(result.positions.size());
        result.positions.push_back(mesh().positions[v]);
      }
      v = number[v];
    }
    result.triangles.push_back(corners);
  }
  return result;
}

TriangleMesh PartUnion::united_group(std::size_t group) const {
  std::optional<TriangleMesh> whole;
  for (const bool voids : {false, true})
    for (std::size_t p = 0; p < group_.size(); ++p) {
      if (root(p) != group || nesting_.is_void(p) != voids) continue;
      TriangleMesh next = part(p);
      if (voids)
        for (auto& t : next.triangles) std::swap(t[1], t[2]);
      if (!whole)
        whole = std::move(next);
      else
        whole = voids ? without(*whole, next) : united(*whole, next);
      if (whole) continue;
      const auto meeting =
          std::find_if(meetings_.begin(), meetings_.end(), [&](const Meeting& m) { return m.a == p || m.b == p; });
      throw InputError("target: " + text_of(meeting == meetings_.end() ? meetings_.front() : *meeting) +
                       " and cannot be united: a part meets itself, or parts also touch along an edge or at a vertex");
    }
  return std::move(*whole);
}

TriangleMesh PartUnion::made(std::vector<std::string>& done) const {
  TriangleMesh result;
  for (std::size_t p = 0; p < group_.size(); ++p) {
    if (root(p) != p) continue;
    const auto members =
        std::count_if(meetings_.begin(), meetings_.end(), [&](const Meeting& m) { return root(m.a) == p; });
    TriangleMesh one = members == 0 ? part(p) : united_group(p);
    const auto first = static_cast<Index>(result.positions.size());
    result.positions.insert(result.positions.end(), one.positions.begin(), one.positions.end());
    for (const auto& [a, b, c] : one.triangles) result.triangles.push_back({first + a, first + b, first + c});
    if (members == 0) continue;
    const auto meeting =
        std::find_if(meetings_.begin(), meetings_.end(), [&](const Meeting& m) { return root(m.a) == p; });
    done.push_back("target: " + text_of(*meeting) + "; " + std::to_string(members + 1) +
                   " parts that cross or overlap are united");
  }
  return result;
}

}  // namespace subvol::internal
