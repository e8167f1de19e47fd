// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/surface/part_nesting.h"

#include "subvol/base/sort_unique.h"
#include "subvol/surface/triangle_geometry.h"
#include "subvol/surface/welded_surface.h"
#include "subvol/surface/winding_number.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

namespace subvol::internal {

namespace {

/// Finds the boxes that contain a box or a point: a tree with the largest box of each branch at its root.
class BoxTree {
 public:
  explicit BoxTree(std::span<const Eigen::AlignedBox3d> boxes)
      : boxes_(boxes), order_(boxes.size()), hulls_(boxes.size()) {
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    arrange(0, order_.size());
  }
  /// Returns true if a box other than this one contains it. Of equal boxes each contains the others.
  bool holds(const Eigen::AlignedBox3d& box) const {
    std::vector<std::size_t> found;
    return !gather(0, order_.size(), box, 1, found);
  }
  /// Appends the numbers of the boxes that contain a point to `found`; returns false if there are more than `most`,
  /// of which some are missing then.
  bool gather(const Vec3& x, std::size_t most, std::vector<std::size_t>& found) const {
    return gather(0, order_.size(), x, most, found);
  }

 private:
  /// A branch holds the boxes first .. last - 1: its root at `first`, and two branches of half of the others each.
  /// Returns the place where the second one begins.
  static std::size_t middle(std::size_t first, std::size_t last) { return first + 1 + (last - first - 1) / 2; }

  void arrange(std::size_t first, std::size_t last) {
    if (first == last) return;
    const auto at = [&](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
    for (std::size_t i = first; i < last; ++i) hulls_[first].extend(boxes_[order_[i]]);
    std::iter_swap(at(first), std::max_element(at(first), at(last), [&](std::size_t a, std::size_t b) {
                     return boxes_[a].diagonal().maxCoeff() < boxes_[b].diagonal().maxCoeff();
                   }));
    int axis = 0;
    hulls_[first].diagonal().maxCoeff(&axis);
    const std::size_t half = middle(first, last);
    std::nth_element(at(first + 1), at(half), at(last),
                     [&](std::size_t a, std::size_t b) { return boxes_[a].min()[axis] < boxes_[b].min()[axis]; });
    arrange(first + 1, half);
    arrange(half, last);
  }
  /// inner  a box or a point.
  template <class Inner>
  bool gather(std::size_t first, std::size_t last, const Inner& inner, std::size_t most,
              std::vector<std::size_t>& found) const {
    if (first == last || !hulls_[first].contains(inner)) return true;
    if (boxes_[order_[first]].contains(inner)) {
      if (found.size() == most) return false;
      found.push_back(order_[first]);
    }
    const std::size_t half = middle(first, last);
    return gather(first + 1, half, inner, most, found) && gather(half, last, inner, most, found);
  }

  std::span<const Eigen::AlignedBox3d> boxes_;
  std::vector<std::size_t> order_;          ///< numbers of the boxes
  std::vector<Eigen::AlignedBox3d> hulls_;  ///< bounding box of the branch that begins at each place
};

constexpr std::size_t kTriangles = 16;  // triangles of a part whose corners and centers are asked for
constexpr double kClearlyWhole = 0.2;   // farthest from a whole number: ten times the error of two winding numbers

/// The triangles of each part.
struct Parts {
  Parts(const TriangleMesh& surface, std::span<const int> part, int count)
      : mesh(surface), triangles(static_cast<std::size_t>(count)), boxes(static_cast<std::size_t>(count)) {
    for (std::size_t t = 0; t < part.size(); ++t) {
      triangles[part[t]].push_back(static_cast<Index>(t));
      for (Index v : mesh.triangles[t]) boxes[part[t]].extend(mesh.positions[v]);
    }
  }
  double volume(std::size_t p) const {
    const Vec3 origin = mesh.positions[mesh.triangles[triangles[p].front()][0]];
    double sum = 0;
    for (Index t : triangles[p]) sum += sixfold_volume(mesh.positions, mesh.triangles[t], origin);
    return sum / 6;
  }
  /// Returns a part's surface, turned outward.
  TriangleMesh outward(std::size_t p, double volume) const {
    TriangleMesh result;
    for (Index t : triangles[p]) {
      const auto first = static_cast<Index>(result.positions.size());
      for (Index v : mesh.triangles[t]) result.positions.push_back(mesh.positions[v]);
      result.triangles.push_back({first, first + 1, first + 2});
      if (volume < 0) std::swap(result.triangles.back()[1], result.triangles.back()[2]);
    }
    return result;
  }
  /// Returns centers and corners of triangles, evenly spread over the part's list; each corner once.
  std::vector<Vec3> points(std::size_t p) const {
    std::vector<Vec3> result;
    std::vector<Index> corners;
    const std::size_t n = triangles[p].size(), wanted = std::min(n, kTriangles);
    for (std::size_t i = 0; i < wanted; ++i) {
      const auto& [a, b, c] = mesh.triangles[triangles[p][i * n / wanted]];
      corners.insert(corners.end(), {a, b, c});
      result.emplace_back((mesh.positions[a] + mesh.positions[b] + mesh.positions[c]) / 3);
    }
    sort_unique(corners);
    for (const Index v : corners) result.push_back(mesh.positions[v]);
    return result;
  }

