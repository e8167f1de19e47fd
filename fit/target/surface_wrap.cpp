// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/target/surface_wrap.h"

#include "subvol/base/error.h"
#include "subvol/base/option_checks.h"
#include "subvol/fit/geometry/closest_point.h"
#include "subvol/fit/geometry/surface_distance.h"
#include "subvol/fit/target/carried_groups.h"
#include "subvol/surface/label_grid.h"
#include "subvol/surface/region_surface.h"
#include "subvol/surface/triangle_geometry.h"
#include "subvol/surface/winding_number.h"
#include "subvol/templates/label_surface.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

namespace subvol {

using namespace internal;

namespace {

constexpr double kLeastInsideWindingNumber = 0.5;  // from here on a point is inside: halfway between 0 and 1

/// Finds the voxels inside a surface.
class InsideVoxels {
 public:
  InsideVoxels(const TriangleMesh& surface, const ClosestPoint& tree, double voxel,
               const std::function<bool()>& cancelled)
      : winding_(surface), tree_(tree), voxel_(voxel), cancelled_(cancelled) {
    constexpr double kEmptyMarginVoxels = 2;  // on each side
    Vec3 low = surface.positions[surface.triangles[0][0]], high = low;
    for (const auto& triangle : surface.triangles)
      for (const Index v : triangle) {
        low = low.cwiseMin(surface.positions[v]);
        high = high.cwiseMax(surface.positions[v]);
      }
    grid_.edges = voxel * Mat3::Identity();
    grid_.origin = low - Vec3::Constant((kEmptyMarginVoxels - 0.5) * voxel);
    for (int a = 0; a < 3; ++a)
      grid_.counts[a] = static_cast<int>(std::ceil((high - low)[a] / voxel + 2 * kEmptyMarginVoxels));
    grid_.labels.assign(static_cast<std::size_t>(grid_.counts[0]) * static_cast<std::size_t>(grid_.counts[1]) *
                            static_cast<std::size_t>(grid_.counts[2]),
                        0);
  }

  /// Returns false if cancelled. The winding number varies slowly far from the surface: there one value stands for a
  /// block of voxels, and other blocks are halved.
  bool find();
  const LabelGrid& grid() const { return grid_; }

 private:
  using Place = std::array<int, 3>;  ///< of a voxel, or of the first one of a block

  Vec3 center(const Place& block, int size) const {
    return grid_.origin + voxel_ * (Vec3(block[0], block[1], block[2]) + Vec3::Constant(0.5 * (size - 1)));
  }
  void label(const Place& block, int size, bool is_inside);
  void add_halves(const Place& block, int size, std::vector<Place>& parts) const;

