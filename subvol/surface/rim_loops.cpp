// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/surface/rim_loops.h"

#include "subvol/base/error.h"

#include <algorithm>
#include <string>
#include <tuple>
#include <utility>

namespace subvol::internal {

namespace {

RimEdge rim_edge(const SurfaceHalfEdge& side) {
  return {side.forward ? side.low : side.high, side.forward ? side.high : side.low, side.triangle};
}

/// Follows edges of one triangle from vertex to vertex.
class RimWalker {
 public:
  RimWalker(std::span<const RimEdge> edges, std::size_t num_vertices)
      : edges_(edges),
        leaving_(num_vertices),
        entering_(num_vertices),
        used_(edges.size(), 0),
        place_(num_vertices, kNotPassed) {
    for (std::size_t i = edges.size(); i-- > 0;) {
      leaving_[edges[i].from].push_back(i);
      entering_[edges[i].to].push_back(i);
    }
  }

  /// Returns the walks. May they turn, they also run along edges the other way, and need not close.
  std::vector<std::vector<RimEdge>> walks(bool may_turn) {
    for (std::size_t start = 0; start < edges_.size(); ++start) {
      if (used_[start]) continue;
      const RimEdge& first = edges_[start];
      follow(start, !may_turn || first.from < first.to, may_turn);
    }
    return std::move(walks_);
  }

 private:
  /// Walks from an edge until it is back there, and cuts off the loops that it closes on its way.
  void follow(std::size_t start, bool runs_forward, bool may_turn) {
    std::vector<std::pair<std::size_t, Index>> path;  // edges, and the vertices where they are entered
    Index at = runs_forward ? edges_[start].from : edges_[start].to;
    for (std::size_t next = start;;) {
      used_[next] = 1;
      place_[at] = path.size();
      path.emplace_back(next, at);
      runs_forward = edges_[next].from == at;
      at = runs_forward ? edges_[next].to : edges_[next].from;
      if (place_[at] != kNotPassed) {
        cut(path, place_[at]);
        if (path.empty()) return;
      }
      next = unused((runs_forward ? leaving_ : entering_)[at]);
      if (next == edges_.size() && may_turn) next = unused((runs_forward ? entering_ : leaving_)[at]);
      if (next < edges_.size()) continue;
      if (!may_turn) throw InputError("surface: the rim of a hole does not close at vertex " + std::to_string(at));
      cut(path, 0);
      return;
    }
  }

  /// Makes the end of a path a walk of its own.
  void cut(std::vector<std::pair<std::size_t, Index>>& path, std::size_t first) {
    std::vector<RimEdge>& walk = walks_.emplace_back();
    for (std::size_t i = first; i < path.size(); ++i) {
      walk.push_back(edges_[path[i].first]);
      place_[path[i].second] = kNotPassed;
    }
    path.resize(first);
  }

  /// Returns the first edge of those left at a vertex that is in no walk, or the number of edges.
  std::size_t unused(std::vector<std::size_t>& left) {
    while (!left.empty() && used_[left.back()]) left.pop_back();
    return left.empty() ? edges_.size() : left.back();
  }

  static constexpr std::size_t kNotPassed = static_cast<std::size_t>(-1);
  std::span<const RimEdge> edges_;
  std::vector<std::vector<std::size_t>> leaving_, entering_;  ///< edges of each vertex, the first one last
  std::vector<char> used_;
  std::vector<std::size_t> place_;  ///< of each vertex in the path
  std::vector<std::vector<RimEdge>> walks_;
};

}  // namespace

std::vector<std::vector<RimEdge>> rim_loops(const TriangleMesh& mesh) {
  std::vector<RimEdge> edges;
  const std::vector<SurfaceHalfEdge> sides = sorted_half_edges(mesh.triangles, mesh.positions.size());
  for_each_edge(std::span(sides), [&](std::span<const SurfaceHalfEdge> run) {
    if (run.size() == 1) edges.push_back(rim_edge(run[0]));
  });
  if (edges.empty()) return {};
  std::ranges::sort(edges, {}, [](const RimEdge& e) { return std::tuple(e.from, e.to, e.triangle); });
  return RimWalker(edges, mesh.positions.size()).walks(false);
}

std::vector<std::vector<RimEdge>> rim_walks(std::span<const SurfaceHalfEdge> rims, std::size_t num_vertices) {
  if (rims.empty()) return {};
  std::vector<RimEdge> edges;
  for (const SurfaceHalfEdge& side : rims) edges.push_back(rim_edge(side));
  return RimWalker(edges, num_vertices).walks(true);
}

}  // namespace subvol::internal
