// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/sort_unique.h"
#include "subvol/fit/geometry/box_pairs.h"
#include "subvol/fit/geometry/contact_overlay.h"
#include "subvol/fit/geometry/vertex_grid.h"
#include "subvol/surface/triangle_geometry.h"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>
#include <CGAL/exceptions.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <iterator>

namespace subvol::internal {

namespace {

/// The number of a vertex; none yet for a crossing of two edges.
struct OverlayNumber {
  Index value = kNoIndex;
};

using OverlayKernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using OverlayVertex = CGAL::Triangulation_vertex_base_with_info_2<OverlayNumber, OverlayKernel>;
using OverlayFace = CGAL::Constrained_triangulation_face_base_2<OverlayKernel>;
using Overlay = CGAL::Constrained_Delaunay_triangulation_2<
    OverlayKernel, CGAL::Triangulation_data_structure_2<OverlayVertex, OverlayFace>, CGAL::Exact_predicates_tag>;

using NumberedEdge = std::array<Index, 2>;  ///< its lower vertex number first

}  // namespace

void ContactBudget::spend(std::size_t tests) {
  constexpr std::size_t kMostTests = 300'000'000, kAskEvery = 1 << 16;
  num_tests_ += tests;
  num_since_asked_ += tests;
  if (num_tests_ > kMostTests) throw Spent();
  if (num_since_asked_ < kAskEvery) return;
  num_since_asked_ = 0;
  if (cancelled_ && cancelled_()) throw Spent();
}

EdgeVertices::EdgeVertices(std::span<const Index> vertices, std::span<const Vec3> positions, double distance)
    : distance_(distance) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const Index v : vertices) along_[axis].push_back({positions[v][axis], v});
    std::ranges::sort(along_[axis]);
  }
}

std::vector<Index> EdgeVertices::on_edge(Index a, Index b, std::span<const Vec3> positions,
                                         ContactBudget& budget) const {
  constexpr double kLeastEndShare = 1e-9, kOverlayDistanceRounding = 1e-6;
  const Vec3 &from = positions[a], &to = positions[b], along = to - from;
  const double length = along.norm();
  // The candidates are between two planes on both sides of the edge, perpendicular to the axis along which there are
  // the fewest.
  const Vec3 margin = Vec3::Constant(2 * distance_);
  const Vec3 low = from.cwiseMin(to) - margin, high = from.cwiseMax(to) + margin;
  std::span<const std::pair<double, Index>> near = along_[0];
  for (int axis = 0; axis < 3; ++axis) {
    const auto first = std::ranges::lower_bound(along_[axis], low[axis], {}, &std::pair<double, Index>::first);
    const auto last = std::ranges::upper_bound(along_[axis], high[axis], {}, &std::pair<double, Index>::first);
    if (static_cast<std::size_t>(last - first) <= near.size()) near = {first, last};
  }
  budget.spend(near.size());
  std::vector<std::pair<double, Index>> found;
  for (const auto& [coordinate, v] : near) {
    if (v == a || v == b) continue;
    const Vec3 offset = positions[v] - from;
    const double share = offset.dot(along) / along.squaredNorm();
    const double beside = (offset - share * along).norm();
    if (std::min(share, 1 - share) * length > std::max(kLeastEndShare * length, beside) &&
        beside <= distance_ * (1 + kOverlayDistanceRounding))
      found.push_back({share, v});
  }
  std::ranges::sort(found);
  std::vector<Index> sorted;
  for (const auto& [share, v] : found) sorted.push_back(v);
  return sorted;
}

/// A cluster in the making: its plane, its edges, the vertices at which they cross, and the triangulation of all.
class ContactOverlay::Cluster {
 public:
  Cluster(ContactOverlay& overlay, std::span<const Index> triangles) : overlay_(overlay), mesh_(overlay.mesh_) {
    for (const Index t : triangles) {
      const auto& [a, b, c] = mesh_.triangles[t];
      if (a != b && b != c && c != a) triangles_.push_back(t);
    }
  }

