// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/shell/border_planes.h"

#include "subvol/base/sort_unique.h"
#include "subvol/surface/triangle_geometry.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

namespace subvol {

using namespace internal;
namespace {

/// Returns the normal of the plane of some points, or nothing if they are not in one plane, or nearly on a line.
std::optional<Vec3> plane_of(std::span<const Index> vertices, std::span<const Vec3> positions, double tolerance) {
  constexpr double kLeastWidth = 1e-3;  // of the points, relative to their length
  if (vertices.size() < 3) return std::nullopt;
  Vec3 mean = Vec3::Zero();
  for (const Index v : vertices) mean += positions[v] / static_cast<double>(vertices.size());
  Mat3 spread = Mat3::Zero();
  for (const Index v : vertices) spread += (positions[v] - mean) * (positions[v] - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Mat3> axes(spread);  // eigenvalues ascend
  const Vec3& squares = axes.eigenvalues();
  if (!(squares[1] > kLeastWidth * kLeastWidth * squares[2])) return std::nullopt;
  const Vec3 normal = axes.eigenvectors().col(0);
  for (const Index v : vertices)
    if (!(std::abs(normal.dot(positions[v] - mean)) <= tolerance)) return std::nullopt;
  return normal;
}

/// A run of border edges, one after the other: the corners from which they start.
using Run = std::vector<Index>;

/// Finds the flat parts of a border.
class FlatBorders {
 public:
  FlatBorders(const PolygonMesh& surface, const SurfaceTopology& topology)
      : positions_(surface.positions), topology_(topology) {
    Eigen::AlignedBox3d box;
    for (const Vec3& p : surface.positions) box.extend(p);
    tolerance_ = box.isEmpty() ? 0 : kFlatShare * box.diagonal().norm();
  }
  std::vector<BorderPlane> find();

 private:
  std::vector<Run> loops() const;
  std::vector<Run> pieces_of(const Run& loop) const;
  std::optional<BorderPlane> plane_around(std::size_t first, const std::vector<Run>& pieces,
                                          std::vector<char>& is_taken) const;
  /// Returns the number of straight stretches of a piece.
  std::size_t num_stretches(const Run& piece) const;
  bool is_near(const BorderPlane& plane, const Run& piece) const;
  std::optional<BorderPlane> plane_of_run(const Run& run) const;
  Index from(Index corner) const { return topology_.corner_vertices[corner]; }
  Index to(Index corner) const { return topology_.corner_vertices[topology_.next(corner)]; }
  Vec3 way(Index corner) const { return (positions_[to(corner)] - positions_[from(corner)]).stableNormalized(); }
  Vec3 normal_of_face(Index corner) const;

  std::span<const Vec3> positions_;
  const SurfaceTopology& topology_;
  double tolerance_ = 0;
};

Vec3 FlatBorders::normal_of_face(Index corner) const {
  return doubled_area_vector(positions_, topology_.face(topology_.corner_faces[corner])).stableNormalized();
}

std::vector<Run> FlatBorders::loops() const {
  std::vector<Index> at(topology_.num_vertices(), kNoIndex);  // border edge that begins at each vertex
  for (std::size_t h = 0; h < topology_.twins.size(); ++h)
    if (topology_.twins[h] == kNoIndex) at[from(static_cast<Index>(h))] = static_cast<Index>(h);
  std::vector<Run> result;
  for (std::size_t v = 0; v < at.size(); ++v) {
    if (at[v] == kNoIndex) continue;
    Run& loop = result.emplace_back();
    for (auto next = static_cast<Index>(v); at[next] != kNoIndex; next = to(loop.back()))
      loop.push_back(std::exchange(at[next], kNoIndex));
  }
  return result;
}

/// Cuts a loop at its sharp turns.
std::vector<Run> FlatBorders::pieces_of(const Run& loop) const {
  constexpr double kTurnDegrees = 30;  // between two edges of a border
  const double least = std::cos(kTurnDegrees * std::numbers::pi / 180);
  const std::size_t n = loop.size();
  std::vector<std::size_t> turns;
  for (std::size_t i = 0; i < n; ++i)
    if (way(loop[i]).dot(way(loop[(i + n - 1) % n])) < least) turns.push_back(i);
  std::vector<Run> pieces;
  for (std::size_t k = 0; k < turns.size(); ++k) {
    const std::size_t last = k + 1 < turns.size() ? turns[k + 1] : turns[0] + n;
    Run& piece = pieces.emplace_back();
    for (std::size_t i = turns[k]; i < last; ++i) piece.push_back(loop[i % n]);
  }
  return pieces;
}

/// Returns the plane of a run, if it has one that the faces at the border do not lie in themselves.
std::optional<BorderPlane> FlatBorders::plane_of_run(const Run& run) const {
  constexpr double kMostAlike = 0.95;  // cosine of the angle between the normals of the plane and of a face
  BorderPlane plane{Vec3::Zero(), {}};
  for (const Index h : run) plane.vertices.insert(plane.vertices.end(), {from(h), to(h)});
  sort_unique(plane.vertices);
  const std::optional<Vec3> normal = plane_of(plane.vertices, positions_, tolerance_);
  if (!normal) return std::nullopt;
  for (const Index h : run)
    if (std::abs(normal->dot(normal_of_face(h))) > kMostAlike) return std::nullopt;
  plane.normal = *normal;
  return plane;
}

std::size_t FlatBorders::num_stretches(const Run& piece) const {
  constexpr double kStraightTurnSine = 1e-2;  // sine of the largest turn in a straight stretch
  std::size_t count = 1;
  Vec3 start = way(piece.front());
  for (const Index h : piece) {
    if (start.cross(way(h)).norm() <= kStraightTurnSine) continue;
    start = way(h);
    ++count;
  }
  return count;
}

bool FlatBorders::is_near(const BorderPlane& plane, const Run& piece) const {
  const Vec3& origin = positions_[plane.vertices.front()];
  return std::all_of(piece.begin(), piece.end(), [&](Index h) {
    return std::abs(plane.normal.dot(positions_[from(h)] - origin)) <= 2 * tolerance_ &&
           std::abs(plane.normal.dot(positions_[to(h)] - origin)) <= 2 * tolerance_;
  });
}

/// Returns the plane of a piece of a loop and its neighbors, as far as they are in one, and marks them as taken.
std::optional<BorderPlane> FlatBorders::plane_around(std::size_t first, const std::vector<Run>& pieces,
                                                     std::vector<char>& is_taken) const {
  constexpr std::size_t kLeastStretches = 3;  // two straight ones lie in a plane in any case
  Run run = pieces[first];
  std::optional<BorderPlane> plane = plane_of_run(run);
  std::vector<std::size_t> members{first};
  is_taken[first] = 1;
  std::size_t stretches = num_stretches(run);
  // A straight piece has a plane only together with its neighbors.
  for (const std::size_t step : {std::size_t{1}, pieces.size() - 1})
    for (std::size_t next = (first + step) % pieces.size(); !is_taken[next]; next = (next + step) % pieces.size()) {
      if (plane && !is_near(*plane, pieces[next])) break;
      run.insert(run.end(), pieces[next].begin(), pieces[next].end());
      if (!plane) plane = plane_of_run(run);
      if (!plane) {
        run.resize(run.size() - pieces[next].size());
        break;
      }
      members.push_back(next);
      is_taken[next] = 1;
      stretches += num_stretches(pieces[next]);
    }
  if (members.size() > 1) plane = plane_of_run(run);  // of all of them
  if (plane && stretches >= kLeastStretches) return plane;
  for (const std::size_t member : members) is_taken[member] = 0;
  return std::nullopt;
}

std::vector<BorderPlane> FlatBorders::find() {
  std::vector<BorderPlane> planes;
  for (const Run& loop : loops()) {
    if (std::optional<BorderPlane> plane = plane_of_run(loop)) {
      planes.push_back(std::move(*plane));
      continue;
    }
    const std::vector<Run> pieces = pieces_of(loop);
    std::vector<char> is_taken(pieces.size(), 0);
    for (std::size_t first = 0; first < pieces.size(); ++first)
      if (!is_taken[first])
        if (std::optional<BorderPlane> plane = plane_around(first, pieces, is_taken))
          planes.push_back(std::move(*plane));
  }
  return planes;
}

}  // namespace

std::vector<BorderPlane> flat_border_planes(const PolygonMesh& surface, const SurfaceTopology& topology) {
  return FlatBorders(surface, topology).find();
}

ColumnPlanes::ColumnPlanes(std::vector<BorderPlane> planes, std::size_t num_columns)
    : planes_(std::move(planes)), of_column_(num_columns, {kNoIndex, kNoIndex}) {
  for (std::size_t p = 0; p < planes_.size(); ++p)
    for (const Index v : planes_[p].vertices) {
      auto& [first, second] = of_column_[v];
      if (first == kNoIndex)
        first = static_cast<Index>(p);
      else if (second == kNoIndex)
        second = static_cast<Index>(p);
    }
}

std::size_t ColumnPlanes::num_columns() const {
  return static_cast<std::size_t>(
      std::count_if(of_column_.begin(), of_column_.end(), [](const auto& planes) { return planes[0] != kNoIndex; }));
}

void ColumnPlanes::release(Index column) { of_column_[column] = {kNoIndex, kNoIndex}; }

Mat3 ColumnPlanes::projector(std::span<const Index> columns) const {
  constexpr double kSameColumnPlaneSine = 1e-6;  // below it, two planes are one
  if (planes_.empty() || columns.empty()) return Mat3::Identity();
  std::array<Index, 2> common = of_column_[columns[0]];
  for (const Index column : columns)
    for (Index& plane : common)
      if (const auto& own = of_column_[column]; own[0] != plane && own[1] != plane) plane = kNoIndex;
  if (common[0] == kNoIndex) std::swap(common[0], common[1]);
  if (common[0] == kNoIndex) return Mat3::Identity();
  const Vec3& n = planes_[common[0]].normal;
  if (common[1] != kNoIndex) {
    const Vec3 line = n.cross(planes_[common[1]].normal);
    if (line.norm() > kSameColumnPlaneSine) return line.normalized() * line.normalized().transpose();
  }
  return Mat3::Identity() - n * n.transpose();
}

}  // namespace subvol
