// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/mending/tidy_surface.h"

#include "subvol/base/format.h"
#include "subvol/surface/welded_surface.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cstdint>
#include <set>
#include <span>
#include <utility>

namespace subvol::internal {

namespace {

/// Returns the surface without the triangles that are marked.
TriangleMesh without(const TriangleMesh& surface, std::span<const std::uint8_t> dropped) {
  TriangleMesh result{surface.positions, {}};
  result.face_groups.groups = surface.face_groups.groups;
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    if (dropped[t]) continue;
    result.triangles.push_back(surface.triangles[t]);
    if (!surface.face_groups.empty()) result.face_groups.of_face.push_back(surface.face_groups.of_face[t]);
  }
  return result;
}

/// Drops triangles that are there more than once, the same way around. Returns how many.
std::size_t drop_repeated(TriangleMesh& surface) {
  std::set<std::array<Index, 3>> seen;
  std::vector<std::uint8_t> dropped(surface.triangles.size(), 0);
  std::size_t count = 0;
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    std::array<Index, 3> corners = surface.triangles[t];
    std::rotate(corners.begin(), std::ranges::min_element(corners), corners.end());
    dropped[t] = !seen.insert(corners).second;
    count += dropped[t];
  }
  if (count > 0) surface = without(surface, dropped);
  return count;
}

/// Turns triangles that lie against the majority of their part; parts end at edges of more than two triangles. Returns
/// how many; 0 if a part cannot be oriented.
std::size_t turn_minorities(TriangleMesh& surface) {
  const std::size_t num_triangles = surface.triangles.size();
  struct Neighbor {
    Index triangle;
    bool disagrees;
  };
  std::vector<std::vector<Neighbor>> neighbors(num_triangles);
  const std::vector<SurfaceHalfEdge> sides = sorted_half_edges(surface.triangles, surface.positions.size());
  for_each_edge(std::span(sides), [&](std::span<const SurfaceHalfEdge> edge) {
    if (edge.size() != 2) return;
    const bool disagrees = edge[0].forward == edge[1].forward;
    neighbors[edge[0].triangle].push_back({edge[1].triangle, disagrees});
    neighbors[edge[1].triangle].push_back({edge[0].triangle, disagrees});
  });
  enum class Turn : std::uint8_t { unknown, keep, turn };
  std::vector<Turn> turns(num_triangles, Turn::unknown);
  std::vector<Index> to_turn;
  for (std::size_t seed = 0; seed < num_triangles; ++seed) {
    if (turns[seed] != Turn::unknown) continue;
    turns[seed] = Turn::keep;
    std::vector<Index> part{static_cast<Index>(seed)}, turned;
    for (std::size_t i = 0; i < part.size(); ++i) {
      const Index t = part[i];
      if (turns[t] == Turn::turn) turned.push_back(t);
      for (const Neighbor& neighbor : neighbors[t]) {
        const Turn wanted = (turns[t] == Turn::turn) != neighbor.disagrees ? Turn::turn : Turn::keep;
        if (turns[neighbor.triangle] == Turn::unknown) {
          turns[neighbor.triangle] = wanted;
          part.push_back(neighbor.triangle);
        } else if (turns[neighbor.triangle] != wanted) {
          return 0;
        }
      }
    }
    const bool is_majority = 2 * turned.size() > part.size();
    for (const Index t : part)
      if ((turns[t] == Turn::turn) != is_majority) to_turn.push_back(t);
  }
  for (const Index t : to_turn) std::swap(surface.triangles[t][1], surface.triangles[t][2]);
  return to_turn.size();
}

using Edge = std::array<Index, 2>;  ///< ascending

Edge edge_of(Index a, Index b) { return {std::min(a, b), std::max(a, b)}; }

/// Finds the vertices of open edges that lie on other open edges.
class OpenVertices {
 public:
  OpenVertices(const TriangleMesh& surface, std::span<const SurfaceHalfEdge> open, double tolerance)
      : positions_(surface.positions), tolerance_(tolerance) {
    Eigen::AlignedBox3d box;
    for (const SurfaceHalfEdge& side : open)
      for (const Index v : {side.low, side.high}) {
        vertices_.push_back(v);
        box.extend(positions_[v]);
      }
    if (!box.isEmpty()) box.sizes().maxCoeff(&axis_);
    std::ranges::sort(vertices_);
    vertices_.erase(std::unique(vertices_.begin(), vertices_.end()), vertices_.end());
    std::ranges::stable_sort(vertices_, {}, [&](Index v) { return positions_[v][axis_]; });
  }

