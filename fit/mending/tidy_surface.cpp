// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/mending/tidy_surface.h"

#include "subvol/base/format.h"
#include "subvol/base/sort_unique.h"
#include "subvol/surface/orientation.h"
#include "subvol/surface/welded_surface.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
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

/// Turns triangles that lie against the majority of their part, if the part can be oriented; parts end at edges of more
/// than two triangles. Returns how many.
std::size_t turn_minorities(TriangleMesh& surface) {
  std::vector<std::vector<TriangleNeighbor>> neighbors(surface.triangles.size());
  const std::vector<SurfaceHalfEdge> sides = sorted_half_edges(surface.triangles, surface.positions.size());
  for_each_edge(std::span(sides), [&](std::span<const SurfaceHalfEdge> edge) {
    if (edge.size() != 2) return;
    const bool disagrees = edge[0].forward == edge[1].forward;
    neighbors[edge[0].triangle].push_back({edge[1].triangle, disagrees});
    neighbors[edge[1].triangle].push_back({edge[0].triangle, disagrees});
  });
  return orient_parts(surface, neighbors).turned;
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
    sort_unique(vertices_);
    std::ranges::stable_sort(vertices_, {}, [&](Index v) { return positions_[v][axis_]; });
  }

  /// Returns the vertices inside the edge from a to b, in this order.
  std::vector<Index> on_edge(Index a, Index b) {
    const Vec3 &p = positions_[a], along = positions_[b] - p;
    const double length = along.norm();
    if (!(length > 2 * tolerance_) || num_tests_ > kMostTests) return {};
    const auto [low, high] = std::minmax(p[axis_], positions_[b][axis_]);
    auto at = std::ranges::lower_bound(vertices_, low - tolerance_, {}, [&](Index v) { return positions_[v][axis_]; });
    std::vector<std::pair<double, Index>> found;
    for (; at != vertices_.end() && positions_[*at][axis_] <= high + tolerance_; ++at) {
      ++num_tests_;
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
  std::vector<Index> vertices_;                           ///< ascending along the axis
  static constexpr std::size_t kMostTests = 300'000'000;  ///< a second; a surface that needs more is a soup
  std::size_t num_tests_ = 0;
};

/// An open edge, from a to b as its triangle runs, and the vertices inside it, in this order.
struct OpenEdge {
  Index a, b;
  std::vector<Index> inside;

  std::vector<Index> chain() const {
    std::vector<Index> all{a};
    all.insert(all.end(), inside.begin(), inside.end());
    all.push_back(b);
    return all;
  }
};

/// Calls visit(piece) for the parts of an edge between its vertices.
template <class Visit>
void for_each_piece(const OpenEdge& edge, const Visit& visit) {
  const std::vector<Index> chain = edge.chain();
  for (std::size_t i = 0; i + 1 < chain.size(); ++i) visit(edge_of(chain[i], chain[i + 1]));
}

/// Cuts triangles at the vertices that lie on their open edges, if a piece of the edge is a piece of exactly one other
/// edge then. Returns the number of cuts.
std::size_t cut_at_junctions(TriangleMesh& surface, double tolerance) {
  const std::vector<SurfaceHalfEdge> sides = sorted_half_edges(surface.triangles, surface.positions.size());
  std::vector<SurfaceHalfEdge> open;
  for_each_edge(std::span(sides), [&](std::span<const SurfaceHalfEdge> edge) {
    if (edge.size() == 1) open.push_back(edge[0]);
  });
  OpenVertices vertices(surface, open, tolerance);
  std::vector<OpenEdge> edges;
  std::map<Edge, Index> triangle_at;  // of each open edge
  std::vector<Edge> pieces;
  for (const SurfaceHalfEdge& side : open) {
    const auto [a, b] = side.forward ? std::pair(side.low, side.high) : std::pair(side.high, side.low);
    edges.push_back({a, b, vertices.on_edge(a, b)});
    for (const Index corner : surface.triangles[side.triangle]) std::erase(edges.back().inside, corner);
    for_each_piece(edges.back(), [&](const Edge& piece) { pieces.push_back(piece); });
    triangle_at[edge_of(a, b)] = side.triangle;
  }
  std::ranges::sort(pieces);
  std::size_t count = 0;
  for (const OpenEdge& edge : edges) {
    if (edge.inside.empty()) continue;
    bool closes = false, is_crowded = false;
    for_each_piece(edge, [&](const Edge& piece) {
      const auto sharing = std::ranges::upper_bound(pieces, piece) - std::ranges::lower_bound(pieces, piece);
      closes = closes || sharing == 2;
      is_crowded = is_crowded || sharing > 2;
    });
    if (!closes || is_crowded) continue;
    const Index t = triangle_at[edge_of(edge.a, edge.b)];
    const auto corners = surface.triangles[t];
    const Index apex = *std::ranges::find_if(corners, [&](Index v) { return v != edge.a && v != edge.b; });
    const std::vector<Index> chain = edge.chain();
    surface.triangles[t] = {chain[0], chain[1], apex};
    for (std::size_t i = 1; i + 1 < chain.size(); ++i) {
      surface.triangles.push_back({chain[i], chain[i + 1], apex});
      if (!surface.face_groups.empty()) surface.face_groups.of_face.push_back(surface.face_groups.of_face[t]);
    }
    const auto last = triangle_at.find(edge_of(edge.b, apex));
    if (last != triangle_at.end() && last->second == t) last->second = static_cast<Index>(surface.triangles.size() - 1);
    count += edge.inside.size();
  }
  return count;
}

}  // namespace

std::optional<TidySurface> tidy_surface(const TriangleMesh& surface, const SurfaceDiagnosis& diagnosis) {
  constexpr double kOpenEdgeTolerance = 1e-6;  // share of the diagonal; coordinates in single precision are as exact
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
    note(cut_at_junctions(tidy.surface, kOpenEdgeTolerance * diagnosis.diagonal),
         "vertex lies on the open edge of a triangle, which is cut there",
         "vertices lie on open edges of triangles, which are cut there");
  if (disagrees)
    note(turn_minorities(tidy.surface), "triangle disagrees with its part about the outside: turned",
         "triangles disagree with their parts about the outside: turned");
  if (tidy.done.empty()) return std::nullopt;
  return tidy;
}

}  // namespace subvol::internal
