// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/templates/edge_levels.h"

#include "subvol/surface/triangle_geometry.h"
#include "subvol/surface/welded_surface.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <iterator>
#include <numeric>
#include <span>
#include <utility>

namespace subvol::internal {

namespace {

/// The choice of the levels of edges along one axis that get a line.
class LevelChoice {
 public:
  LevelChoice(const std::vector<EdgeLevel>& levels, double diagonal, double tolerance, double size)
      : levels_(levels),
        tolerance_(tolerance),
        size_(size),
        least_length_(std::max(kLeastLevelLength * size, kLeastDiagonalShare * diagonal)) {}

  /// Inserts the levels that get one into lines, which are increasing.
  void add_to(std::vector<double>& lines) const {
    const std::vector<double> given = lines;
    std::vector<std::size_t> order(levels_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return levels_[a].length > levels_[b].length; });
    for (const std::size_t i : order) {
      const double at = levels_[i].position;
      const auto above = std::lower_bound(lines.begin(), lines.end(), at);
      if (above == lines.begin() || above == lines.end()) continue;
      if (std::min(at - *std::prev(above), *above - at) < kThinnestLevelCell * size_) continue;
      if (std::ranges::any_of(given, [&](double line) { return bounds_thin_part(levels_[i], line); }))
        lines.insert(above, at);
    }
  }

 private:
  // These lengths are in units of the size.
  static constexpr double kThinnestLevelCell = 1.0 / 12, kLeastLevelLength = 4, kMostThinPartWidth = 0.6;
  static constexpr std::ptrdiff_t kLeastTurns = 2;     // the rims at both ends of a hole
  static constexpr double kLeastDiagonalShare = 0.25;  // of the diagonal: a line passes through the whole part

  /// True if enough of a level's edges run close to edges on a line that is close, or if curves turn close to enough of
  /// these.
  bool bounds_thin_part(const EdgeLevel& level, double line) const {
    if (std::abs(level.position - line) >= kLeastLineGap * size_) return false;
    double length = 0;
    for (const EdgeLevel& other : levels_) {
      if (std::abs(other.position - line) > tolerance_ || other.length < least_length_) continue;
      const auto is_close = [&](const Vec3& p) {
        return std::ranges::any_of(other.segments, [&](const std::array<Vec3, 2>& segment) {
          return distance(p, segment) < kMostThinPartWidth * size_;
        });
      };
      if (std::ranges::count_if(sample(level.turns), is_close) >= kLeastTurns) return true;
      if (level.length < least_length_) continue;
      const std::vector<std::array<Vec3, 2>> segments = sample(level.segments);
      const double weight = static_cast<double>(level.segments.size()) / static_cast<double>(segments.size());
      for (const auto& [a, b] : segments)
        if (is_close((a + b) / 2)) length += weight * (b - a).norm();
      if (length >= least_length_) return true;
    }
    return false;
  }

  /// Returns all of some items, or some hundreds that are evenly spread: each is compared with all edges of a level.
  template <class Item>
  static std::vector<Item> sample(const std::vector<Item>& items) {
    constexpr std::size_t kLeastLevelSamples = 300;
    const std::size_t step = std::max<std::size_t>(1, items.size() / kLeastLevelSamples);
    std::vector<Item> some;
    for (std::size_t i = 0; i < items.size(); i += step) some.push_back(items[i]);
    return some;
  }

  static double distance(const Vec3& p, const std::array<Vec3, 2>& segment) {
    const Vec3 along = segment[1] - segment[0];
    const double share = std::clamp((p - segment[0]).dot(along) / along.squaredNorm(), 0.0, 1.0);
    return (segment[0] + share * along - p).norm();
  }

  const std::vector<EdgeLevel>& levels_;
  double tolerance_, size_, least_length_;
};

/// The sharp edges of a surface, in the coordinates of a frame.
struct SharpEdges {
  std::vector<Vec3> positions;  ///< of all vertices
  std::vector<std::array<Index, 2>> edges;
  std::vector<std::vector<Index>> neighbors;  ///< of each vertex, along sharp edges
};

/// Returns a vector along the normal of each triangle. One without area has that of the triangle across its longest
/// edge, as if it were cut off there, or zero if there is none.
/// sides  those of the mesh, sorted.
std::vector<Vec3> normals_across_slivers(const TriangleMesh& mesh, std::span<const SurfaceHalfEdge> sides) {
  constexpr double kSliverAreaShare = 1e-12;  // of the square of the longest edge
  constexpr int kMostSteps = 8;               // from sliver to sliver
  std::vector<Vec3> normals;
  std::vector<double> longest(mesh.triangles.size(), 0.0);  // squared; 0 for triangles with an area
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    const Vec3 &p = mesh.positions[a], &q = mesh.positions[b], &r = mesh.positions[c];
    normals.push_back(doubled_area_vector(mesh, mesh.triangles[t]));
    const double length = std::max({(q - p).squaredNorm(), (r - q).squaredNorm(), (p - r).squaredNorm()});
    if (normals[t].norm() <= kSliverAreaShare * length) longest[t] = length;
  }
  if (std::ranges::all_of(longest, [](double length) { return length == 0; })) return normals;
  std::vector<Index> across(mesh.triangles.size(), kNoIndex);
  for_each_edge(sides, [&](std::span<const SurfaceHalfEdge> edge) {
    if (edge.size() != 2) return;
    const double length = (mesh.positions[edge[0].high] - mesh.positions[edge[0].low]).squaredNorm();
    for (const std::size_t i : {0u, 1u})
      if (longest[edge[i].triangle] == length) across[edge[i].triangle] = edge[1 - i].triangle;
  });
  for (std::size_t t = 0; t < normals.size(); ++t) {
    if (longest[t] == 0) continue;
    auto at = static_cast<Index>(t);
    for (int step = 0; step < kMostSteps && at != kNoIndex && longest[at] > 0; ++step) at = across[at];
    normals[t] = at == kNoIndex || longest[at] > 0 ? Vec3::Zero() : normals[at];
  }
  return normals;
}

