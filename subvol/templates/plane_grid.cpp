// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/templates/plane_grid.h"

#include "subvol/base/sort_unique.h"
#include "subvol/surface/triangle_geometry.h"
#include "subvol/templates/template_frames.h"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <numeric>
#include <set>
#include <utility>

namespace subvol::internal {

namespace {

constexpr double kLeastPlane = 0.5;  // smallest area of a plane with a line, in units of the squared size of a cell

Vec3 area_vector(const TriangleMesh& surface, const std::array<Index, 3>& t) {
  return doubled_area_vector(surface, t) / 2;
}

std::vector<Vec3> area_vectors(const TriangleMesh& surface) {
  std::vector<Vec3> areas;
  areas.reserve(surface.triangles.size());
  for (const auto& t : surface.triangles) areas.push_back(area_vector(surface, t));
  return areas;
}

double area_along(const Mat3& frame, const std::vector<Vec3>& areas) {
  const double widest = std::sqrt(1 - kAlongAxis * kAlongAxis);
  double sum = 0;
  for (const Vec3& area : areas) {
    const Vec3 along = (frame.transpose() * area).cwiseAbs();
    Index axis = 0;
    along.maxCoeff(&axis);
    const double across = std::hypot(along[(axis + 1) % 3], along[(axis + 2) % 3]);
    sum += std::max(0.0, area.norm() - across / widest);
  }
  return sum;
}

/// Sum, for each axis, of the areas whose normals are within a cosine of it, up to sign.
Mat3 facing_sums(const Mat3& frame, const std::vector<Vec3>& areas, double cosine) {
  Mat3 sums = Mat3::Zero();
  for (const Vec3& a : areas) {
    const Vec3 along = frame.transpose() * a;
    Index axis = 0;
    const double most = along.cwiseAbs().maxCoeff(&axis);
    if (most > 0 && most >= cosine * a.norm()) sums.col(axis) += along[axis] > 0 ? a : Vec3(-a);
  }
  return sums;
}

/// Turns a frame so that the axis that most area faces becomes the mean normal of this area, and another axis, as far
/// as it is perpendicular, that of its own.
Mat3 turned_onto(const Mat3& frame, const Mat3& sums) {
  std::array<Index, 3> order{0, 1, 2};
  const Vec3 sizes = sums.colwise().norm();
  std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) { return sizes[a] > sizes[b]; });
  if (!(sizes[order[0]] > 0)) return frame;
  Mat3 turned;
  const Vec3 first = sums.col(order[0]).normalized();
  const Vec3 second = sizes[order[1]] > 0 ? Vec3(sums.col(order[1])) : Vec3(frame.col(order[1]));
  turned.col(order[0]) = first;
  turned.col(order[1]) = (second - second.dot(first) * first).normalized();
  turned.col(order[2]) = turned.col(order[0]).cross(turned.col(order[1]));
  if (turned.determinant() < 0) turned.col(order[2]) *= -1;
  return turned;
}

/// Turns a frame onto the planes that are a few degrees from its axes, in steps that leave ever more of fillets out.
Mat3 turned_onto_planes(Mat3 frame, const std::vector<Vec3>& areas) {
  constexpr double kWidestAxisCone = 0.15, kNarrowestAxisCone = 2e-4;  // radians
  constexpr double kConeAngleFactor = 0.5;
  for (double angle = kWidestAxisCone; angle > kNarrowestAxisCone; angle *= kConeAngleFactor)
    frame = turned_onto(frame, facing_sums(frame, areas, std::cos(angle)));
  return frame;
}

/// A triangle along an axis.
struct AxisFacet {
  double position = 0, area = 0;  ///< area > 0 if it faces up
  Index triangle = 0;
};

