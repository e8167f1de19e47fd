// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/target/enclosed_volume.h"

#include "subvol/surface/triangle_geometry.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace subvol::internal {

namespace {

/// Cells of a grid around the surface, with an empty layer on all sides.
class Grid {
 public:
  enum State : std::uint8_t { kUnknown, kSurface, kOutside };

  Grid(const Vec3& low, const Vec3& high, int resolution) {
    const double side = (high - low).maxCoeff();
    cell_ = side > 0 ? side / resolution : 1;
    origin_ = low - Vec3::Constant(cell_);
    for (int a = 0; a < 3; ++a) size_[a] = static_cast<int>(std::floor((high - low)[a] / cell_)) + 3;
    states_.assign(static_cast<std::size_t>(size_[0]) * size_[1] * size_[2], kUnknown);
  }

  double cell() const { return cell_; }
  void mark(const Vec3& point) {
    int at[3];
    for (int a = 0; a < 3; ++a) at[a] = static_cast<int>((point[a] - origin_[a]) / cell_);
    states_[number(at[0], at[1], at[2])] = kSurface;
  }

  void flood() {
    std::vector<std::array<int, 3>> open{{0, 0, 0}};
    states_[0] = kOutside;
    while (!open.empty()) {
      const auto at = open.back();
      open.pop_back();
      for (int axis = 0; axis < 3; ++axis)
        for (int step : {-1, 1}) {
          auto to = at;
          to[axis] += step;
          if (to[axis] < 0 || to[axis] >= size_[axis]) continue;
          State& state = states_[number(to[0], to[1], to[2])];
          if (state != kUnknown) continue;
          state = kOutside;
          open.push_back(to);
        }
    }
  }

  /// Zero if the flood has reached all cells that are not on the surface.
  double inside_volume() const {
    const auto inside = std::count(states_.begin(), states_.end(), kUnknown);
    const auto surface = std::count(states_.begin(), states_.end(), kSurface);
    return inside == 0 ? 0 : (static_cast<double>(inside) + 0.5 * static_cast<double>(surface)) * cell_ * cell_ * cell_;
  }

 private:
  std::size_t number(int i, int j, int k) const { return (static_cast<std::size_t>(k) * size_[1] + j) * size_[0] + i; }
  double cell_;
  Vec3 origin_;
  int size_[3];
  std::vector<State> states_;
};

}  // namespace

double signed_volume(std::span<const Vec3> positions, std::span<const std::array<Index, 3>> triangles) {
  if (triangles.empty()) return 0;
  const Vec3& origin = positions[triangles[0][0]];
  double sum = 0;
  for (const auto& t : triangles) sum += sixfold_volume(positions, t, origin);
  return std::abs(sum) / 6;
}

namespace {

/// Returns a grid around points, with `resolution` cells along its longest side.
template <class Points>
Grid grid_around(const Points& points, int resolution) {
  Vec3 low = *points.begin(), high = low;
  for (const Vec3& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return {low, high, resolution};
}

}  // namespace

double flooded_volume(std::span<const Vec3> positions, std::span<const std::array<Index, 3>> triangles,
                      int resolution) {
  if (triangles.empty()) return 0;
  std::vector<Vec3> corners;
  corners.reserve(3 * triangles.size());
  for (const auto& t : triangles)
    for (Index v : t) corners.push_back(positions[v]);
  Grid grid = grid_around(corners, resolution);
  // Samples a third of a cell apart leave no gap for the flood, which passes through faces of cells only.
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const Vec3 &a = corners[3 * t], u = corners[3 * t + 1] - a, v = corners[3 * t + 2] - a;
    const double longest = std::max({u.norm(), v.norm(), (u - v).norm()});
    const int n = static_cast<int>(std::ceil(3 * longest / grid.cell())) + 1;
    for (int i = 0; i <= n; ++i)
      for (int j = 0; j <= n - i; ++j)
        grid.mark(a + (static_cast<double>(i) / n) * u + (static_cast<double>(j) / n) * v);
  }
  grid.flood();
  return grid.inside_volume();
}

double flooded_volume(std::span<const Vec3> points, int resolution) {
  if (points.empty()) return 0;
  Grid grid = grid_around(points, resolution);
  for (const Vec3& p : points) grid.mark(p);
  grid.flood();
  return grid.inside_volume();
}

}  // namespace subvol::internal