  bool is_empty() const { return triangles_.empty(); }

  /// Finds the plane. Returns false if some triangles do not lie in it.
  bool find_plane() {
    constexpr double kLeastPlanarCosine = 0.99;  // of the angle between normals
    const auto area_vector = [&](Index t) { return doubled_area_vector(mesh_, mesh_.triangles[t]); };
    const Index largest =
        *std::ranges::max_element(triangles_, {}, [&](Index t) { return area_vector(t).squaredNorm(); });
    normal_ = area_vector(largest).normalized();
    origin_ = mesh_.positions[mesh_.triangles[largest][0]];
    normal_.cwiseAbs().maxCoeff(&axis_);
    x_ = (axis_ + 1) % 3;
    y_ = (axis_ + 2) % 3;
    return std::ranges::all_of(triangles_, [&](Index t) {
      return std::abs(area_vector(t).dot(normal_)) >= kLeastPlanarCosine * area_vector(t).norm();
    });
  }

  void find_edges() {
    for (const Index t : triangles_)
      for (std::size_t e = 0; e < 3; ++e) {
        const Index a = mesh_.triangles[t][e], b = mesh_.triangles[t][(e + 1) % 3];
        vertices_.push_back(a);
        edges_.push_back({std::min(a, b), std::max(a, b)});
      }
    sort_unique(vertices_);
    sort_unique(edges_);
  }

  /// Adds the crossings of edges to the vertices: one for all that are near each other, where the triangulation would
  /// make several. A crossing of another cluster with both edges serves as well.
  void add_crossings() {
    Eigen::AlignedBox3d box;
    for (const Index v : vertices_) box.extend(mesh_.positions[v]);
    VertexGrid grid(box, overlay_.distance_);
    for (const Index v : vertices_) grid.add(v, mesh_.positions[v]);
    std::vector<Eigen::AlignedBox3d> boxes;
    for (const auto& [a, b] : edges_) boxes.push_back(seen_box({mesh_.positions[a], mesh_.positions[b]}));
    for (const auto& [i, j] : near_pairs(boxes)) {
      const auto crossing = crossing_of(edges_[i], edges_[j]);
      if (!crossing || vertex_near(*crossing, grid) != kNoIndex) continue;
      Index v = vertex_near(*crossing, overlay_.crossings_);
      if (v == kNoIndex) {
        v = new_vertex(*crossing);
        overlay_.crossings_.add(v, *crossing);
      }
      vertices_.push_back(v);
      grid.add(v, mesh_.positions[v]);
    }
  }

  /// Makes the triangulation. Returns false if two vertices are at one place of the plane.
  bool triangulate() {
    std::map<Index, Overlay::Vertex_handle> handles;
    for (const Index v : vertices_) {
      overlay_.budget_.spend(1);
      const Vec3& p = mesh_.positions[v];
      const Overlay::Vertex_handle handle = handles[v] = triangulation_.insert(OverlayKernel::Point_2(p[x_], p[y_]));
      if (handle->info().value != kNoIndex) return false;
      handle->info().value = v;
    }
    const EdgeVertices all(vertices_, mesh_.positions, overlay_.distance_);
    for (const auto& [a, b] : edges_) {
      Index last = a;
      for (const Index v : all.on_edge(a, b, mesh_.positions, overlay_.budget_)) {
        triangulation_.insert_constraint(handles[last], handles[v]);
        last = v;
      }
      triangulation_.insert_constraint(handles[last], handles[b]);
    }
    for (auto v = triangulation_.finite_vertices_begin(); v != triangulation_.finite_vertices_end(); ++v)
      if (v->info().value == kNoIndex) {
        v->info().value = new_vertex(on_plane(v->point().x(), v->point().y()));
        vertices_.push_back(v->info().value);
      }
    sort_unique(vertices_);
    return true;
  }

  /// Returns the vertices, of crossings as well, ascending.
  const std::vector<Index>& vertices() const { return vertices_; }