std::vector<AxisFacet> facets_along(const TriangleMesh& surface, const Vec3& axis) {
  std::vector<AxisFacet> facets;
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const auto& [a, b, c] = surface.triangles[t];
    const Vec3 area = area_vector(surface, surface.triangles[t]);
    const double along = area.dot(axis);
    if (along == 0 || std::abs(along) < kAlongAxis * area.norm()) continue;
    // If all corners are at the same position, the rounded mean is exactly that.
    const double first = surface.positions[a].dot(axis);
    const double position =
        first + ((surface.positions[b].dot(axis) - first) + (surface.positions[c].dot(axis) - first)) / 3;
    facets.push_back({position, along, static_cast<Index>(t)});
  }
  std::sort(facets.begin(), facets.end(), [](const AxisFacet& a, const AxisFacet& b) {
    return a.position != b.position ? a.position < b.position : a.triangle < b.triangle;
  });
  return facets;
}

/// The plane of facets that are sorted by position.
template <class Iterator>
AxisPlane plane_of(Iterator first, Iterator last) {
  AxisPlane plane;
  for (auto f = first; f != last; ++f) {
    plane.area[f->area > 0] += std::abs(f->area);
    plane.triangles.push_back(f->triangle);
  }
  const double half = plane.whole_area() / 2;
  double below = 0;
  for (auto f = first; f != last && below <= half; ++f) {
    below += std::abs(f->area);
    plane.position = f->position;
  }
  return plane;
}

/// Sample points of a plane that its triangles cover.
///
/// The points form a square lattice, turned in the plane by an angle that keeps its rows off the edges of shapes along
/// the axes. Planes that are perpendicular to one axis have the same points, one above the other.
class PlaneSamples {
 public:
  using Point = std::array<std::int32_t, 2>;  // a grid that is not too large has fewer in a row

  PlaneSamples(const TriangleMesh& surface, const AxisPlanes& planes, std::size_t axis, double spacing)
      : surface_(surface), spacing_(spacing) {
    const Vec3 x = planes.frame.col((axis + 1) % 3), y = planes.frame.col((axis + 2) % 3);
    normal_ = planes.frame.col(axis);
    first_ = (kCosine * x - kSine * y) / spacing;
    second_ = (kSine * x + kCosine * y) / spacing;
    origin_ = planes.frame * planes.low;
  }

  /// Area of a plane's triangles that look up (or down) and of those of another that look the other way and lie
  /// opposite, as the number of samples on both.
  double facing_area(const AxisPlane& a, bool up, const AxisPlane& b) const {
    const std::vector<Point> on_a = covered(a, up), on_b = covered(b, !up);
    std::vector<Point> both;
    std::set_intersection(on_a.begin(), on_a.end(), on_b.begin(), on_b.end(), std::back_inserter(both));
    return static_cast<double>(both.size()) * spacing_ * spacing_;
  }

 private:
  static constexpr double kSine = 0.5257311121191336, kCosine = 0.8506508083520399;  // 1 : golden ratio

  /// Points on the triangles that look up, or down; sorted, each once.
  std::vector<Point> covered(const AxisPlane& plane, bool up) const {
    std::vector<Point> points;
    for (Index t : plane.triangles)
      if ((area_vector(surface_, surface_.triangles[t]).dot(normal_) > 0) == up) add(surface_.triangles[t], points);
    sort_unique(points);
    return points;
  }

  /// Appends the points (i, j) on a triangle, row by row.
  void add(const std::array<Index, 3>& t, std::vector<Point>& points) const {
    std::array<Eigen::Vector2d, 3> p;
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3 q = surface_.positions[t[i]] - origin_;
      p[i] = {q.dot(first_), q.dot(second_)};
    }
    const double low = std::min({p[0].y(), p[1].y(), p[2].y()}), high = std::max({p[0].y(), p[1].y(), p[2].y()});
    for (double y = std::ceil(low); y <= high; ++y) {
      double left = std::numeric_limits<double>::infinity(), right = -left;
      for (std::size_t e = 0; e < 3; ++e) {
        const Eigen::Vector2d &a = p[e], &b = p[(e + 1) % 3];
        if ((a.y() <= y) == (b.y() <= y)) continue;
        const double x = a.x() + (y - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
        left = std::min(left, x);
        right = std::max(right, x);
      }
      for (double x = std::ceil(left); x <= right; ++x)
        points.push_back({static_cast<std::int32_t>(x), static_cast<std::int32_t>(y)});
    }
  }

  const TriangleMesh& surface_;
  double spacing_;
  Vec3 normal_, first_, second_, origin_;
};

