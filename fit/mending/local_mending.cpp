// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/mending/local_mending.h"

#include "subvol/fit/mending/mending_patch.h"
#include "subvol/fit/mending/surface_faults.h"
#include "subvol/surface/boundary.h"
#include "subvol/surface/corner_fans.h"
#include "subvol/surface/triangle_geometry.h"
#include "subvol/surface/welded_surface.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <utility>

namespace subvol::internal {
namespace {

/// Pairs of a changed triangle and one near it at one fault, and at all of them, after which the search for changes
/// ends. A million of them take about 20 ms; a fault among triangles of the usual shape takes a sixth of that.
constexpr std::size_t kMostWorkAtFault = 10'000'000, kMostMendingWork = 500'000'000;
constexpr std::size_t kBoxesPerPair = 100;    ///< boxes that are compared in the time of one pair
constexpr std::size_t kTrianglesPerBox = 64;  ///< in succession along x

/// Mends one surface.
class LocalMender {
 public:
  LocalMender(TriangleMesh& mesh, double distance, MendingGoal goal, const std::function<bool()>& cancelled)
      : mesh_(mesh), distance_(distance), goal_(goal), cancelled_(cancelled), given_(mesh.positions) {
    done_.is_dropped.assign(mesh.triangles.size(), 0);
    around_.resize(mesh.positions.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      for (const Index v : mesh.triangles[t]) around_[v].push_back(static_cast<Index>(t));
    along_x_.resize(mesh.triangles.size());
    std::iota(along_x_.begin(), along_x_.end(), 0);
    const auto x = [&](Index t) { return mesh.positions[mesh.triangles[t][0]].x(); };
    std::ranges::stable_sort(along_x_, {}, x);
    run_of_.resize(along_x_.size());
    run_boxes_.resize((along_x_.size() + kTrianglesPerBox - 1) / kTrianglesPerBox);
    for (std::size_t i = 0; i < along_x_.size(); ++i) {
      run_of_[along_x_[i]] = i / kTrianglesPerBox;
      run_boxes_[i / kTrianglesPerBox].extend(box_of(along_x_[i]));
    }
  }
  LocalMending run();

 private:
  bool is_cancelled() { return done_.is_cancelled = done_.is_cancelled || (cancelled_ && cancelled_()); }
  /// Returns the triangles at each fault.
  std::vector<std::vector<Index>> faults() const;
  MendingPatch patch_around(const std::vector<Index>& seeds, std::vector<Index>& triangles,
                            std::vector<Index>& vertices, std::vector<Index>& seed_vertices) const;
  /// Changes of a patch, in order, that were tried.
  struct Trial {
    PatchRating rating;  ///< of the patch after them
    std::vector<MendingChange> changes;
    friend bool operator<(const Trial& a, const Trial& b) { return a.rating < b.rating; }
  };
  /// The patch around a fault, and what was tried there.
  struct ChangeSearch {
    MendingPatch patch;
    std::vector<Index> triangles, vertices;  ///< of the patch, in the surface
    std::vector<Index> seed_vertices;        ///< of the patch, at the fault
    std::vector<Vec3> given;                 ///< where the patch's vertices were at first
    std::vector<Trial> trials;
    std::size_t work = 0;  ///< as `work_`, at this fault

    const Trial& best() const { return *std::min_element(trials.begin(), trials.end()); }
  };
  ChangeSearch search_around(const std::vector<Index>& seeds) const;
  /// Tries all changes of a patch on which `first` were made.  known: its faults.
  void try_all(ChangeSearch& search, const PatchFaults& known, const std::vector<MendingChange>& first);
  /// Tries second changes after the best ones.  known: the faults before any change.
  void try_pairs(ChangeSearch& search, const PatchFaults& known);
  /// Makes the change at a fault that leaves the fewest; returns false if none helps.
  bool mend(const std::vector<Index>& seeds);
  /// Returns true if `mend` found no change at a fault before, and nothing has changed around it since.
  bool is_hopeless(const std::vector<Index>& seeds) const;
  Eigen::AlignedBox3d box_of(Index t) const {
    Eigen::AlignedBox3d box;
    for (const Index v : mesh_.triangles[t]) box.extend(mesh_.positions[v]);
    return box;
  }
  void accept(const MendingPatch& patch, const std::vector<MendingChange>& changes, const std::vector<Index>& triangles,
              const std::vector<Index>& vertices);

  TriangleMesh& mesh_;
  double distance_;
  MendingGoal goal_;
  const std::function<bool()>& cancelled_;
  std::vector<Vec3> given_;
  std::vector<std::vector<Index>> around_;      ///< triangles at each vertex
  std::vector<Index> along_x_;                  ///< triangles, by where they were at first
  std::vector<std::size_t> run_of_;             ///< of each triangle
  std::vector<Eigen::AlignedBox3d> run_boxes_;  ///< around each run of triangles, and where they were before
  std::vector<char> is_touched_;                ///< triangles that were changed in this round
  std::size_t work_ = 0;                        ///< done so far, in pairs of triangles tested
  int num_pair_searches_ = 0;                   ///< faults for which two changes at a time were tried
  std::vector<Eigen::AlignedBox3d> changed_;    ///< boxes of the triangles that changed, before and after, in order
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
    std::array<Index, 3> corners = mesh_.triangles[t];
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

MendingPatch LocalMender::patch_around(const std::vector<Index>& seeds, std::vector<Index>& triangles,
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
  const std::set<Index> core(seeds.begin(), seeds.end()),
      first = corners_of(core), second = corners_of(triangles_at(first)), ring = triangles_at(second);
  std::set<Index> chosen = ring;
  std::vector<Eigen::AlignedBox3d> boxes;
  MendingPatch patch;
  for (const Index t : ring) {
    Eigen::AlignedBox3d box = box_of(t);
    const Vec3 margin = Vec3::Constant(2 * distance_);
    boxes.emplace_back(box.min() - margin, box.max() + margin);
    patch.box.extend(boxes.back());
  }
  for (std::size_t run = 0; run < run_boxes_.size(); ++run) {
    if (!patch.box.intersects(run_boxes_[run])) continue;
    for (std::size_t i = run * kTrianglesPerBox; i < std::min((run + 1) * kTrianglesPerBox, along_x_.size()); ++i) {
      const Index t = along_x_[i];
      if (done_.is_dropped[t]) continue;
      const Eigen::AlignedBox3d box = box_of(t);
      if (patch.box.intersects(box) &&
          std::any_of(boxes.begin(), boxes.end(), [&](const auto& b) { return b.intersects(box); }))
        chosen.insert(t);
    }
  }
  std::map<Index, Index> number;
  for (const Index t : chosen) {
    std::array<Index, 3> corners = mesh_.triangles[t];
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
  for (const std::array<Index, 3>& t : patch.mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) ++sides[std::minmax(t[k], t[(k + 1) % 3])];
  for (const auto& [edge, count] : sides)
    if (count == 1 && patch.is_inner[edge.first] && patch.is_inner[edge.second])
      patch.is_border[edge.first] = patch.is_border[edge.second] = 1;
  for (const Index v : first) seed_vertices.push_back(number.at(v));
  patch.index();
  return patch;
}

void LocalMender::accept(const MendingPatch& patch, const std::vector<MendingChange>& changes,
                         const std::vector<Index>& triangles, const std::vector<Index>& vertices) {
  for (const MendingChange& change : changes) {
    done_.flipped_edges += change.kind == MendingChange::Kind::flip;
    done_.moved_vertices += change.kind == MendingChange::Kind::move;
  }
  std::set<Index> touched;
  std::vector<std::pair<Index, std::array<Index, 3>>> replaced;
  for (std::size_t v = 0; v < vertices.size(); ++v)
    if (mesh_.positions[vertices[v]] != patch.mesh.positions[v])
      touched.insert(around_[vertices[v]].begin(), around_[vertices[v]].end());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    std::array<Index, 3> now = patch.mesh.triangles[i];
    if (now != kDropped)
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
    if (now == kDropped) {
      done_.is_dropped[t] = 1;
      continue;
    }
    mesh_.triangles[t] = now;
    for (const Index v : now) around_[v].push_back(t);
  }
  for (const Index t : touched) {
    if (done_.is_dropped[t]) continue;
    changed_.push_back(box_of(t));
    run_boxes_[run_of_[t]].extend(changed_.back());
  }
}

bool LocalMender::is_hopeless(const std::vector<Index>& seeds) const {
  const auto found = failures_.find(seeds);
  if (found == failures_.end()) return false;
  const Failure& failure = found->second;
  return std::none_of(changed_.begin() + static_cast<std::ptrdiff_t>(failure.num_changed), changed_.end(),
                      [&](const Eigen::AlignedBox3d& box) { return box.intersects(failure.box); });
}

LocalMender::ChangeSearch LocalMender::search_around(const std::vector<Index>& seeds) const {
  ChangeSearch search;
  search.patch = patch_around(seeds, search.triangles, search.vertices, search.seed_vertices);
  for (const Index v : search.vertices) search.given.push_back(given_[v]);
  return search;
}

void LocalMender::try_all(ChangeSearch& search, const PatchFaults& known, const std::vector<MendingChange>& first) {
  MendingPatch& patch = search.patch;
  for (const MendingChange& change : possible_changes(patch, search.seed_vertices, search.given, distance_)) {
    if (is_cancelled() || search.work > kMostWorkAtFault || work_ > kMostMendingWork) return;
    PatchUndo replaced;
    if (!patch.apply(change, replaced)) continue;
    std::vector<MendingChange> all = first;
    all.push_back(change);
    double distance = 0;
    for (const MendingChange& one : all) distance += one.distance;
    const FaultsAfter after(patch, replaced, known);
    search.trials.push_back({after.rating(distance, goal_), std::move(all)});
    patch.undo(replaced);
    const std::size_t pairs = after.work() + patch.mesh.triangles.size() / kBoxesPerPair;
    search.work += pairs;
    work_ += pairs;
  }
}

void LocalMender::try_pairs(ChangeSearch& search, const PatchFaults& known) {
  constexpr std::size_t kMostFirstChanges = 6;  // for which a second one is tried
  std::vector<Trial>& trials = search.trials;
  std::stable_sort(trials.begin(), trials.end());
  const std::vector<Trial> first(trials.begin(), trials.begin() + std::min(kMostFirstChanges, trials.size()));
  for (const Trial& trial : first) {
    PatchUndo replaced;
    search.patch.apply(trial.changes[0], replaced);
    try_all(search, FaultsAfter(search.patch, replaced, known).faults(), trial.changes);
    search.patch.undo(replaced);
  }
}

bool LocalMender::mend(const std::vector<Index>& seeds) {
  constexpr int kMostPairSearches = 20;  // each takes up to a second on large patches
  if (is_hopeless(seeds)) return false;
  ChangeSearch search = search_around(seeds);
  MendingPatch& patch = search.patch;
  const PatchFaults given_faults = faults_of(patch);
  const PatchRating before = rating_of(given_faults, 0, goal_);
  const auto helps = [&] { return search.best().rating.faults < before.faults; };
  try_all(search, given_faults, {});
  if (is_cancelled()) return false;
  if (!search.trials.empty() && !helps() && num_pair_searches_++ < kMostPairSearches) try_pairs(search, given_faults);
  if (is_cancelled()) return false;
  if (search.trials.empty() || !helps()) {
    failures_[seeds] = {patch.box, changed_.size()};
    return false;
  }
  const std::vector<MendingChange> chosen = search.best().changes;
  for (const MendingChange& change : chosen) {
    PatchUndo replaced;
    patch.apply(change, replaced);
  }
  accept(patch, chosen, search.triangles, search.vertices);
  return true;
}

LocalMending LocalMender::run() {
  constexpr int kMostMendingRounds = 30;  // a round mends faults that do not touch one another
  // Number of faults above which nothing is mended: patches are meant for few.
  constexpr std::size_t kMostFaults = 1000;
  for (int round = 0; round < kMostMendingRounds; ++round) {
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
  for (const std::array<Index, 3>& t : triangles)
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
  // Largest move, as a share of the shortest edge at the vertex, and the length of the mean direction below which a fan
  // leans to no side.
  constexpr double kMostMoveShare = 0.1, kLeastLean = 0.05;
  const std::set<Index> wanted(vertices.begin(), vertices.end());
  std::map<Index, std::set<Index>> neighbors;
  for (const auto& t : mesh.triangles)
    for (const Index v : t)
      if (wanted.contains(v)) neighbors[v].insert(t.begin(), t.end());
  std::vector<std::pair<Index, Vec3>> moved;
  for (auto& [v, around] : neighbors) {
    around.erase(v);
    Vec3 lean = Vec3::Zero();
    double shortest = 2 * distance / kMostMoveShare;
    for (const Index w : around) {
      const Vec3 edge = mesh.positions[w] - mesh.positions[v];
      shortest = std::min(shortest, edge.norm());
      lean += edge.stableNormalized() / static_cast<double>(around.size());
    }
    if (lean.norm() < kLeastLean) continue;
    moved.emplace_back(v, mesh.positions[v] + std::min(distance / 2, kMostMoveShare * shortest) * lean.normalized());
  }
  for (const auto& [v, position] : moved) mesh.positions[v] = position;
}

LocalMending mend_locally(TriangleMesh& mesh, double distance, MendingGoal goal,
                          const std::function<bool()>& cancelled) {
  return LocalMender(mesh, distance, goal, cancelled).run();
}

}  // namespace subvol::internal