SharpEdges sharp_edges(const TriangleMesh& surface, const Mat3& frame) {
  constexpr double kSharpCosine = 0.766;  // 40 degrees
  const TriangleMesh mesh = welded(surface).mesh;
  SharpEdges sharp;
  for (const Vec3& p : mesh.positions) sharp.positions.push_back(frame.transpose() * p);
  sharp.neighbors.resize(mesh.positions.size());
  const std::vector<SurfaceHalfEdge> all_sides = sorted_half_edges(mesh.triangles, mesh.positions.size());
  const std::vector<Vec3> normals = normals_across_slivers(mesh, all_sides);
  for_each_edge(all_sides, [&](std::span<const SurfaceHalfEdge> sides) {
    if (sides.size() != 2) return;
    const Vec3 &a = normals[sides[0].triangle], &b = normals[sides[1].triangle];
    if (a.isZero(0) || b.isZero(0) || a.dot(b) > kSharpCosine * a.norm() * b.norm()) return;
    sharp.edges.push_back({sides[0].low, sides[0].high});
    sharp.neighbors[sides[0].low].push_back(sides[0].high);
    sharp.neighbors[sides[0].high].push_back(sides[0].low);
  });
  return sharp;
}

/// True if two sharp edges meet at a vertex without a corner, and neither leads farther along an axis, or neither
/// farther back.
bool is_turn(const SharpEdges& sharp, std::size_t vertex, Index axis, double tolerance) {
  constexpr double kSmoothTurnCosine = -0.64;  // cosine between the edges: 130 degrees
  if (sharp.neighbors[vertex].size() != 2) return false;
  const Vec3& p = sharp.positions[vertex];
  const auto direction_to = [&](std::size_t i) {
    return (sharp.positions[sharp.neighbors[vertex][i]] - p).normalized();
  };
  if (direction_to(0).dot(direction_to(1)) > kSmoothTurnCosine) return false;
  const auto leads_on = [&](double direction) {
    return std::ranges::any_of(sharp.neighbors[vertex], [&](Index w) {
      return direction * (sharp.positions[w][axis] - sharp.positions[vertex][axis]) >= tolerance;
    });
  };
  return !leads_on(1) || !leads_on(-1);
}

/// Makes one level of those whose positions agree.
std::vector<EdgeLevel> merged(std::vector<EdgeLevel> all, double tolerance) {
  std::ranges::stable_sort(all, std::less{}, &EdgeLevel::position);
  std::vector<EdgeLevel> levels;
  for (EdgeLevel& next : all) {
    if (levels.empty() || next.position - levels.back().position >= tolerance) {
      levels.push_back(std::move(next));
      continue;
    }
    EdgeLevel& level = levels.back();
    level.length += next.length;
    level.segments.insert(level.segments.end(), next.segments.begin(), next.segments.end());
    level.turns.insert(level.turns.end(), next.turns.begin(), next.turns.end());
  }
  return levels;
}

}  // namespace

std::array<std::vector<EdgeLevel>, 3> edge_levels(const TriangleMesh& surface, const Mat3& frame, double tolerance) {
  const double across = std::sqrt(1 - kAlongAxis * kAlongAxis);
  const SharpEdges sharp = sharp_edges(surface, frame);
  std::array<std::vector<EdgeLevel>, 3> levels;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto axis = static_cast<Index>(a);
    std::vector<EdgeLevel> all;
    for (const auto& [low, high] : sharp.edges) {
      const Vec3 &p = sharp.positions[low], &q = sharp.positions[high];
      const double length = (q - p).norm();
      if (std::abs(q[axis] - p[axis]) <= across * length)
        all.push_back({(p[axis] + q[axis]) / 2, length, {{p, q}}, {}});
    }
    for (std::size_t v = 0; v < sharp.positions.size(); ++v)
      if (is_turn(sharp, v, axis, tolerance)) all.push_back({sharp.positions[v][axis], 0, {}, {sharp.positions[v]}});
    levels[a] = merged(std::move(all), tolerance);
  }
  return levels;
}

void add_lines_at_levels(const std::vector<EdgeLevel>& levels, double diagonal, double tolerance, double size,
                         std::vector<double>& lines) {
  LevelChoice(levels, diagonal, tolerance, size).add_to(lines);
}

void empty_cells_at_chamfers(const VoxelGrid& grid, std::vector<double>& fractions) {
  constexpr double kLeastChamferFraction = 0.25, kMostChamferFraction = 0.75;  // of a cell that is cut along a diagonal
  std::array<std::vector<char>, 3> is_thin;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::vector<double>& lines = grid.lines[axis];
    const double size = lines[1] - lines[0];  // of a spare layer
    for (std::size_t i = 0; i + 1 < lines.size(); ++i)
      is_thin[axis].push_back(lines[i + 1] - lines[i] < kLeastLineGap * size);
  }
  for (std::size_t c = 0; c < fractions.size(); ++c) {
    if (fractions[c] < kLeastChamferFraction || fractions[c] > kMostChamferFraction) continue;
    const std::array<int, 3> at = grid.place(static_cast<Index>(c));
    int thin = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) thin += is_thin[axis][static_cast<std::size_t>(at[axis])];
    if (thin >= 2) fractions[c] = 0;
  }
}

}  // namespace subvol::internal
