// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/mending/mending_patch.h"

#include "subvol/fit/geometry/self_intersection.h"
#include "subvol/fit/mending/visible_normals.h"
#include "subvol/surface/triangle_geometry.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <optional>
#include <utility>

namespace subvol::internal {
namespace {

using Corners = std::array<Index, 3>;

bool has(const Corners& t, Index v) { return t[0] == v || t[1] == v || t[2] == v; }
/// The corner of a triangle that is none of two others.
Index third(const Corners& t, Index a, Index b) { return t[0] + t[1] + t[2] - a - b; }
/// True if the triangle runs from a to b.
bool runs(const Corners& t, Index a, Index b) {
  return (t[0] == a && t[1] == b) || (t[1] == a && t[2] == b) || (t[2] == a && t[0] == b);
}

bool joined(const MendingPatch& patch, Index a, Index b) {
  return std::any_of(patch.mesh.triangles.begin(), patch.mesh.triangles.end(),
                     [&](const Corners& t) { return has(t, a) && has(t, b); });
}

/// Distance of two segments, from above: the least over each one's ends and middle, and, if their lines come close
/// between the ends, there.
double segment_distance(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const Vec3 u = b - a, v = d - c, w = a - c;
  const double uu = u.dot(u), uv = u.dot(v), vv = v.dot(v), uw = u.dot(w), vw = v.dot(w);
  const double determinant = uu * vv - uv * uv;
  double s = determinant > 0 ? std::clamp((uv * vw - vv * uw) / determinant, 0.0, 1.0) : 0.0;
  const double t = vv > 0 ? std::clamp((uv * s + vw) / vv, 0.0, 1.0) : 0.0;
  s = uu > 0 ? std::clamp((uv * t - uw) / uu, 0.0, 1.0) : 0.0;
  return (w + s * u - t * v).norm();
}

constexpr double kHidden = -1;  // clearance of a vertex without a direction

/// Returns the least cosine between normals and the direction that sees all of them best; `kHidden` if there is none.
double clearance(const std::vector<Vec3>& normals) {
  if (std::any_of(normals.begin(), normals.end(), [](const Vec3& n) { return !(n.norm() > 0.5); })) return kHidden;
  const std::optional<Vec3> direction = most_visible_direction(normals);
  if (!direction) return kHidden;
  double least = 1;
  for (const Vec3& n : normals) least = std::min(least, direction->dot(n));
  return least;
}

}  // namespace

std::vector<std::size_t> MendingPatch::at_edge(Index a, Index b) const {
  std::vector<std::size_t> found;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (has(mesh.triangles[t], a) && has(mesh.triangles[t], b)) found.push_back(t);
  return found;
}

std::set<Index> MendingPatch::neighbors(Index v) const {
  std::set<Index> found;
  for (const Corners& t : mesh.triangles)
    if (has(t, v)) found.insert(t.begin(), t.end());
  found.erase(v);
  return found;
}

bool MendingPatch::apply(const MendingChange& change) {
  const Index a = change.a, b = change.b;
  if (change.kind == MendingChange::Kind::move) {
    mesh.positions[a] = change.position;
    return true;
  }
  const std::vector<std::size_t> sides = at_edge(a, b);
  if (change.kind == MendingChange::Kind::flip) {
    if (sides.size() != 2) return false;
    Corners &s = mesh.triangles[sides[0]], &t = mesh.triangles[sides[1]];
    const Index from = runs(s, a, b) ? a : b, to = from == a ? b : a;
    const Index c = third(s, a, b), d = third(t, a, b);
    if (c == d || !runs(t, to, from) || joined(*this, c, d)) return false;
    s = {from, d, c};
    t = {d, to, c};
    return true;
  }
  if (sides.empty() || sides.size() > 2) return false;
  if (is_border[a] && !(is_border[b] && sides.size() == 1)) return false;
  if (is_border[b] && is_border[a] && sides.size() != 1) return false;
  const std::set<Index> of_a = neighbors(a), of_b = neighbors(b);
  std::vector<Index> common;
  std::set_intersection(of_a.begin(), of_a.end(), of_b.begin(), of_b.end(), std::back_inserter(common));
  if (common.size() != sides.size()) return false;
  for (Corners& t : mesh.triangles) {
    if (!has(t, a)) continue;
    if (has(t, b))
      t = kDropped;
    else
      std::replace(t.begin(), t.end(), a, b);
  }
  return true;
}

std::vector<MendingChange> possible_changes(const MendingPatch& patch, const std::vector<Index>& vertices,
                                            std::span<const Vec3> given, double distance) {
  std::vector<MendingChange> found;
  const auto& x = patch.mesh.positions;
  std::set<Index> near(vertices.begin(), vertices.end());
  std::set<std::pair<Index, Index>> edges;
  for (const Corners& t : patch.mesh.triangles) {
    if (t == kDropped || std::none_of(t.begin(), t.end(), [&](Index v) { return near.contains(v); })) continue;
    for (std::size_t k = 0; k < 3; ++k) edges.insert(std::minmax(t[k], t[(k + 1) % 3]));
  }
  for (const auto& [a, b] : edges) {
    if (!patch.is_inner[a] || !patch.is_inner[b]) continue;
    if ((x[a] - x[b]).norm() <= distance) {
      const double length = (x[a] - x[b]).norm();
      found.push_back({MendingChange::Kind::collapse, a, b, Vec3::Zero(), length});
      found.push_back({MendingChange::Kind::collapse, b, a, Vec3::Zero(), length});
    }
    const std::vector<std::size_t> sides = patch.at_edge(a, b);
    if (sides.size() != 2) continue;
    const Index c = third(patch.mesh.triangles[sides[0]], a, b), d = third(patch.mesh.triangles[sides[1]], a, b);
    const double between = segment_distance(x[a], x[b], x[c], x[d]);
    if (between <= distance) found.push_back({MendingChange::Kind::flip, a, b, Vec3::Zero(), between});
  }
  constexpr std::array<double, 3> kShares{0.25, 0.5, 0.9};  // of the distance
  for (const Index v : near) {
    if (patch.is_border[v]) continue;
    Vec3 normal = Vec3::Zero(), mean = Vec3::Zero();
    std::vector<Vec3> ways;
    for (const Corners& t : patch.mesh.triangles)
      if (t != kDropped && has(t, v)) normal += doubled_area_vector(patch.mesh, t);
    const std::set<Index> neighbors = patch.neighbors(v);
    if (neighbors.empty()) continue;
    for (const Index w : neighbors) mean += (x[w] - x[v]) / static_cast<double>(neighbors.size());
    for (const double share : kShares)
      for (const double sign : {-1.0, 1.0}) ways.push_back(sign * share * distance * normal.stableNormalized());
    const double length = mean.norm();
    if (length > 0)
      for (const double share : kShares) ways.push_back(mean * std::min(1.0, share * distance / length));
    for (const Vec3& way : ways)
      if ((x[v] + way - given[v]).norm() <= distance)
        found.push_back({MendingChange::Kind::move, v, kNoIndex, x[v] + way, way.norm()});
  }
  return found;
}

PatchFaults faults_of(const MendingPatch& patch, const MendingPatch* before, const PatchFaults* known) {
  const auto& triangles = patch.mesh.triangles;
  const auto is_changed = [&](std::size_t t) {
    if (!before || triangles[t] != before->mesh.triangles[t]) return true;
    return std::any_of(triangles[t].begin(), triangles[t].end(),
                       [&](Index v) { return patch.mesh.positions[v] != before->mesh.positions[v]; });
  };
  PatchFaults faults;
  TriangleMesh alive{patch.mesh.positions, {}};
  std::vector<Index> number;         // of the triangles that are left, in the patch
  std::vector<std::uint8_t> marked;  // changed ones of them
  std::vector<char> is_kept(triangles.size(), 0), is_touched(patch.mesh.positions.size(), before == nullptr);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const bool changed = triangles[t] == kDropped ? before && before->mesh.triangles[t] != kDropped : is_changed(t);
    if (changed && before)
      for (const Corners& corners : {triangles[t], before->mesh.triangles[t]})
        for (const Index v : corners)
          if (v != kNoIndex) is_touched[v] = 1;
    if (triangles[t] == kDropped) continue;
    is_kept[t] = !changed;
    alive.triangles.push_back(triangles[t]);
    number.push_back(static_cast<Index>(t));
    marked.push_back(changed);
  }
  const SelfIntersections found = self_intersections(alive, {}, marked);
  if (known)
    for (const auto& [t, s] : known->meeting)
      if (is_kept[t] && is_kept[s]) faults.meeting.push_back({t, s});
  for (const auto& [t, s] : found.pairs) faults.meeting.push_back({number[t], number[s]});
  faults.num_flat = found.degenerate.size();
  std::vector<std::vector<Vec3>> normals(is_touched.size());
  for (const Corners& t : alive.triangles) {
    if (std::none_of(t.begin(), t.end(), [&](Index v) { return is_touched[v]; })) continue;
    const Vec3 normal = doubled_area_vector(patch.mesh, t).stableNormalized();
    for (const Index v : t) normals[v].push_back(normal);
  }
  for (std::size_t v = 0; v < is_touched.size(); ++v) {
    const bool has_none = !patch.is_inner[v] || normals[v].empty();
    faults.clearances.push_back(!is_touched[v] ? known->clearances[v] : has_none ? 1.0 : clearance(normals[v]));
  }
  return faults;
}

PatchRating rating_of(const PatchFaults& faults, double distance, MendingGoal goal) {
  constexpr double kEdgeOn = 0.1;  // cosine between a direction and a normal: 6 degrees
  const auto& clearances = faults.clearances;
  const auto num_hidden = static_cast<std::size_t>(std::count(clearances.begin(), clearances.end(), kHidden));
  return {.faults = faults.meeting.size() + faults.num_flat + (goal == MendingGoal::layers ? num_hidden : 0),
          .is_hard = std::any_of(clearances.begin(), clearances.end(), [](double c) { return c < kEdgeOn; }),
          .distance = distance};
}

}  // namespace subvol::internal