  /// Returns the vertices inside the edge from a to b, in this order.
  std::vector<Index> on_edge(Index a, Index b) const {
    const Vec3 &p = positions_[a], along = positions_[b] - p;
    const double length = along.norm();
    if (!(length > 2 * tolerance_)) return {};
    const auto [low, high] = std::minmax(p[axis_], positions_[b][axis_]);
    auto at = std::ranges::lower_bound(vertices_, low - tolerance_, {}, [&](Index v) { return positions_[v][axis_]; });
    std::vector<std::pair<double, Index>> found;
    for (; at != vertices_.end() && positions_[*at][axis_] <= high + tolerance_; ++at) {
      if (*at == a || *at == b) continue;
      const Vec3 offset = positions_[*at] - p;
      const double place = offset.dot(along) / length;
      if (place <= tolerance_ || place >= length - tolerance_) continue;
      if ((offset - place / length * along).norm() <= tolerance_) found.push_back({place, *at});
    }
    std::ranges::sort(found);
    std::vector<Index> vertices;
    for (const auto& [place, v] : found) vertices.push_back(v);
    return vertices;
  }

 private:
  std::span<const Vec3> positions_;
  double tolerance_;
  int axis_ = 0;
  std::vector<Index> vertices_;  ///< ascending along the axis
};

/// Cuts triangles at the vertices that lie on one of their open edges, each triangle once. Returns the number of
/// vertices at which it cuts.
std::size_t cut_once(TriangleMesh& surface, double tolerance) {
  const std::vector<SurfaceHalfEdge> sides = sorted_half_edges(surface.triangles, surface.positions.size());
  std::vector<SurfaceHalfEdge> open;
  for_each_edge(std::span(sides), [&](std::span<const SurfaceHalfEdge> edge) {
    if (edge.size() == 1) open.push_back(edge[0]);
  });
  const OpenVertices vertices(surface, open, tolerance);
  std::set<Edge> open_edges;
  for (const SurfaceHalfEdge& side : open) open_edges.insert({side.low, side.high});
  std::vector<std::uint8_t> is_cut(surface.triangles.size(), 0);
  std::size_t count = 0;
  for (const SurfaceHalfEdge& side : open) {
    if (is_cut[side.triangle]) continue;
    const auto corners = surface.triangles[side.triangle];
    std::size_t first = 0;  // the corner at which the edge begins
    while (edge_of(corners[first], corners[(first + 1) % 3]) != edge_of(side.low, side.high)) ++first;
    const Index a = corners[first], b = corners[(first + 1) % 3], apex = corners[(first + 2) % 3];
    std::vector<Index> chain = vertices.on_edge(a, b);
    std::erase(chain, apex);
    if (chain.empty()) continue;
    chain.insert(chain.begin(), a);
    chain.push_back(b);
    bool closes = false;
    for (std::size_t i = 0; i + 1 < chain.size(); ++i)
      closes = closes || open_edges.contains(edge_of(chain[i], chain[i + 1]));
    if (!closes) continue;
    is_cut[side.triangle] = 1;
    count += chain.size() - 2;
    surface.triangles[side.triangle] = {chain[0], chain[1], apex};
    for (std::size_t i = 1; i + 1 < chain.size(); ++i) {
      surface.triangles.push_back({chain[i], chain[i + 1], apex});
      if (!surface.face_groups.empty())
        surface.face_groups.of_face.push_back(surface.face_groups.of_face[side.triangle]);
    }
  }
  return count;
}

/// Cuts triangles at T-junctions. Returns the number of cuts.
std::size_t cut_at_junctions(TriangleMesh& surface, double tolerance) {
  constexpr int kMostPasses = 100;  // chains of junctions that take turns need several
  std::size_t all = 0;
  for (int pass = 0; pass < kMostPasses; ++pass) {
    const std::size_t count = cut_once(surface, tolerance);
    if (count == 0) break;
    all += count;
  }
  return all;
}

}  // namespace

std::optional<TidySurface> tidy_surface(const TriangleMesh& surface, const SurfaceDiagnosis& diagnosis) {
  constexpr double kOnEdge = 1e-6;  // share of the diagonal; coordinates in single precision are as exact
  const bool repeats = diagnosis.find(SurfaceFault::repeated_triangle) != nullptr;
  const bool disagrees = diagnosis.find(SurfaceFault::disagreement) && !diagnosis.find(SurfaceFault::interface);
  const bool is_open = diagnosis.find(SurfaceFault::open_rim) || diagnosis.find(SurfaceFault::pinhole);
  if (!repeats && !disagrees && !is_open) return std::nullopt;
  TidySurface tidy{welded(surface).mesh, {}};
  const auto note = [&](std::size_t count, const char* one, const char* several) {
    if (count > 0) tidy.done.push_back(formatted("target: %zu %s", count, count == 1 ? one : several));
  };
  if (repeats)
    note(drop_repeated(tidy.surface), "triangle repeats another one: dropped", "triangles repeat others: dropped");
  if (is_open)
    note(cut_at_junctions(tidy.surface, kOnEdge * diagnosis.diagonal),
         "vertex lies on the open edge of a triangle, which is cut there",
         "vertices lie on open edges of triangles, which are cut there");
  if (disagrees)
    note(turn_minorities(tidy.surface), "triangle disagrees with its part about the outside: turned",
         "triangles disagree with their parts about the outside: turned");
  if (tidy.done.empty()) return std::nullopt;
  return tidy;
}

}  // namespace subvol::internal
