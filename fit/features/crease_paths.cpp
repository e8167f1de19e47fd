// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/crease_paths.h"

#include "subvol/fit/features/polyline.h"
#include "subvol/fit/geometry/closest_point.h"
#include "subvol/fit/geometry/site_tree.h"
#include "subvol/mesh/features.h"
#include "subvol/mesh/mesh_topology.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <queue>

namespace subvol::internal {

namespace {

/// As shares of a mean edge length: epsilon of a path's integral; largest distance of a corner from its vertex; largest
/// distance between a path and its curve; length below which a curve is skipped.
constexpr double kLengthShare = 0.05, kCornerShare = 1.0, kFollowShare = 0.75, kLeastCreaseLength = 0.25;
/// Number of vertices that are tried for an end at which a feature runs out.
constexpr std::size_t kNumTried = 4;

struct BoundaryGraph {
  std::vector<std::array<Index, 2>> edges;
  std::vector<std::vector<Index>> vertex_edges;  ///< per mesh vertex
  std::vector<Index> vertices;
  double mean_length = 0;

  BoundaryGraph(const VolumeMesh& mesh, PathEdges through) : vertex_edges(mesh.num_vertices()) {
    if (through == PathEdges::creases) {
      for (const CreaseEdge& crease : mesh.tags.creases) edges.push_back({crease.v0, crease.v1});
    } else {
      const MeshTopology topology(mesh);
      for (std::size_t e = 0; e < topology.num_edges(); ++e)
        if (topology.is_boundary_edge(static_cast<Index>(e))) edges.push_back(topology.edge(static_cast<Index>(e)));
    }
    for (std::size_t e = 0; e < edges.size(); ++e) {
      for (Index v : edges[e]) vertex_edges[v].push_back(static_cast<Index>(e));
      mean_length += (mesh.positions[edges[e][0]] - mesh.positions[edges[e][1]]).norm();
    }
    if (!edges.empty()) mean_length /= static_cast<double>(edges.size());
    for (std::size_t v = 0; v < vertex_edges.size(); ++v)
      if (!vertex_edges[v].empty()) vertices.push_back(static_cast<Index>(v));
  }
  Index other_end(Index e, Index v) const { return edges[e][0] == v ? edges[e][1] : edges[e][0]; }
};

class PathFinder {
 public:
  PathFinder(const VolumeMesh& mesh, const FeatureCurves& curves, PathEdges through)
      : mesh_(mesh), curves_(curves), graph_(mesh, through), taken_(mesh.num_vertices(), 0) {
    give_corners();
  }

  std::vector<CreasePath> paths() {
    struct Candidate {
      double gap;
      Index curve;
    };
    std::vector<Candidate> candidates;
    for (std::size_t c = 0; c < curves_.curves.size(); ++c)
      if (const auto found = follow(static_cast<Index>(c))) candidates.push_back({found->gap, static_cast<Index>(c)});
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& a, const Candidate& b) { return a.gap < b.gap; });
    std::vector<CreasePath> result;
    for (const Candidate& candidate : candidates) {
      const auto found = follow(candidate.curve);
      if (!found) continue;
      for (Index v : found->vertices) taken_[v] = 1;
      result.push_back({candidate.curve, found->vertices});
    }
    std::sort(result.begin(), result.end(), [](const CreasePath& a, const CreasePath& b) { return a.curve < b.curve; });
    return result;
  }

 private:
  struct Found {
    std::vector<Index> vertices;
    double gap;  ///< largest distance between path and curve / the path's mean edge length
  };

  /// Assigns corners to vertices, one to one.
  void give_corners() {
    struct Pair {
      double distance;
      Index corner, vertex;
      auto operator<=>(const Pair&) const = default;
    };
    std::vector<Pair> pairs;
    const FeatureCurves& curves = curves_;
    std::map<Index, Vec3> positions;
    for (const FeatureCurve& curve : curves.curves) {
      positions[curve.vertices.front()] = curve.points.front();
      positions[curve.vertices.back()] = curve.points.back();
    }
    std::vector<Vec3> sites;
    for (Index v : graph_.vertices) sites.push_back(mesh_.positions[v]);
    const SiteTree tree(sites);
    const double reach = kCornerShare * graph_.mean_length;
    std::vector<Index> near;
    for (std::size_t i = 0; i < curves.corners.size(); ++i) {
      if (curves.corner_edges[i] == 1) continue;
      const Index corner = curves.corners[i];
      const SiteTree::Ball ball{positions[corner], 1.01 * reach * reach};  // larger: the tree rounds differently
      near.clear();
      tree.gather({&ball, 1}, sites.size(), near);
      for (Index place : near) {
        const double distance = (tree.position(place) - ball.center).norm();
        if (distance < reach) pairs.push_back({distance, corner, graph_.vertices[tree.site(place)]});
      }
    }
    std::sort(pairs.begin(), pairs.end());
    for (const Pair& pair : pairs) {
      if (taken_[pair.vertex] || vertex_of_corner_.count(pair.corner)) continue;
      taken_[pair.vertex] = 1;
      vertex_of_corner_[pair.corner] = pair.vertex;
    }
  }

