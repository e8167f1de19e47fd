// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/mending/mending_patch.h"

#include "subvol/fit/geometry/self_intersection.h"
#include "subvol/fit/mending/visible_normals.h"
#include "subvol/surface/triangle_geometry.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <map>
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
  return std::any_of(patch.around[a].begin(), patch.around[a].end(),
                     [&](Index t) { return has(patch.mesh.triangles[t], b); });
}

Eigen::AlignedBox3d box_of(const TriangleMesh& mesh, const Corners& corners) {
  Eigen::AlignedBox3d box;
  if (corners == kDropped) return box;
  for (const Index v : corners) box.extend(mesh.positions[v]);
  return box;
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

constexpr double kHiddenClearance = -1;  // clearance of a vertex without a direction
constexpr double kEdgeOn = 0.1;          // cosine between a direction and a normal: 6 degrees

/// Returns the least cosine between normals and the direction that sees all of them best; `kHiddenClearance` if there
/// is none.
double clearance(const std::vector<Vec3>& normals) {
  if (std::any_of(normals.begin(), normals.end(), [](const Vec3& n) { return !(n.norm() > 0.5); }))
    return kHiddenClearance;
  const std::optional<Vec3> direction = most_visible_direction(normals);
  if (!direction) return kHiddenClearance;
  double least = 1;
  for (const Vec3& n : normals) least = std::min(least, direction->dot(n));
  return least;
}

/// Returns the clearance of a vertex of a patch.
double clearance_at(const MendingPatch& patch, Index v) {
  if (!patch.is_inner[v] || patch.around[v].empty()) return 1;
  std::vector<Vec3> normals;
  for (const Index t : patch.around[v])
    normals.push_back(doubled_area_vector(patch.mesh, patch.mesh.triangles[t]).stableNormalized());
  return clearance(normals);
}

/// Gives a triangle of a patch other corners.
void set_corners(MendingPatch& patch, Index t, const Corners& corners) {
  Corners& now = patch.mesh.triangles[t];
  for (const Corners* each : {&std::as_const(now), &corners}) {
    if (*each == kDropped) continue;
    for (const Index v : *each) {
      std::vector<Index>& around = patch.around[v];
      const auto at = std::lower_bound(around.begin(), around.end(), t);
      if (each == &corners)
        around.insert(at, t);
      else
        around.erase(at);
    }
  }
  now = corners;
  patch.boxes[t] = box_of(patch.mesh, corners);
}

/// Moves a vertex of a patch.
void set_position(MendingPatch& patch, Index v, const Vec3& position) {
  patch.mesh.positions[v] = position;
  for (const Index t : patch.around[v]) patch.boxes[t] = box_of(patch.mesh, patch.mesh.triangles[t]);
}

void count_clearances(PatchFaults& faults) {
  const std::vector<double>& all = faults.clearances;
  faults.num_hidden = static_cast<std::size_t>(std::count(all.begin(), all.end(), kHiddenClearance));
  faults.num_hard =
      static_cast<std::size_t>(std::count_if(all.begin(), all.end(), [](double c) { return c < kEdgeOn; }));
}

}  // namespace

void MendingPatch::index() {
  around.assign(mesh.positions.size(), {});
  boxes.clear();
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    boxes.push_back(box_of(mesh, mesh.triangles[t]));
    if (mesh.triangles[t] == kDropped) continue;
    for (const Index v : mesh.triangles[t]) around[v].push_back(static_cast<Index>(t));
  }
}

std::vector<Index> MendingPatch::at_edge(Index a, Index b) const {
  std::vector<Index> found;
  for (const Index t : around[a])
    if (has(mesh.triangles[t], b)) found.push_back(t);
  return found;
}

std::set<Index> MendingPatch::neighbors(Index v) const {
  std::set<Index> found;
  for (const Index t : around[v]) found.insert(mesh.triangles[t].begin(), mesh.triangles[t].end());
  found.erase(v);
  return found;
}