  /// Returns the faces of the triangulation, once for each triangle that has their center inside.
  std::vector<ContactPiece> pieces() {
    std::vector<std::array<Index, 3>> faces;
    std::vector<Vec3> centers;
    for (auto f = triangulation_.finite_faces_begin(); f != triangulation_.finite_faces_end(); ++f) {
      faces.push_back({f->vertex(0)->info().value, f->vertex(1)->info().value, f->vertex(2)->info().value});
      const auto& [a, b, c] = faces.back();
      centers.push_back((mesh_.positions[a] + mesh_.positions[b] + mesh_.positions[c]) / 3);
    }
    std::vector<Eigen::AlignedBox3d> boxes;
    for (const Index t : triangles_) {
      const auto& [a, b, c] = mesh_.triangles[t];
      boxes.push_back(seen_box({mesh_.positions[a], mesh_.positions[b], mesh_.positions[c]}));
    }
    for (const Vec3& center : centers) boxes.push_back(seen_box({center}));
    std::vector<ContactPiece> pieces;
    const auto num_triangles = static_cast<Index>(triangles_.size());
    for (const auto& [i, j] : near_pairs(boxes)) {
      if (i >= num_triangles || j < num_triangles) continue;
      const Index t = triangles_[i];
      const double side = side_of_triangle(t, centers[j - num_triangles]);
      if (side == 0) continue;
      std::array<Index, 3> corners = faces[j - num_triangles];
      if (side < 0) std::swap(corners[1], corners[2]);
      pieces.push_back({corners, t});
    }
    return pieces;
  }

 private:
  /// Returns the point of the plane that is seen along the axis at two coordinates.
  Vec3 on_plane(double x, double y) const {
    Vec3 p;
    p[x_] = x;
    p[y_] = y;
    p[axis_] = origin_[axis_] - (normal_[x_] * (x - origin_[x_]) + normal_[y_] * (y - origin_[y_])) / normal_[axis_];
    return p;
  }

  Index new_vertex(const Vec3& position) {
    mesh_.positions.push_back(position);
    return static_cast<Index>(mesh_.positions.size() - 1);
  }

  /// Returns the vertex of a grid nearest to a point within the distance; kNoIndex: none.
  Index vertex_near(const Vec3& point, const VertexGrid& grid) const {
    std::size_t tests = 0;
    const Index nearest = grid.nearest(point, tests);
    overlay_.budget_.spend(tests);
    return nearest;
  }

  /// Returns a box around points as they are seen along the axis.
  Eigen::AlignedBox3d seen_box(std::initializer_list<Vec3> points) const {
    Eigen::AlignedBox3d box;
    for (Vec3 p : points) {
      p[axis_] = 0;
      box.extend(p);
    }
    const Vec3 margin = Vec3::Constant(overlay_.distance_);
    return {box.min() - margin, box.max() + margin};
  }

  /// Returns the pairs of places of boxes that meet, the lower one first, ascending.
  std::vector<std::array<Index, 2>> near_pairs(std::span<const Eigen::AlignedBox3d> boxes) const {
    constexpr std::size_t kMostBoxPairs = 30'000'000;  // 240 MB
    std::vector<std::array<Index, 2>> pairs;
    for_each_box_pair(boxes, [&](Index a, Index b) {
      overlay_.budget_.spend(1);
      if (pairs.size() == kMostBoxPairs) throw ContactBudget::Spent();
      pairs.push_back({std::min(a, b), std::max(a, b)});
    });
    std::ranges::sort(pairs);
    return pairs;
  }

