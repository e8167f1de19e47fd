// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/mending/part_union.h"

#include "subvol/base/error.h"
#include "subvol/fit/geometry/self_intersection.h"
#include "subvol/fit/geometry/surface_union.h"
#include "subvol/fit/geometry/triangle_meeting.h"
#include "subvol/fit/target/surface_diagnosis.h"

#include <algorithm>
#include <array>
#include <optional>
#include <unordered_map>
#include <utility>

namespace subvol::internal {

PartUnion::PartUnion(SurfaceParts parts, const std::function<bool()>& cancelled)
    : parts_(std::move(parts)), cancelled_(cancelled), groups_(parts_.num_parts()) {
  nesting_ = part_nesting(mesh(), parts_.part, static_cast<int>(parts_.num_parts()), cancelled);
  turn_parts_outward(parts_, nesting_);
  triangles_of_.resize(parts_.num_parts());
  for (std::size_t t = 0; t < parts_.part.size(); ++t) triangles_of_[parts_.part[t]].push_back(static_cast<Index>(t));
  find_names();
}

void PartUnion::find_names() {
  const FaceGroups& groups = mesh().face_groups;
  names_.resize(parts_.num_parts());
  if (groups.empty()) return;
  for (std::size_t p = 0; p < names_.size(); ++p) {
    const Index first = groups.of_face[triangles_of_[p].front()];
    const auto is_same = [&](Index t) { return groups.of_face[t] == first; };
    if (first != kNoIndex && std::ranges::all_of(triangles_of_[p], is_same)) names_[p] = groups.groups[first].name;
  }
}

std::string PartUnion::text_of(const Meeting& meeting) const {
  const auto text = [&](std::size_t p) {
    return std::to_string(p) + (names_[p].empty() ? "" : " (" + names_[p] + ")");
  };
  return "parts " + text(meeting.a) + " and " + text(meeting.b) + " meet at " + to_text(meeting.place);
}

/// Says which parts are united, and why they are no regions though they have names: with the place of a crossing, if
/// there is one.
std::string PartUnion::text_of(std::span<const Meeting> meetings, std::size_t num_parts) const {
  const auto crossing = std::ranges::find_if(meetings, &Meeting::crosses);
  const bool have_names = std::ranges::any_of(meetings, [&](const Meeting& meeting) {
    return !names_[meeting.a].empty() && !names_[meeting.b].empty() && names_[meeting.a] != names_[meeting.b];
  });
  std::string text = text_of(crossing == meetings.end() ? meetings.front() : *crossing) + "; " +
                     std::to_string(num_parts) + " parts that cross, overlap or touch are united";
  if (have_names)
    text += crossing == meetings.end() ? " (they are no regions: their faces cannot be cut along each other)"
                                       : " (named solids are regions only if they touch and do not cross)";
  return text;
}

bool PartUnion::group() {
  const SelfIntersections found = self_intersections(mesh(), cancelled_);
  if (is_cancelled()) return false;
  const auto join = [&](Index t, Index s, bool is_contact) {
    const auto a = static_cast<std::size_t>(parts_.part[t]), b = static_cast<std::size_t>(parts_.part[s]);
    if (root(a) == root(b) || !parts_.is_closed[a] || !parts_.is_closed[b]) return;
    const auto corners = [&](Index triangle) {
      const auto& [i, j, k] = mesh().triangles[triangle];
      return std::array<Vec3, 3>{mesh().positions[i], mesh().positions[j], mesh().positions[k]};
    };
    const TriangleMeeting meeting = meeting_of(corners(t), corners(s));
    if (!is_contact && meeting.kind != MeetingKind::crossing && meeting.kind != MeetingKind::face) return;
    meetings_.push_back({a, b, meeting.place, meeting.kind == MeetingKind::crossing});
    groups_.join(static_cast<Index>(a), static_cast<Index>(b));
  };
  for (const auto& [t, s] : found.pairs) join(t, s, false);
  for (const auto& [t, s] : edge_contacts(parts_)) join(t, s, true);
  return true;
}

TriangleMesh PartUnion::part(std::size_t p) const {
  TriangleMesh result;
  std::unordered_map<Index, Index> number;
  for (const Index t : triangles_of_[p]) {
    std::array<Index, 3> corners = mesh().triangles[t];
    for (Index& v : corners) {
      const auto [found, is_new] = number.try_emplace(v, static_cast<Index>(result.positions.size()));
      if (is_new) result.positions.push_back(mesh().positions[v]);
      v = found->second;
    }
    result.triangles.push_back(corners);
  }
  return result;
}

std::optional<TriangleMesh> PartUnion::united_group(std::span<const std::size_t> members,
                                                    std::span<const Meeting> meetings) const {
  std::optional<TriangleMesh> whole;
  for (const bool voids : {false, true})
    for (const std::size_t p : members) {
      if (nesting_.is_void(p) != voids) continue;
      if (is_cancelled()) return std::nullopt;
      TriangleMesh next = part(p);
      if (voids)
        for (auto& t : next.triangles) std::swap(t[1], t[2]);
      if (!whole)
        whole = std::move(next);
      else
        whole = voids ? without(*whole, next) : united(*whole, next);
      if (whole) continue;
      const auto meeting =
          std::find_if(meetings.begin(), meetings.end(), [&](const Meeting& m) { return m.a == p || m.b == p; });
      throw InputError("target: " + text_of(meeting == meetings.end() ? meetings.front() : *meeting) +
                       " and cannot be united: a part meets itself, or parts also touch along an edge or at a vertex");
    }
  return whole;
}

std::optional<TriangleMesh> PartUnion::made(std::vector<std::string>& done) {
  std::vector<std::vector<std::size_t>> members(parts_.num_parts());
  std::vector<std::vector<Meeting>> meetings(parts_.num_parts());
  for (std::size_t p = 0; p < members.size(); ++p) members[root(p)].push_back(p);
  for (const Meeting& meeting : meetings_) meetings[root(meeting.a)].push_back(meeting);
  TriangleMesh result;
  for (std::size_t p = 0; p < members.size(); ++p) {
    if (members[p].empty()) continue;
    const bool is_alone = meetings[p].empty();
    std::optional<TriangleMesh> one = is_alone ? part(p) : united_group(members[p], meetings[p]);
    if (!one) return std::nullopt;
    const auto first = static_cast<Index>(result.positions.size());
    result.positions.insert(result.positions.end(), one->positions.begin(), one->positions.end());
    for (const auto& [a, b, c] : one->triangles) result.triangles.push_back({first + a, first + b, first + c});
    if (is_alone) continue;
    done.push_back("target: " + text_of(meetings[p], members[p].size()));
  }
  return result;
}

}  // namespace subvol::internal