  const TriangleMesh& mesh;
  std::vector<std::vector<Index>> triangles;
  std::vector<Eigen::AlignedBox3d> boxes;
};

/// The least of the whole numbers near some values, or of all of them rounded if none is near one; >= 0. The value of a
/// point on another part's surface lies in the middle of two and is rounded up: such a part lies in the other.
class LeastWhole {
 public:
  void add(double value) {
    constexpr double kWindingError = 0.02;  // of two winding numbers
    const double whole = std::max(0.0, std::round(value)), upper = std::max(0.0, std::round(value + kWindingError));
    if (any_ < 0 || upper < any_) any_ = upper;
    if (std::abs(value - whole) <= kClearlyWhole && (clear_ < 0 || whole < clear_)) clear_ = whole;
  }
  int get() const { return static_cast<int>(std::max(0.0, clear_ >= 0 ? clear_ : any_)); }
  /// Returns true if no further value changes the result.
  bool is_final() const { return clear_ == 0; }

 private:
  double clear_ = -1, any_ = -1;
};

/// Finds parts that are closed: the winding number of such a part is zero outside its box. It takes more than two
/// triangles at each edge: as many must run one way as the other.
std::vector<char> closed_parts(const TriangleMesh& mesh, std::span<const int> part, std::size_t count) {
  std::vector<char> is_closed(count, 1);
  std::map<int, int> sum;  // at one edge, of each part
  const std::vector<SurfaceHalfEdge> sides = sorted_half_edges(mesh.triangles, mesh.positions.size());
  for_each_edge(sides, [&](std::span<const SurfaceHalfEdge> edge) {
    sum.clear();
    for (const SurfaceHalfEdge& side : edge) sum[part[side.triangle]] += side.forward ? 1 : -1;
    for (const auto& [p, difference] : sum)
      if (difference != 0) is_closed[p] = 0;
  });
  return is_closed;
}

/// Computes in how many other parts a part lies. A closed part counts at points in its box only. If a point lies in
/// many boxes, the winding number of all parts together costs less.
class Depths {
 public:
  Depths(const Parts& parts, const BoxTree& tree, std::span<const int> part, std::span<const double> volumes)
      : parts_(parts),
        tree_(tree),
        part_(part),
        volumes_(volumes),
        is_closed_(closed_parts(parts.mesh, part, volumes.size())),
        windings_(volumes.size()) {
    if (std::ranges::find(is_closed_, 0) != is_closed_.end())
      open_.emplace(outward([&](int p) { return !is_closed_[p]; }));
  }
  /// Returns the depth of a part.
  int of(std::size_t p) {
    LeastWhole least;
    for (const Vec3& x : parts_.points(p)) {
      least.add(winding_of_others(p, x));
      if (least.is_final()) break;
    }
    return least.get();
  }