/// The choice of the planes along one axis that get a line.
class PlaneChoice {
 public:
  PlaneChoice(const TriangleMesh& surface, const AxisPlanes& all, std::size_t axis, double size)
      : least_area_(kLeastPlane * size * size),
        least_gap_(kLeastLineGap * size),
        samples_(surface, all, axis, size / kPlaneSamplesPerSize) {
    for (const AxisPlane& plane : all.planes[axis])
      if (plane.whole_area() > least_area_) planes_.push_back(&plane);
    choose();
  }

  /// Positions of the chosen planes, increasing.
  std::vector<double> positions() const {
    std::vector<double> result;
    for (std::size_t i : chosen_) result.push_back(planes_[i]->position);
    return result;
  }

 private:
  static constexpr double kPlaneSamplesPerSize = 4;  // of a cell

  bool close(std::size_t low, std::size_t high) const {
    return planes_[high]->position - planes_[low]->position < least_gap_;
  }

  /// True if two planes, the first below the second, bound a wall or a gap: enough of the one faces the other.
  bool bound_wall_or_gap(std::size_t low, std::size_t high) const {
    const AxisPlane &a = *planes_[low], &b = *planes_[high];
    for (const bool gap : {false, true})
      if (a.area[gap] >= least_area_ && b.area[!gap] >= least_area_ && samples_.facing_area(a, gap, b) >= least_area_)
        return true;
    return false;
  }

  bool may_be_next(std::size_t low, std::size_t high) const {
    return !close(low, high) || bound_wall_or_gap(low, high);
  }

  /// Chooses the planes from first to last if they fit between those chosen; returns false if they do not.
  bool choose(std::size_t first, std::size_t last) {
    const auto above = chosen_.upper_bound(first);
    if (above != chosen_.end() && (*above <= last || !may_be_next(last, *above))) return false;
    if (above != chosen_.begin() && !may_be_next(*std::prev(above), first)) return false;
    for (std::size_t i = first; i <= last; ++i) chosen_.insert(i);
    return true;
  }

  /// Chooses planes in the order of their areas. Neighbors that bound thin walls and gaps form a stack, which is chosen
  /// as a whole if it fits: only with all others does each of its planes bound a wall or gap.
  void choose() {
    std::vector<std::size_t> order(planes_.size()), first(planes_.size()), last(planes_.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    for (std::size_t i = 0; i < first.size(); ++i)
      first[i] = i > 0 && close(i - 1, i) && bound_wall_or_gap(i - 1, i) ? first[i - 1] : i;
    for (std::size_t i = last.size(); i-- > 0;)
      last[i] = i + 1 < last.size() && first[i + 1] == first[i] ? last[i + 1] : i;
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return planes_[a]->whole_area() > planes_[b]->whole_area(); });
    std::vector<char> tried(planes_.size(), 0);  // for the first plane of each stack
    for (std::size_t i : order) {
      const bool stack_tried = std::exchange(tried[first[i]], 1) != 0;
      if (chosen_.count(i) || (!stack_tried && choose(first[i], last[i]))) continue;
      choose(i, i);
    }
  }

  double least_area_, least_gap_;
  PlaneSamples samples_;
  std::vector<const AxisPlane*> planes_;  // those that are large enough, by position
  std::set<std::size_t> chosen_;
};

/// Positions of the planes along an axis that get a line, of the ends of the box, and of edges, increasing.
std::vector<double> key_lines(const TriangleMesh& surface, const AxisPlanes& all, std::size_t axis, double size) {
  std::vector<double> lines = PlaneChoice(surface, all, axis, size).positions();
  const double low = all.low[static_cast<Index>(axis)], high = all.high[static_cast<Index>(axis)];
  if (lines.empty()) return {low, high};
  const double below = lines.front() - low, above = high - lines.back(), least = kLeastLineGap * size;
  const bool single = lines.size() == 1;  // then one end at least is taken, however near
  if (below >= least || (single && below > above)) lines.insert(lines.begin(), low);
  if (above >= least || (single && below <= above)) lines.push_back(high);
  add_lines_at_levels(all.levels[axis], (all.high - all.low).norm(), all.tolerance, size, lines);
  return lines;
}