  WindingNumber winding_;
  const ClosestPoint& tree_;
  double voxel_;
  const std::function<bool()>& cancelled_;
  LabelGrid grid_;
};

void InsideVoxels::label(const Place& block, int size, bool is_inside) {
  std::array<int, 3> end;
  for (int a = 0; a < 3; ++a) end[a] = std::min(block[a] + size, grid_.counts[a]);
  for (int k = block[2]; k < end[2]; ++k)
    for (int j = block[1]; j < end[1]; ++j) {
      const std::size_t row =
          static_cast<std::size_t>(grid_.counts[0]) *
          (static_cast<std::size_t>(j) + static_cast<std::size_t>(grid_.counts[1]) * static_cast<std::size_t>(k));
      for (int i = block[0]; i < end[0]; ++i) grid_.labels[row + static_cast<std::size_t>(i)] = is_inside ? 1 : 0;
    }
}

void InsideVoxels::add_halves(const Place& block, int size, std::vector<Place>& parts) const {
  const int half = size / 2;
  for (int part = 0; part < 8; ++part) {
    const Place place{block[0] + (part & 1) * half, block[1] + (part >> 1 & 1) * half, block[2] + (part >> 2) * half};
    if (place[0] < grid_.counts[0] && place[1] < grid_.counts[1] && place[2] < grid_.counts[2]) parts.push_back(place);
  }
}

bool InsideVoxels::find() {
  constexpr int kFirstBlockSize = 8;                // voxels along the edges of the first blocks
  constexpr double kClearWindingDifference = 0.25;  // from 1/2
  constexpr double kClearRadii = 1.2;               // distance from the surface, in radii of a block
  constexpr std::size_t kBlocksAtOnce = 100'000;    // a fraction of a second
  std::vector<Place> blocks;
  for (int k = 0; k < grid_.counts[2]; k += kFirstBlockSize)
    for (int j = 0; j < grid_.counts[1]; j += kFirstBlockSize)
      for (int i = 0; i < grid_.counts[0]; i += kFirstBlockSize) blocks.push_back({i, j, k});
  std::vector<Vec3> centers;
  std::vector<ClosestPoint::Hit> hits;
  for (int size = kFirstBlockSize; !blocks.empty(); size /= 2) {
    const double radius = 0.5 * size * std::numbers::sqrt3 * voxel_;
    std::vector<Place> parts;
    for (std::size_t first = 0; first < blocks.size(); first += kBlocksAtOnce) {
      if (cancelled_ && cancelled_()) return false;
      const std::size_t end = std::min(first + kBlocksAtOnce, blocks.size());
      centers.clear();
      for (std::size_t b = first; b < end; ++b) centers.push_back(center(blocks[b], size));
      const std::vector<double> winding = winding_.at(centers);
      hits.assign(centers.size(), {});
      if (size > 1) tree_.closest(centers, hits);
      for (std::size_t b = first; b < end; ++b) {
        const double number = winding[b - first];
        const bool is_clear = hits[b - first].distance >= kClearRadii * radius &&
                              std::abs(number - kLeastInsideWindingNumber) >= kClearWindingDifference;
        if (size == 1 || is_clear)
          label(blocks[b], size, number >= kLeastInsideWindingNumber);
        else
          add_halves(blocks[b], size, parts);
      }
    }
    blocks = std::move(parts);
  }
  return true;
}

/// Moves vertices to their closest points on a surface where these are within `reach` and face the same way, and where
/// no triangle folds over or collapses.
void draw_to(const TriangleMesh& surface, const ClosestPoint& tree, double reach, TriangleMesh& wrap) {
  constexpr double kSameWay = 0.3, kLeastMovedAreaShare = 0.02;  // cosine of angles; of a triangle's area
  std::vector<Vec3> normals(wrap.positions.size(), Vec3::Zero());
  for (const auto& triangle : wrap.triangles)
    for (const Index v : triangle) normals[v] += doubled_area_vector(wrap, triangle);
  std::vector<ClosestPoint::Hit> hits(wrap.positions.size());
  tree.closest(wrap.positions, hits);
  TriangleMesh moved = wrap;
  for (std::size_t v = 0; v < hits.size(); ++v)
    if (hits[v].distance <= reach &&
        normals[v].normalized().dot(triangle_normal(surface, hits[v].triangle)) >= kSameWay)
      moved.positions[v] = hits[v].point;
  for (bool is_done = false; !is_done;) {
    is_done = true;
    for (const auto& triangle : wrap.triangles) {
      const Vec3 before = doubled_area_vector(wrap, triangle), after = doubled_area_vector(moved, triangle);
      const double cosine = before.normalized().dot(after.normalized());
      if (cosine >= kSameWay && after.norm() >= kLeastMovedAreaShare * before.norm()) continue;
      for (const Index v : triangle) {
        is_done = is_done && moved.positions[v] == wrap.positions[v];
        moved.positions[v] = wrap.positions[v];
      }
    }
  }
  wrap = std::move(moved);
}

}  // namespace

TriangleMesh wrap_surface(const TriangleMesh& surface, const WrapOptions& options,
                          const std::function<bool()>& cancelled) {
  constexpr double kWrapReachVoxels = 1.5;
  require_in_range("WrapOptions", "voxel_percent", options.voxel_percent, kLeastWrapPercent, kMostWrapPercent);
  const ClosestPoint tree(surface);
  const double voxel = options.voxel_percent / 100 * bounding_box_diagonal(surface);
  if (!(voxel > 0)) throw InputError("surface: it cannot be wrapped: all of it is at one point");
  InsideVoxels inside(surface, tree, voxel, cancelled);
  if (!inside.find()) return {};
  if (std::ranges::find(inside.grid().labels, 1) == inside.grid().labels.end())
    throw InputError("surface: it cannot be wrapped: nothing is inside it; do its triangles face outward?");
  TriangleMesh wrap = outer_surface(surface_of_labels(inside.grid(), {.cancelled = cancelled}));
  if (cancelled && cancelled()) return {};
  draw_to(surface, tree, kWrapReachVoxels * voxel, wrap);
  if (!surface.face_groups.groups.empty()) wrap.face_groups = groups_of_pieces(surface, wrap);
  return wrap;
}

}  // namespace subvol