 private:
  /// Returns the chosen parts, each of them turned outward.
  template <class Chosen>
  TriangleMesh outward(const Chosen& is_chosen) const {
    TriangleMesh result{parts_.mesh.positions, {}};
    for (std::size_t t = 0; t < part_.size(); ++t) {
      if (!is_chosen(part_[t])) continue;
      result.triangles.push_back(parts_.mesh.triangles[t]);
      if (volumes_[part_[t]] < 0) std::swap(result.triangles.back()[1], result.triangles.back()[2]);
    }
    return result;
  }
  const WindingNumber& winding(std::size_t p) {
    if (!windings_[p]) windings_[p].emplace(parts_.outward(p, volumes_[p]));
    return *windings_[p];
  }
  /// Returns the winding number at a point of a part, of all parts but this one.
  double winding_of_others(std::size_t p, const Vec3& x) {
    constexpr std::size_t kMostNearParts = 100;  // whose sum takes about as long as that of thousands together
    near_.clear();
    if (!tree_.gather(x, kMostNearParts, near_)) {
      if (!around_) around_.emplace(outward([](int) { return true; }));
      return around_->at(x) - winding(p).at(x);
    }
    double sum = open_ ? open_->at(x) : 0;
    if (!is_closed_[p]) sum -= winding(p).at(x);
    for (const std::size_t q : near_)
      if (q != p && is_closed_[q]) sum += winding(q).at(x);
    return sum;
  }

  const Parts& parts_;
  const BoxTree& tree_;
  std::span<const int> part_;
  std::span<const double> volumes_;
  std::vector<char> is_closed_;
  std::optional<WindingNumber> open_, around_;          ///< of the parts that are not closed, if any; of all parts
  std::vector<std::optional<WindingNumber>> windings_;  ///< of single parts
  std::vector<std::size_t> near_;
};

}  // namespace

PartNesting part_nesting(const TriangleMesh& mesh, std::span<const int> part, int count,
                         const std::function<bool()>& cancelled) {
  const Parts parts(mesh, part, count);
  PartNesting nesting;
  nesting.depths.assign(parts.triangles.size(), 0);
  for (std::size_t p = 0; p < parts.triangles.size(); ++p) nesting.volumes.push_back(parts.volume(p));
  const BoxTree tree(parts.boxes);
  std::vector<std::size_t> inner;
  for (std::size_t p = 0; p < parts.triangles.size(); ++p)
    if (tree.holds(parts.boxes[p])) inner.push_back(p);
  if (inner.empty()) return nesting;
  Depths depths(parts, tree, part, nesting.volumes);
  for (const std::size_t p : inner) {
    if (cancelled && cancelled()) break;
    nesting.depths[p] = depths.of(p);
  }
  return nesting;
}

int part_around(const TriangleMesh& mesh, std::span<const int> part, const PartNesting& nesting, int inner) {
  const Parts parts(mesh, part, static_cast<int>(nesting.depths.size()));
  const auto self = static_cast<std::size_t>(inner);
  int best = -1;
  for (std::size_t p = 0; p < parts.boxes.size(); ++p) {
    if (p == self || !parts.boxes[p].contains(parts.boxes[self])) continue;
    if (best >= 0 && std::abs(nesting.volumes[p]) >= std::abs(nesting.volumes[best])) continue;
    const WindingNumber winding(parts.outward(p, nesting.volumes[p]));
    LeastWhole least;
    for (const double value : winding.at(parts.points(self))) least.add(value);
    if (least.get() > 0) best = static_cast<int>(p);
  }
  return best;
}

}  // namespace subvol::internal