/// Number of equal parts between two lines.
double parts_between(double low, double high, double size) { return std::max(1.0, std::round((high - low) / size)); }

}  // namespace

Mat3 frame_along_planes(const TriangleMesh& surface) {
  constexpr double kClearlyMore = 1 + 1e-6;  // rounding turns a frame by less than that
  const std::vector<Vec3> areas = area_vectors(surface);
  const std::vector<Mat3> frames = template_frames(surface);
  Mat3 best = frames.front();
  double most = area_along(best, areas);
  const auto offer = [&](const Mat3& frame) {
    const double area = area_along(frame, areas);
    if (area > most * kClearlyMore) best = frame, most = area;
  };
  for (const Mat3& frame : frames) offer(frame);
  for (const Mat3& frame : frames) offer(turned_onto_planes(frame, areas));
  return best;
}

AxisPlanes axis_planes(const TriangleMesh& surface, const Mat3& frame) {
  constexpr double kCoplanar = 1e-5;  // of the diagonal: more than rounding in files, less than the thinnest walls
  AxisPlanes result;
  result.frame = frame;
  result.low.setConstant(std::numeric_limits<double>::infinity());
  result.high = -result.low;
  for (const auto& t : surface.triangles) {
    result.area += area_vector(surface, t).norm();
    for (Index v : t) {
      const Vec3 p = frame.transpose() * surface.positions[v];
      result.low = result.low.cwiseMin(p);
      result.high = result.high.cwiseMax(p);
    }
  }
  result.tolerance = kCoplanar * (result.high - result.low).norm();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::vector<AxisFacet> facets = facets_along(surface, frame.col(static_cast<Index>(axis)));
    for (auto first = facets.begin(), last = first; first != facets.end(); first = last) {
      while (last != facets.end() && last->position - first->position < result.tolerance) ++last;
      if (last == first) ++last;  // if the tolerance is zero to rounding
      result.planes[axis].push_back(plane_of(first, last));
    }
  }
  return result;
}

std::array<std::vector<double>, 3> lines_through_planes(const TriangleMesh& surface, const AxisPlanes& planes,
                                                        double size, double most) {
  constexpr double kMostPart = 1.5;  // widest of equal parts, in units of the size
  std::array<std::vector<double>, 3> keys, lines;
  const double fewest = ((planes.high - planes.low).array() / (kMostPart * size) + 2.0 * kSpareLayers).prod();
  if (!(fewest <= most)) return lines;  // known before any sampling
  double cells = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    keys[axis] = key_lines(surface, planes, axis, size);
    double count = 2.0 * kSpareLayers;
    for (std::size_t i = 0; i + 1 < keys[axis].size(); ++i)
      count += parts_between(keys[axis][i], keys[axis][i + 1], size);
    cells *= count;
  }
  if (!(cells <= most)) return lines;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i + 1 < keys[axis].size(); ++i) {
      const double low = keys[axis][i], high = keys[axis][i + 1], parts = parts_between(low, high, size);
      for (double part = 0; part < parts; ++part) lines[axis].push_back(std::lerp(low, high, part / parts));
    }
    lines[axis].push_back(keys[axis].back());
  }
  return lines;
}

double share_on_lines(const AxisPlanes& planes, const std::array<std::vector<double>, 3>& lines) {
  double sum = 0;
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const AxisPlane& plane : planes.planes[axis]) {
      const auto line = std::lower_bound(lines[axis].begin(), lines[axis].end(), plane.position - planes.tolerance);
      if (line != lines[axis].end() && *line <= plane.position + planes.tolerance) sum += plane.whole_area();
    }
  return std::min(1.0, sum / planes.area);
}

std::array<std::vector<double>, 3> with_spare_layers(std::array<std::vector<double>, 3> lines, double size) {
  for (std::vector<double>& at : lines)
    for (int layer = 0; layer < kSpareLayers; ++layer) {
      at.insert(at.begin(), at.front() - size);
      at.push_back(at.back() + size);
    }
  return lines;
}

}  // namespace subvol::internal
