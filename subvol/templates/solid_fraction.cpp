// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/templates/solid_fraction.h"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

namespace subvol::internal {

namespace {

// Lines are shifted by this, in units of their distance, to avoid the planes that hold the vertices of regular meshes:
// it is not a simple fraction of a cell.
constexpr double kShift = 0.0141421356237;

struct Crossing {
  Index line;
  double height;  ///< lattice coordinate
  int winding;    ///< +1: the line enters the solid on its way up
};

/// Twice the signed area of (a, b, p) in the plane. Callers pass the end of smaller number as a, so that both triangles
/// at an edge get the same bits.
double side_of(const Vec3& a, const Vec3& b, double x, double y) {
  return (b.x() - a.x()) * (y - a.y()) - (b.y() - a.y()) * (x - a.x());
}

class LineCrossings {
 public:
  LineCrossings(const TriangleMesh& surface, const VoxelGrid& grid, int num_lines, SearchStop* stop)
      : grid_(grid), stop_(stop), axes_{Axis(grid, 0, num_lines), Axis(grid, 1, num_lines)} {
    const Mat3 to_grid = grid.edges.inverse();
    points_.reserve(surface.positions.size());
    for (const Vec3& p : surface.positions) {
      Vec3 q = to_grid * (p - grid.origin);
      q.x() *= axes_[0].scale;
      q.y() *= axes_[1].scale;
      points_.push_back(q);
    }
    for (std::size_t t = 0; t < surface.triangles.size() && !(stop && stop->is_stopped_at(t)); ++t)
      add(surface.triangles[t]);
  }

  /// Crossings sorted by line, and from below along each line.
  const std::vector<Crossing>& sorted() {
    std::sort(crossings_.begin(), crossings_.end(), [](const Crossing& a, const Crossing& b) {
      return a.line != b.line ? a.line < b.line : a.height < b.height;
    });
    return crossings_;
  }

 private:
  /// Places of the lines along one axis.
  struct Axis {
    double scale = 1;            ///< factor from positions of the grid to places
    bool equal = true;           ///< true: line i is at i + 1/2 + kShift
    std::vector<double> places;  ///< increasing

    Axis(const VoxelGrid& grid, std::size_t axis, int num_lines)
        : scale(grid.lines[axis].empty() ? num_lines : 1), equal(grid.lines[axis].empty()) {
      const int count = grid.cells[axis] * num_lines;
      places.reserve(static_cast<std::size_t>(count));
      for (int i = 0; i < count; ++i)
        places.push_back(equal ? i + 0.5 + kShift : grid.position(axis, (i + 0.5 + kShift) / num_lines));
    }

    /// Range of the lines with low <= place <= high.
    std::pair<int, int> range(double low, double high) const {
      if (!equal)
        return {static_cast<int>(std::lower_bound(places.begin(), places.end(), low) - places.begin()),
                static_cast<int>(std::upper_bound(places.begin(), places.end(), high) - places.begin()) - 1};
      const double first = std::ceil(low - 0.5 - kShift), last = std::floor(high - 0.5 - kShift);
      const auto count = static_cast<double>(places.size());
      return {static_cast<int>(std::clamp(first, 0.0, count)), static_cast<int>(std::clamp(last, -1.0, count - 1))};
    }
  };

  void add(const std::array<Index, 3>& t) {
    const Vec3 &a = points_[t[0]], &b = points_[t[1]], &c = points_[t[2]];
    const auto [x0, x1] = axes_[0].range(std::min({a.x(), b.x(), c.x()}), std::max({a.x(), b.x(), c.x()}));
    if (x0 > x1) return;
    const auto [y0, y1] = axes_[1].range(std::min({a.y(), b.y(), c.y()}), std::max({a.y(), b.y(), c.y()}));
    if (y0 > y1) return;
    const Vec3 normal = (b - a).cross(c - a);
    const auto num_along_x = static_cast<Index>(axes_[0].places.size());
    for (int j = y0; j <= y1 && !is_stopped(); ++j)
      for (int i = x0; i <= x1; ++i) {
        const double x = axes_[0].places[i], y = axes_[1].places[j];
        const int side = common_side(t, x, y);
        if (side == 0 || normal.z() == 0) continue;
        const double height = a.z() - (normal.x() * (x - a.x()) + normal.y() * (y - a.y())) / normal.z();
        crossings_.push_back({i + num_along_x * j, grid_.coordinate(2, height), -side});
      }
  }

  /// Returns +1 or -1 if the point lies on that side of all three edges, else 0.
  int common_side(const std::array<Index, 3>& t, double x, double y) const {
    int sum = 0;
    for (std::size_t e = 0; e < 3; ++e) {
      const Index v = t[e], w = t[(e + 1) % 3];
      const Vec3 &a = points_[std::min(v, w)], &b = points_[std::max(v, w)];
      const int side = side_of(a, b, x, y) >= 0 ? 1 : -1;
      sum += v < w ? side : -side;
    }
    return sum == 3 ? 1 : sum == -3 ? -1 : 0;
  }

  bool is_stopped() const { return stop_ && stop_->is_stopped(); }

  const VoxelGrid& grid_;
  SearchStop* stop_;
  std::array<Axis, 2> axes_;
  std::vector<Vec3> points_;
  std::vector<Crossing> crossings_;
};

/// Adds the length of [low, high] within each cell of a column of cells.
void add_length(double low, double high, int count, Index first, Index stride, double weight,
                std::vector<double>& sums) {
  low = std::max(low, 0.0);
  high = std::min(high, double(count));
  if (!(low < high)) return;  // otherwise low or high may be too large for an integer
  for (int k = static_cast<int>(low); k < count && k < high; ++k)
    sums[first + stride * k] += weight * (std::min(high, k + 1.0) - std::max(low, double(k)));
}

}  // namespace

std::vector<double> solid_fractions(const TriangleMesh& surface, const VoxelGrid& grid, int num_lines,
                                    SearchStop* stop) {
  LineCrossings lines(surface, grid, num_lines, stop);
  if (stop && stop->is_stopped()) return std::vector<double>(grid.num_cells(), 0.0);
  const std::vector<Crossing>& crossings = lines.sorted();
  const Index lines_along_x = grid.cells[0] * num_lines, layer = grid.cells[0] * grid.cells[1];
  const double weight = 1.0 / (num_lines * num_lines);
  std::vector<double> fractions(grid.num_cells(), 0.0);
  for (std::size_t first = 0, last; first < crossings.size(); first = last) {
    const Index line = crossings[first].line;
    int total = 0;
    for (last = first; last < crossings.size() && crossings[last].line == line; ++last)
      total += crossings[last].winding;
    if (total != 0) continue;
    const Index column = grid.cell(line % lines_along_x / num_lines, line / lines_along_x / num_lines, 0);
    int winding = 0;
    for (std::size_t c = first; c + 1 < last; ++c) {
      winding += crossings[c].winding;
      if (winding > 0)
        add_length(crossings[c].height, crossings[c + 1].height, grid.cells[2], column, layer, weight, fractions);
    }
  }
  for (double& f : fractions) f = std::min(f, 1.0);
  return fractions;
}

}  // namespace subvol::internal