bool MendingPatch::apply(const MendingChange& change, PatchUndo& replaced) {
  const Index a = change.a, b = change.b;
  replaced = {};
  const auto set = [&](Index t, const Corners& corners) {
    replaced.triangles.emplace_back(t, mesh.triangles[t]);
    set_corners(*this, t, corners);
  };
  if (change.kind == MendingChange::Kind::move) {
    replaced.moved = a;
    replaced.position = mesh.positions[a];
    set_position(*this, a, change.position);
    return true;
  }
  const std::vector<Index> sides = at_edge(a, b);
  if (change.kind == MendingChange::Kind::flip) {
    if (sides.size() != 2) return false;
    const Corners s = mesh.triangles[sides[0]], t = mesh.triangles[sides[1]];
    const Index from = runs(s, a, b) ? a : b, to = from == a ? b : a;
    const Index c = third(s, a, b), d = third(t, a, b);
    if (c == d || !runs(t, to, from) || joined(*this, c, d)) return false;
    set(sides[0], {from, d, c});
    set(sides[1], {d, to, c});
    return true;
  }
  if (sides.empty() || sides.size() > 2) return false;
  if (is_border[a] && !(is_border[b] && sides.size() == 1)) return false;
  if (is_border[b] && is_border[a] && sides.size() != 1) return false;
  const std::set<Index> of_a = neighbors(a), of_b = neighbors(b);
  std::vector<Index> common;
  std::set_intersection(of_a.begin(), of_a.end(), of_b.begin(), of_b.end(), std::back_inserter(common));
  if (common.size() != sides.size()) return false;
  const std::vector<Index> at_a = around[a];
  for (const Index t : at_a) {
    Corners corners = mesh.triangles[t];
    if (has(corners, b))
      corners = kDropped;
    else
      std::replace(corners.begin(), corners.end(), a, b);
    set(t, corners);
  }
  return true;
}

void MendingPatch::undo(const PatchUndo& replaced) {
  for (auto one = replaced.triangles.rbegin(); one != replaced.triangles.rend(); ++one)
    set_corners(*this, one->first, one->second);
  if (replaced.moved != kNoIndex) set_position(*this, replaced.moved, replaced.position);
}