  Index vertex_at(Index corner) const {
    const auto at = vertex_of_corner_.find(corner);
    return at == vertex_of_corner_.end() ? kNoIndex : at->second;
  }

  std::optional<Found> follow(Index c) const {
    const FeatureCurve& curve = curves_.curves[c];
    if (curve.length() < kLeastCreaseLength * graph_.mean_length) return std::nullopt;
    if (curve.closed()) return around(curve);
    std::optional<Found> best;
    std::optional<std::vector<MiddlePlace>> middles;  // computed only if needed: most curves need none
    for (Index from : end_vertices(curve.vertices.front(), curve.points.front()))
      for (Index to : end_vertices(curve.vertices.back(), curve.points.back())) {
        if (from == to) continue;
        auto found = judged(shortest_path(curve.points, from, to, {}), curve.points);
        if (!found) {
          if (!middles) middles = middle_places(curve.points);
          found = judged(path_by_middle(curve.points, from, to, *middles), curve.points);
        }
        if (found && (!best || found->gap < best->gap)) best = std::move(found);
      }
    return best;
  }

  /// Returns the vertex assigned to a corner or, if a feature runs out there, the vertices nearby.
  std::vector<Index> end_vertices(Index corner, const Vec3& position) const {
    const auto at = std::lower_bound(curves_.corners.begin(), curves_.corners.end(), corner);
    if (curves_.corner_edges[at - curves_.corners.begin()] > 1) {
      const Index vertex = vertex_at(corner);
      return vertex == kNoIndex ? std::vector<Index>{} : std::vector<Index>{vertex};
    }
    std::vector<std::pair<double, Index>> near;
    for (Index v : graph_.vertices)
      if (!taken_[v]) near.push_back({(mesh_.positions[v] - position).norm(), v});
    const std::size_t n = std::min(kNumTried, near.size());
    std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(n), near.end());
    std::vector<Index> vertices;
    for (std::size_t i = 0; i < n; ++i) vertices.push_back(near[i].second);
    return vertices;
  }

  /// Returns the path with its gap if it follows the curve.
  std::optional<Found> judged(std::vector<Index> path, std::span<const Vec3> curve) const {
    if (path.size() < 2) return std::nullopt;
    std::vector<Vec3> points;
    for (Index v : path) points.push_back(mesh_.positions[v]);
    const double edge = polyline_length(points) / static_cast<double>(path.size() - 1);
    if (!(edge > 0)) return std::nullopt;
    const double gap = std::max(farthest(sampled_polyline(points, edge / 8), polyline_tree(curve)),
                                farthest(sampled_polyline(curve, edge / 8), polyline_tree(points))) /
                       edge;
    if (!(gap < kFollowShare)) return std::nullopt;
    return Found{std::move(path), gap};
  }

  /// Returns a path around a closed curve, from the vertex of its corner or the vertex nearest to it.
  std::optional<Found> around(const FeatureCurve& curve) const {
    const ClosestPoint tree = polyline_tree(curve.points);
    Index start = vertex_at(curve.vertices.front());
    double distance = kInfinity;
    for (Index v : graph_.vertices) {
      if (start != kNoIndex && distance == kInfinity) break;
      if (taken_[v]) continue;
      const double d = tree.closest(mesh_.positions[v]).distance;
      if (d < distance) distance = d, start = v;
    }
    if (start == kNoIndex) return std::nullopt;
    // The curve, starting at its point nearest to `start`.
    const ClosestPoint::Hit first = tree.closest(mesh_.positions[start]);
    std::vector<Vec3> points = {first.point};
    points.insert(points.end(), curve.points.begin() + first.triangle + 1, curve.points.end());
    points.insert(points.end(), curve.points.begin() + 1, curve.points.begin() + first.triangle + 1);
    points.push_back(first.point);
    return judged(path_by_middle(points, start, start, middle_places(points)), points);
  }

  /// A vertex and the point of a curve nearest to it.
  struct MiddlePlace {
    Index vertex;
    ClosestPoint::Hit hit;
  };

  /// Returns the vertices nearest to the middle half of the curve: enough that one is left if any two are excluded.
  std::vector<MiddlePlace> middle_places(std::span<const Vec3> points) const {
    constexpr std::size_t kEnoughMiddlePlaces = 3;  // one more than can be excluded
    std::vector<double> along = {0};
    for (std::size_t i = 1; i < points.size(); ++i) along.push_back(along.back() + (points[i] - points[i - 1]).norm());
    const ClosestPoint tree = polyline_tree(points);
    std::vector<MiddlePlace> nearest;
    for (Index v : graph_.vertices) {
      if (taken_[v]) continue;
      const ClosestPoint::Hit hit = tree.closest(mesh_.positions[v]);
      const double at = along[hit.triangle] + (hit.point - points[hit.triangle]).norm();
      if (at < along.back() / 4 || at > along.back() * 3 / 4) continue;
      const auto distance = [](const MiddlePlace& p) { return p.hit.distance; };
      const auto place = std::ranges::upper_bound(nearest, hit.distance, {}, distance);
      if (place == nearest.end() && nearest.size() == kEnoughMiddlePlaces) continue;
      nearest.insert(place, MiddlePlace{v, hit});
      if (nearest.size() > kEnoughMiddlePlaces) nearest.pop_back();
    }
    return nearest;
  }

  /// Returns a path through the vertex nearest to the curve's middle: for curves that are closed, or nearly so.
  std::vector<Index> path_by_middle(std::span<const Vec3> points, Index from, Index to,
                                    std::span<const MiddlePlace> places) const {
    const auto place =
        std::ranges::find_if(places, [&](const MiddlePlace& p) { return p.vertex != from && p.vertex != to; });
    if (place == places.end()) return {};
    const auto& [middle, meeting] = *place;
    const std::size_t split = static_cast<std::size_t>(meeting.triangle) + 1;
    std::vector<Vec3> out(points.begin(), points.begin() + split), back(points.begin() + split, points.end());
    out.push_back(meeting.point);
    back.insert(back.begin(), meeting.point);
    std::vector<Index> path = shortest_path(out, from, middle, {});
    if (path.size() < 2) return {};
    const std::vector<Index> rest = shortest_path(back, middle, to, path);
    if (rest.size() < 2) return {};
    path.insert(path.end(), rest.begin() + 1, rest.end());
    return path;
  }

  /// Dijkstra's algorithm from one vertex to another, through vertices that are neither taken nor in `avoid`. Empty if
  /// there is no path.
  std::vector<Index> shortest_path(std::span<const Vec3> points, Index from, Index to,
                                   std::span<const Index> avoid) const {
    const ClosestPoint tree = polyline_tree(points);
    const double epsilon = kLengthShare * graph_.mean_length;
    std::map<Index, double> squared;  // squared distances of the vertices visited
    const auto squared_distance = [&](const Vec3& p) { return std::pow(tree.closest(p).distance, 2); };
    const auto vertex_distance = [&](Index v) {
      const auto [at, added] = squared.try_emplace(v, 0.0);
      if (added) at->second = squared_distance(mesh_.positions[v]);
      return at->second;
    };
    std::map<Index, double> cost = {{from, 0.0}};
    std::map<Index, Index> previous;
    using Entry = std::pair<double, Index>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    queue.push({0, from});
    while (!queue.empty()) {
      const auto [reached, v] = queue.top();
      queue.pop();
      if (v == to) break;
      if (reached > cost[v]) continue;
      for (Index e : graph_.vertex_edges[v]) {
        const Index w = graph_.other_end(e, v);
        if (w != to && (taken_[w] || std::find(avoid.begin(), avoid.end(), w) != avoid.end())) continue;
        // Going back along the edge of the way out makes no cycle.
        if (w == to && avoid.size() == 2 && avoid.front() == w && v == from) continue;
        const Vec3 &a = mesh_.positions[v], &b = mesh_.positions[w];
        const double mean = (vertex_distance(v) + vertex_distance(w) + 2 * squared_distance(0.5 * (a + b))) / 4;
        const double next = reached + (a - b).norm() * (mean + epsilon * epsilon);
        const auto [at, added] = cost.try_emplace(w, kInfinity);
        if (next >= at->second) continue;
        at->second = next;
        previous[w] = v;
        queue.push({next, w});
      }
    }
    if (!previous.count(to)) return {};
    std::vector<Index> path = {to};
    while (path.back() != from) path.push_back(previous[path.back()]);
    std::reverse(path.begin(), path.end());
    return path;
  }

  const VolumeMesh& mesh_;
  const FeatureCurves& curves_;
  BoundaryGraph graph_;
  std::vector<char> taken_;  ///< vertices of corners and of paths found
  std::map<Index, Index> vertex_of_corner_;
};

}  // namespace

