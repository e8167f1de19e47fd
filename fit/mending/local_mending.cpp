// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/mending/local_mending.h"

#include "subvol/fit/geometry/self_intersection.h"
#include "subvol/fit/mending/surface_faults.h"
#include "subvol/fit/mending/visible_normals.h"
#include "subvol/surface/boundary.h"
#include "subvol/surface/corner_fans.h"
#include "subvol/surface/triangle_geometry.h"
#include "subvol/surface/welded_surface.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <tuple>

namespace subvol::internal {
namespace {

using Corners = std::array<Index, 3>;
constexpr Corners kNone{kNoIndex, kNoIndex, kNoIndex};

bool has(const Corners& t, Index v) { return t[0] == v || t[1] == v || t[2] == v; }
/// The corner of a triangle that is none of two others.
Index third(const Corners& t, Index a, Index b) { return t[0] + t[1] + t[2] - a - b; }
/// True if the triangle runs from a to b.
bool runs(const Corners& t, Index a, Index b) {
  return (t[0] == a && t[1] == b) || (t[1] == a && t[2] == b) || (t[2] == a && t[0] == b);
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

/// A change of a few triangles.
struct Change {
  enum class Kind { collapse, flip, move } kind;
  Index a, b;                    ///< the ends of an edge; collapse: a becomes b; move: the vertex is a
  Vec3 position = Vec3::Zero();  ///< of a moved vertex
  double distance = 0;           ///< by which the surface changes, at most
};

/// The triangles around a fault and all that are near them, with numbers of their own.
struct Patch {
  TriangleMesh mesh;             ///< dropped triangles are `kNone`
  std::vector<char> is_inner;    ///< vertices all of whose triangles are in the patch
  std::vector<char> is_border;   ///< vertices at an edge of one triangle, of the inner ones
  Eigen::AlignedBox3d box;       ///< in which triangles are of the patch

  std::vector<std::size_t> at_edge(Index a, Index b) const {
    std::vector<std::size_t> found;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      if (has(mesh.triangles[t], a) && has(mesh.triangles[t], b)) found.push_back(t);
    return found;
  }
  bool joined(Index a, Index b) const {
    return std::any_of(mesh.triangles.begin(), mesh.triangles.end(),
                       [&](const Corners& t) { return has(t, a) && has(t, b); });
  }
  std::set<Index> neighbors(Index v) const {
    std::set<Index> found;
    for (const Corners& t : mesh.triangles)
      if (has(t, v)) found.insert(t.begin(), t.end());
    found.erase(v);
    return found;
  }
  /// Makes a change; returns false if the surface would be no manifold.
  bool apply(const Change& change);
};

bool Patch::apply(const Change& change) {
  const Index a = change.a, b = change.b;
  if (change.kind == Change::Kind::move) {
    mesh.positions[a] = change.position;
    return true;
  }
  const std::vector<std::size_t> sides = at_edge(a, b);
  if (change.kind == Change::Kind::flip) {
    if (sides.size() != 2) return false;
    Corners &s = mesh.triangles[sides[0]], &t = mesh.triangles[sides[1]];
    const Index from = runs(s, a, b) ? a : b, to = from == a ? b : a;
    const Index c = third(s, a, b), d = third(t, a, b);
    if (c == d || !runs(t, to, from) || joined(c, d)) return false;
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
    if (has(t, b)) t = kNone;
    else std::replace(t.begin(), t.end(), a, b);
  }
  return true;
}

/// What is wrong with a patch.
struct PatchFaults {
  std::vector<std::array<Index, 2>> meeting;  ///< pairs of triangles that meet improperly
  std::size_t num_flat = 0;                   ///< triangles without area
  std::vector<double> clearances;  ///< per vertex: `clearance`; 1 if it is no inner vertex, or has no triangles
};

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

/// Returns what is wrong with a patch.
/// before, known  the patch before a change, and its faults: only what the change touches is searched. Null: all is.
PatchFaults faults_of(const Patch& patch, const Patch* before = nullptr, const PatchFaults* known = nullptr) {
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
    const bool changed = triangles[t] == kNone ? before && before->mesh.triangles[t] != kNone : is_changed(t);
    if (changed && before)
      for (const Corners& corners : {triangles[t], before->mesh.triangles[t]})
        for (const Index v : corners)
          if (v != kNoIndex) is_touched[v] = 1;
    if (triangles[t] == kNone) continue;
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

/// How good a patch is: less is better.
struct Rating {
  std::size_t faults = 0;
  bool is_hard = false;  ///< from the best direction at some vertex, a triangle is seen almost edge-on
  double distance = 0;   ///< of the changes
  friend bool operator<(const Rating& a, const Rating& b) {
    return std::tie(a.faults, a.is_hard, a.distance) < std::tie(b.faults, b.is_hard, b.distance);
  }
};

Rating rating_of(const PatchFaults& faults, double distance, MendingGoal goal) {
  constexpr double kEdgeOn = 0.1;  // cosine between a direction and a normal: 6 degrees
  const auto& clearances = faults.clearances;
  const auto num_hidden = static_cast<std::size_t>(std::count(clearances.begin(), clearances.end(), kHidden));
  return {.faults = faults.meeting.size() + faults.num_flat + (goal == MendingGoal::layers ? num_hidden : 0),
          .is_hard = std::any_of(clearances.begin(), clearances.end(), [](double c) { return c < kEdgeOn; }),
          .distance = distance};
}

/// Mends one surface.
class LocalMender {
 public:
  LocalMender(TriangleMesh& mesh, double distance, MendingGoal goal, const std::function<bool()>& cancelled)
      : mesh_(mesh), distance_(distance), goal_(goal), cancelled_(cancelled), given_(mesh.positions) {
    done_.is_dropped.assign(mesh.triangles.size(), 0);
    around_.resize(mesh.positions.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      for (const Index v : mesh.triangles[t]) around_[v].push_back(static_cast<Index>(t));
  }
  LocalMending run();

 private:
  bool is_cancelled() { return done_.is_cancelled = done_.is_cancelled || (cancelled_ && cancelled_()); }
  /// Returns the triangles at each fault.
  std::vector<std::vector<Index>> faults() const;
  Patch patch_around(const std::vector<Index>& seeds, std::vector<Index>& triangles, std::vector<Index>& vertices,
                     std::vector<Index>& seed_vertices) const;
  std::vector<Change> changes(const Patch& patch, const std::vector<Index>& vertices,
                              const std::vector<Index>& seed_vertices) const;
  /// Makes the change at a fault that leaves the fewest; returns false if none helps.
  bool mend(const std::vector<Index>& seeds);
  /// Returns true if `mend` found no change at a fault before, and nothing has changed around it since.
  bool is_hopeless(const std::vector<Index>& seeds) const;
  Eigen::AlignedBox3d box_of(Index t) const {
    Eigen::AlignedBox3d box;
    for (const Index v : mesh_.triangles[t]) box.extend(mesh_.positions[v]);
    return box;
  }
  void accept(const Patch& patch, const std::vector<Change>& changes, const std::vector<Index>& triangles,
              const std::vector<Index>& vertices);

  TriangleMesh& mesh_;
  double distance_;
  MendingGoal goal_;
  const std::function<bool()>& cancelled_;
  std::vector<Vec3> given_;
  std::vector<std::vector<Index>> around_;  ///< triangles at each vertex
  std::vector<char> is_touched_;            ///< triangles that were changed in this round
  int num_pair_searches_ = 0;               ///< faults for which two changes at a time were tried
  std::vector<Eigen::AlignedBox3d> changed_;  ///< boxes of the triangles that changed, before and after, in order
  /// A fault that no change mended.
  struct Failure {
    Eigen::AlignedBox3d box;  ///< of the triangles that were looked at
    std::size_t num_changed;  ///< size of `changed_` then
  };
  std::map<std::vector<Index>, Failure> failures_;  ///< by the triangles at the fault
  LocalMending done_;
};

std::vector<std::vector<Index>> LocalMender::faults() const {
  TriangleMesh alive;
  std::vector<Index> number(mesh_.positions.size(), kNoIndex), vertex, triangle;
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
    if (done_.is_dropped[t]) continue;
    Corners corners = mesh_.triangles[t];
    for (Index& v : corners) {
      if (number[v] == kNoIndex) {
        number[v] = static_cast<Index>(alive.positions.size());
        alive.positions.push_back(mesh_.positions[v]);
        vertex.push_back(v);
      }
      v = number[v];
    }
    alive.triangles.push_back(corners);
    triangle.push_back(static_cast<Index>(t));
  }
  const SurfaceFaults found = find_faults(as_polygons(alive), goal_, cancelled_);
  std::vector<std::vector<Index>> seeds;
  for (const Index f : found.flat) seeds.push_back({triangle[f]});
  for (const auto& [f, g] : found.meeting) seeds.push_back({triangle[f], triangle[g]});
  for (const Index v : found.hidden) seeds.push_back(around_[vertex[v]]);
  return seeds;
}

Patch LocalMender::patch_around(const std::vector<Index>& seeds, std::vector<Index>& triangles,
                                std::vector<Index>& vertices, std::vector<Index>& seed_vertices) const {
  const auto corners_of = [&](const std::set<Index>& of) {
    std::set<Index> found;
    for (const Index t : of) found.insert(mesh_.triangles[t].begin(), mesh_.triangles[t].end());
    return found;
  };
  const auto triangles_at = [&](const std::set<Index>& of) {
    std::set<Index> found;
    for (const Index v : of) found.insert(around_[v].begin(), around_[v].end());
    return found;
  };
  const std::set<Index> core(seeds.begin(), seeds.end()), first = corners_of(core),
                        second = corners_of(triangles_at(first)), ring = triangles_at(second);
  std::set<Index> chosen = ring;
  std::vector<Eigen::AlignedBox3d> boxes;
  Patch patch;
  for (const Index t : ring) {
    Eigen::AlignedBox3d box = box_of(t);
    const Vec3 margin = Vec3::Constant(2 * distance_);
    boxes.emplace_back(box.min() - margin, box.max() + margin);
    patch.box.extend(boxes.back());
  }
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
    if (done_.is_dropped[t]) continue;
    const Eigen::AlignedBox3d box = box_of(static_cast<Index>(t));
    if (patch.box.intersects(box) &&
        std::any_of(boxes.begin(), boxes.end(), [&](const auto& b) { return b.intersects(box); }))
      chosen.insert(static_cast<Index>(t));
  }
  std::map<Index, Index> number;
  for (const Index t : chosen) {
    Corners corners = mesh_.triangles[t];
    for (Index& v : corners) {
      const auto [found, is_new] = number.try_emplace(v, static_cast<Index>(vertices.size()));
      if (is_new) {
        vertices.push_back(v);
        patch.mesh.positions.push_back(mesh_.positions[v]);
        patch.is_inner.push_back(second.contains(v));
      }
      v = found->second;
    }
    triangles.push_back(t);
    patch.mesh.triangles.push_back(corners);
  }
  patch.is_border.assign(vertices.size(), 0);
  std::map<std::pair<Index, Index>, int> sides;
  for (const Corners& t : patch.mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) ++sides[std::minmax(t[k], t[(k + 1) % 3])];
  for (const auto& [edge, count] : sides)
    if (count == 1 && patch.is_inner[edge.first] && patch.is_inner[edge.second])
      patch.is_border[edge.first] = patch.is_border[edge.second] = 1;
  for (const Index v : first) seed_vertices.push_back(number.at(v));
  return patch;
}

std::vector<Change> LocalMender::changes(const Patch& patch, const std::vector<Index>& vertices,
                                         const std::vector<Index>& seed_vertices) const {
  std::vector<Change> found;
  const auto& x = patch.mesh.positions;
  std::set<Index> near(seed_vertices.begin(), seed_vertices.end());
  std::set<std::pair<Index, Index>> edges;
  for (const Corners& t : patch.mesh.triangles) {
    if (t == kNone || std::none_of(t.begin(), t.end(), [&](Index v) { return near.contains(v); })) continue;
    for (std::size_t k = 0; k < 3; ++k) edges.insert(std::minmax(t[k], t[(k + 1) % 3]));
  }
  for (const auto& [a, b] : edges) {
    if (!patch.is_inner[a] || !patch.is_inner[b]) continue;
    if ((x[a] - x[b]).norm() <= distance_) {
      const double length = (x[a] - x[b]).norm();
      found.push_back({Change::Kind::collapse, a, b, Vec3::Zero(), length});
      found.push_back({Change::Kind::collapse, b, a, Vec3::Zero(), length});
    }
    const std::vector<std::size_t> sides = patch.at_edge(a, b);
    if (sides.size() != 2) continue;
    const Index c = third(patch.mesh.triangles[sides[0]], a, b), d = third(patch.mesh.triangles[sides[1]], a, b);
    const double between = segment_distance(x[a], x[b], x[c], x[d]);
    if (between <= distance_) found.push_back({Change::Kind::flip, a, b, Vec3::Zero(), between});
  }
  constexpr std::array<double, 3> kShares{0.25, 0.5, 0.9};  // of the distance
  for (const Index v : near) {
    if (patch.is_border[v]) continue;
    Vec3 normal = Vec3::Zero(), mean = Vec3::Zero();
    std::vector<Vec3> ways;
    for (const Corners& t : patch.mesh.triangles)
      if (t != kNone && has(t, v)) normal += doubled_area_vector(patch.mesh, t);
    const std::set<Index> neighbors = patch.neighbors(v);
    if (neighbors.empty()) continue;
    for (const Index w : neighbors) mean += (x[w] - x[v]) / static_cast<double>(neighbors.size());
    for (const double share : kShares)
      for (const double sign : {-1.0, 1.0}) ways.push_back(sign * share * distance_ * normal.stableNormalized());
    const double length = mean.norm();
    if (length > 0)
      for (const double share : kShares) ways.push_back(mean * std::min(1.0, share * distance_ / length));
    for (const Vec3& way : ways)
      if ((x[v] + way - given_[vertices[v]]).norm() <= distance_)
        found.push_back({Change::Kind::move, v, kNoIndex, x[v] + way, way.norm()});
  }
  return found;
}

void LocalMender::accept(const Patch& patch, const std::vector<Change>& changes, const std::vector<Index>& triangles,
                         const std::vector<Index>& vertices) {
  for (const Change& change : changes) {
    done_.flipped_edges += change.kind == Change::Kind::flip;
    done_.moved_vertices += change.kind == Change::Kind::move;
  }
  std::set<Index> touched;
  std::vector<std::pair<Index, Corners>> replaced;
  for (std::size_t v = 0; v < vertices.size(); ++v)
    if (mesh_.positions[vertices[v]] != patch.mesh.positions[v])
      touched.insert(around_[vertices[v]].begin(), around_[vertices[v]].end());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    Corners now = patch.mesh.triangles[i];
    if (now != kNone)
      for (Index& v : now) v = vertices[v];
    if (now != mesh_.triangles[triangles[i]]) replaced.emplace_back(triangles[i], now);
  }
  for (const auto& [t, now] : replaced) touched.insert(t);
  for (const Index t : touched) {
    is_touched_[t] = 1;
    changed_.push_back(box_of(t));
  }
  for (std::size_t v = 0; v < vertices.size(); ++v) mesh_.positions[vertices[v]] = patch.mesh.positions[v];
  for (const auto& [t, now] : replaced) {
    for (const Index v : mesh_.triangles[t]) std::erase(around_[v], t);
    if (now == kNone) {
      done_.is_dropped[t] = 1;
      continue;
    }
    mesh_.triangles[t] = now;
    for (const Index v : now) around_[v].push_back(t);
  }
  for (const Index t : touched)
    if (!done_.is_dropped[t]) changed_.push_back(box_of(t));
}

bool LocalMender::is_hopeless(const std::vector<Index>& seeds) const {
  const auto found = failures_.find(seeds);
  if (found == failures_.end()) return false;
  const Failure& failure = found->second;
  return std::none_of(changed_.begin() + static_cast<std::ptrdiff_t>(failure.num_changed), changed_.end(),
                      [&](const Eigen::AlignedBox3d& box) { return box.intersects(failure.box); });
}

bool LocalMender::mend(const std::vector<Index>& seeds) {
  constexpr std::size_t kBest = 6;       // first changes for which a second one is tried
  constexpr int kMostPairSearches = 20;  // each takes up to a second on large patches
  if (is_hopeless(seeds)) return false;
  std::vector<Index> triangles, vertices, seed_vertices;
  const Patch patch = patch_around(seeds, triangles, vertices, seed_vertices);
  const PatchFaults given_faults = faults_of(patch);
  const Rating before = rating_of(given_faults, 0, goal_);
  struct Trial {
    Rating rating;
    PatchFaults faults;
    Patch patch;
    std::vector<Change> changes;
  };
  std::vector<Trial> trials;
  const auto try_all = [&](const Patch& from, const PatchFaults& known, const std::vector<Change>& first) {
    for (const Change& change : changes(from, vertices, seed_vertices)) {
      if (is_cancelled()) return;
      Patch changed = from;
      if (!changed.apply(change)) continue;
      std::vector<Change> all = first;
      all.push_back(change);
      double distance = 0;
      for (const Change& one : all) distance += one.distance;
      PatchFaults faults = faults_of(changed, &from, &known);
      const Rating rating = rating_of(faults, distance, goal_);
      trials.push_back({rating, std::move(faults), std::move(changed), std::move(all)});
    }
  };
  const auto best = [&] {
    return std::min_element(trials.begin(), trials.end(),
                            [](const Trial& a, const Trial& b) { return a.rating < b.rating; });
  };
  try_all(patch, given_faults, {});
  if (is_cancelled()) return false;
  if (!trials.empty() && best()->rating.faults >= before.faults && num_pair_searches_++ < kMostPairSearches) {
    std::stable_sort(trials.begin(), trials.end(),
                     [](const Trial& a, const Trial& b) { return a.rating < b.rating; });
    const std::vector<Trial> first(trials.begin(), trials.begin() + std::min(kBest, trials.size()));
    for (const Trial& trial : first) try_all(trial.patch, trial.faults, trial.changes);
  }
  if (is_cancelled()) return false;
  if (trials.empty() || best()->rating.faults >= before.faults) {
    failures_[seeds] = {patch.box, changed_.size()};
    return false;
  }
  const Trial& chosen = *best();
  accept(chosen.patch, chosen.changes, triangles, vertices);
  return true;
}

LocalMending LocalMender::run() {
  constexpr int kMostRounds = 30;
  constexpr std::size_t kMostFaults = 1000;
  for (int round = 0; round < kMostRounds; ++round) {
    const std::vector<std::vector<Index>> seeds = faults();
    if (is_cancelled() || seeds.empty() || seeds.size() > kMostFaults) break;
    is_touched_.assign(mesh_.triangles.size(), 0);
    bool has_changed = false;
    for (const std::vector<Index>& at : seeds) {
      if (std::any_of(at.begin(), at.end(), [&](Index t) { return is_touched_[t]; })) continue;
      has_changed = mend(at) || has_changed;
      if (is_cancelled()) break;
    }
    if (!has_changed) break;
  }
  return std::move(done_);
}

}  // namespace

bool is_manifold(std::span<const std::array<Index, 3>> triangles, std::size_t num_vertices) {
  for (const Corners& t : triangles)
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) return false;
  const std::vector<SurfaceHalfEdge> sides = sorted_half_edges(triangles, num_vertices);
  bool result = true;
  for_each_edge(sides, [&](std::span<const SurfaceHalfEdge> edge) {
    result = result && edge.size() <= 2 && (edge.size() == 1 || edge[0].forward != edge[1].forward);
  });
  if (!result) return false;
  // Fans are told apart by following them from triangle to triangle.
  CornerFans fans(triangles);
  for_each_edge(sides, [&](std::span<const SurfaceHalfEdge> edge) {
    if (edge.size() == 2) fans.join(edge[0], edge[1]);
  });
  std::vector<Index> fan(num_vertices, kNoIndex);
  for (std::size_t c = 0; c < fans.num_corners(); ++c) {
    Index& known = fan[triangles[c / 3][c % 3]];
    const Index own = fans.of(c);
    if (known == kNoIndex) known = own;
    if (known != own) return false;
  }
  return true;
}