  /// Returns where two edges without a common end cross, seen along the axis.
  std::optional<Vec3> crossing_of(const NumberedEdge& edge, const NumberedEdge& other) const {
    if (edge[0] == other[0] || edge[0] == other[1] || edge[1] == other[0] || edge[1] == other[1]) return std::nullopt;
    const Vec3 &p = mesh_.positions[edge[0]], &q = mesh_.positions[other[0]];
    const Vec3 u = mesh_.positions[edge[1]] - p, v = mesh_.positions[other[1]] - q, w = q - p;
    const double det = u[x_] * v[y_] - u[y_] * v[x_];
    if (det == 0) return std::nullopt;
    const double s = (w[x_] * v[y_] - w[y_] * v[x_]) / det, t = (w[x_] * u[y_] - w[y_] * u[x_]) / det;
    if (!(s > 0 && s < 1 && t > 0 && t < 1)) return std::nullopt;
    return on_plane(p[x_] + s * u[x_], p[y_] + s * u[y_]);
  }

  /// Returns 0 for a point outside a triangle, seen along the axis; inside, 1 if its corners are seen counterclockwise,
  /// and -1 otherwise.
  double side_of_triangle(Index t, const Vec3& point) const {
    const auto area = [&](const Vec3& a, const Vec3& b, const Vec3& c) {
      return (b[x_] - a[x_]) * (c[y_] - a[y_]) - (b[y_] - a[y_]) * (c[x_] - a[x_]);
    };
    const auto& [a, b, c] = mesh_.triangles[t];
    const Vec3 &p = mesh_.positions[a], &q = mesh_.positions[b], &r = mesh_.positions[c];
    const double side = area(p, q, r) > 0 ? 1 : -1;
    const bool is_inside = side * area(p, q, point) > 0 && side * area(q, r, point) > 0 && side * area(r, p, point) > 0;
    return is_inside ? side : 0;
  }

  ContactOverlay& overlay_;
  TriangleMesh& mesh_;
  std::vector<Index> triangles_;  ///< those with three corners
  Vec3 normal_ = Vec3::UnitZ(), origin_ = Vec3::Zero();
  /// The axis along which the plane is steepest, and the other two, whose coordinates are as exact as they were.
  int axis_ = 2, x_ = 0, y_ = 1;
  std::vector<Index> vertices_;
  std::vector<NumberedEdge> edges_;
  Overlay triangulation_;
};

ContactOverlay::ContactOverlay(TriangleMesh& mesh, const Eigen::AlignedBox3d& box, double distance,
                               ContactBudget& budget)
    : mesh_(mesh), distance_(distance), budget_(budget), crossings_(box, distance) {}

std::optional<std::vector<ContactPiece>> ContactOverlay::cut(std::span<const Index> triangles) {
  Cluster cluster(*this, triangles);
  if (cluster.is_empty()) return std::vector<ContactPiece>();
  if (!cluster.find_plane()) return std::nullopt;
  cluster.find_edges();
  try {
    cluster.add_crossings();
    if (!cluster.triangulate()) return std::nullopt;
    for (const Index v : cluster.vertices()) clusters_of_[v].push_back(vertices_.size());
    vertices_.emplace_back(cluster.vertices(), mesh_.positions, distance_);
    return cluster.pieces();
  } catch (const CGAL::Failure_exception&) {  // an assertion inside CGAL
    return std::nullopt;
  }
}

const std::vector<Index>& ContactOverlay::inside(Index a, Index b) {
  const auto [it, is_new] = inside_.try_emplace({std::min(a, b), std::max(a, b)});
  if (!is_new) return it->second;
  const auto of_a = clusters_of_.find(a), of_b = clusters_of_.find(b);
  if (of_a == clusters_of_.end() || of_b == clusters_of_.end()) return it->second;
  std::vector<std::size_t> common;
  std::ranges::set_intersection(of_a->second, of_b->second, std::back_inserter(common));
  const auto& [low, high] = it->first;
  std::vector<Index> vertices;
  for (const std::size_t cluster : common)
    std::ranges::copy(vertices_[cluster].on_edge(low, high, mesh_.positions, budget_), std::back_inserter(vertices));
  if (common.size() > 1) {
    sort_unique(vertices);
    vertices = EdgeVertices(vertices, mesh_.positions, distance_).on_edge(low, high, mesh_.positions, budget_);
  }
  return it->second = std::move(vertices);
}

}  // namespace subvol::internal