std::vector<CreasePath> follow_curves(const VolumeMesh& mesh, const FeatureCurves& curves, PathEdges through) {
  if (curves.empty()) return {};
  return PathFinder(mesh, curves, through).paths();
}

FeatureTags tags_of_paths(const std::vector<CreasePath>& paths, const FeatureCurves& curves) {
  FeatureTags tags;
  std::map<Index, int> ends;  // number of paths that end at the vertex of a corner of several sharp edges
  const auto is_corner = [&](Index v) {
    const auto at = std::lower_bound(curves.corners.begin(), curves.corners.end(), v);
    return at != curves.corners.end() && *at == v && curves.corner_edges[at - curves.corners.begin()] > 1;
  };
  for (const CreasePath& path : paths) {
    const FeatureCurve& curve = curves.curves[path.curve];
    for (std::size_t i = 0; i + 1 < path.vertices.size(); ++i)
      tags.creases.push_back({path.vertices[i], path.vertices[i + 1]});
    if (is_corner(curve.vertices.front())) ++ends[path.vertices.front()];
    if (is_corner(curve.vertices.back())) ++ends[path.vertices.back()];
  }
  for (const auto& [vertex, count] : ends)
    if (count > 1) tags.corners.push_back({vertex});
  return merge_tags(tags, {});
}

}  // namespace subvol::internal