void move_toward_fans(TriangleMesh& mesh, std::span<const Index> vertices, double distance) {
  constexpr double kShareOfEdge = 0.1, kLeastLean = 0.05;
  const std::set<Index> wanted(vertices.begin(), vertices.end());
  std::map<Index, std::set<Index>> neighbors;
  for (const auto& t : mesh.triangles)
    for (const Index v : t)
      if (wanted.contains(v)) neighbors[v].insert(t.begin(), t.end());
  std::vector<std::pair<Index, Vec3>> moved;
  for (auto& [v, around] : neighbors) {
    around.erase(v);
    Vec3 lean = Vec3::Zero();
    double shortest = 2 * distance / kShareOfEdge;
    for (const Index w : around) {
      const Vec3 edge = mesh.positions[w] - mesh.positions[v];
      shortest = std::min(shortest, edge.norm());
      lean += edge.stableNormalized() / static_cast<double>(around.size());
    }
    if (lean.norm() < kLeastLean) continue;
    moved.emplace_back(v, mesh.positions[v] + std::min(distance / 2, kShareOfEdge * shortest) * lean.normalized());
  }
  for (const auto& [v, position] : moved) mesh.positions[v] = position;
}

LocalMending mend_locally(TriangleMesh& mesh, double distance, MendingGoal goal,
                          const std::function<bool()>& cancelled) {
  return LocalMender(mesh, distance, goal, cancelled).run();
}

}  // namespace subvol::internal