std::vector<MendingChange> possible_changes(const MendingPatch& patch, const std::vector<Index>& vertices,
                                            std::span<const Vec3> given, double distance) {
  std::vector<MendingChange> found;
  const auto& x = patch.mesh.positions;
  std::set<Index> near(vertices.begin(), vertices.end());
  std::set<std::pair<Index, Index>> edges;
  for (const Index v : near)
    for (const Index i : patch.around[v]) {
      const Corners& t = patch.mesh.triangles[i];
      for (std::size_t k = 0; k < 3; ++k) edges.insert(std::minmax(t[k], t[(k + 1) % 3]));
    }
  for (const auto& [a, b] : edges) {
    if (!patch.is_inner[a] || !patch.is_inner[b]) continue;
    if ((x[a] - x[b]).norm() <= distance) {
      const double length = (x[a] - x[b]).norm();
      found.push_back({MendingChange::Kind::collapse, a, b, Vec3::Zero(), length});
      found.push_back({MendingChange::Kind::collapse, b, a, Vec3::Zero(), length});
    }
    const std::vector<Index> sides = patch.at_edge(a, b);
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
    for (const Index t : patch.around[v]) normal += doubled_area_vector(patch.mesh, patch.mesh.triangles[t]);
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

PatchFaults faults_of(const MendingPatch& patch) {
  TriangleMesh alive{patch.mesh.positions, {}};
  std::vector<Index> number;  // of the triangles that are left, in the patch
  for (std::size_t t = 0; t < patch.mesh.triangles.size(); ++t) {
    if (patch.mesh.triangles[t] == kDropped) continue;
    alive.triangles.push_back(patch.mesh.triangles[t]);
    number.push_back(static_cast<Index>(t));
  }
  const SelfIntersections found = self_intersections(alive);
  PatchFaults faults;
  for (const auto& [t, s] : found.pairs) faults.meeting.push_back({number[t], number[s]});
  for (const Index t : found.degenerate) faults.flat.push_back(number[t]);
  for (std::size_t v = 0; v < patch.around.size(); ++v)
    faults.clearances.push_back(clearance_at(patch, static_cast<Index>(v)));
  count_clearances(faults);
  return faults;
}

FaultsAfter::FaultsAfter(const MendingPatch& patch, const PatchUndo& replaced, const PatchFaults& known)
    : known_(known) {
  std::set<Index> touched;
  const auto touch = [&](const Corners& corners) {
    if (corners != kDropped) touched.insert(corners.begin(), corners.end());
  };
  for (const auto& [t, before] : replaced.triangles) {
    changed_.push_back(t);
    touch(before);
  }
  if (replaced.moved != kNoIndex) changed_ = patch.around[replaced.moved];
  std::sort(changed_.begin(), changed_.end());
  Eigen::AlignedBox3d changed_box;
  for (const Index t : changed_) {
    touch(patch.mesh.triangles[t]);
    if (!patch.boxes[t].isEmpty()) changed_box.extend(patch.boxes[t]);
  }
  for (const Index v : touched) clearances_.emplace_back(v, clearance_at(patch, v));
  // Only triangles whose boxes meet can meet.
  TriangleMesh near;
  std::vector<Index> number;         // of these triangles, in the patch
  std::vector<std::uint8_t> marked;  // changed ones of them
  std::map<Index, Index> vertex;
  std::size_t num_marked = 0;
  for (std::size_t i = 0; i < patch.boxes.size(); ++i) {
    const auto t = static_cast<Index>(i);
    const Eigen::AlignedBox3d& box = patch.boxes[i];
    if (patch.mesh.triangles[i] == kDropped || !box.intersects(changed_box)) continue;
    const bool changed = is_changed(t);
    if (!changed && std::none_of(changed_.begin(), changed_.end(), [&](Index s) {
          return patch.mesh.triangles[s] != kDropped && patch.boxes[s].intersects(box);
        }))
      continue;
    Corners corners = patch.mesh.triangles[i];
    for (Index& v : corners) {
      const auto [found, is_new] = vertex.try_emplace(v, static_cast<Index>(near.positions.size()));
      if (is_new) near.positions.push_back(patch.mesh.positions[v]);
      v = found->second;
    }
    near.triangles.push_back(corners);
    number.push_back(t);
    marked.push_back(changed);
    num_marked += changed;
  }
  work_ = num_marked * number.size();
  const SelfIntersections found = self_intersections(near, {}, marked);
  for (const auto& [t, s] : found.pairs) meeting_.push_back({number[t], number[s]});
  for (const Index t : found.degenerate)
    if (marked[t]) flat_.push_back(number[t]);
}

bool FaultsAfter::is_changed(Index t) const { return std::binary_search(changed_.begin(), changed_.end(), t); }

PatchFaults FaultsAfter::faults() const {
  PatchFaults faults;
  for (const auto& [t, s] : known_.meeting)
    if (!is_changed(t) && !is_changed(s)) faults.meeting.push_back({t, s});
  faults.meeting.insert(faults.meeting.end(), meeting_.begin(), meeting_.end());
  for (const Index t : known_.flat)
    if (!is_changed(t)) faults.flat.push_back(t);
  faults.flat.insert(faults.flat.end(), flat_.begin(), flat_.end());
  faults.clearances = known_.clearances;
  for (const auto& [v, clearance] : clearances_) faults.clearances[v] = clearance;
  count_clearances(faults);
  return faults;
}

PatchRating FaultsAfter::rating(double distance, MendingGoal goal) const {
  std::size_t num_faults = meeting_.size() + flat_.size(), num_hidden = known_.num_hidden, num_hard = known_.num_hard;
  for (const auto& [t, s] : known_.meeting) num_faults += !is_changed(t) && !is_changed(s);
  for (const Index t : known_.flat) num_faults += !is_changed(t);
  for (const auto& [v, clearance] : clearances_) {
    num_hidden = num_hidden + (clearance == kHiddenClearance) - (known_.clearances[v] == kHiddenClearance);
    num_hard = num_hard + (clearance < kEdgeOn) - (known_.clearances[v] < kEdgeOn);
  }
  return {.faults = num_faults + (goal == MendingGoal::layers ? num_hidden : 0),
          .is_hard = num_hard > 0,
          .distance = distance};
}

PatchRating rating_of(const PatchFaults& faults, double distance, MendingGoal goal) {
  return {.faults = faults.meeting.size() + faults.flat.size() + (goal == MendingGoal::layers ? faults.num_hidden : 0),
          .is_hard = faults.num_hard > 0,
          .distance = distance};
}

}  // namespace subvol::internal
