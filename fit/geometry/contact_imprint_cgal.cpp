// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/disjoint_sets.h"
#include "subvol/base/sort_unique.h"
#include "subvol/fit/geometry/contact_imprint.h"
#include "subvol/surface/triangle_geometry.h"
#include "subvol/surface/welded_surface.h"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>
#include <CGAL/box_intersection_d.h>
#include <CGAL/exceptions.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

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

/// A box with a number: of a triangle, or of a vertex.
using ContactBox =
    CGAL::Box_intersection_d::Box_with_info_d<double, 3, Index, CGAL::Box_intersection_d::ID_FROM_BOX_ADDRESS>;

/// Thrown to end a search.
struct ContactSearchEnded {};

/// Calls visit(a, b) with the numbers of the boxes that meet, in no order of any meaning.
template <class Visit>
void for_each_meeting(const std::vector<ContactBox>& boxes, Visit&& visit) {
  std::vector<const ContactBox*> pointers;
  for (const ContactBox& box : boxes) pointers.push_back(&box);
  constexpr std::ptrdiff_t kCutoff = 200;  // boxes up to which all pairs are tested
  CGAL::box_self_intersection_d(
      pointers.begin(), pointers.end(), [&](const ContactBox* a, const ContactBox* b) { visit(a->info(), b->info()); },
      kCutoff);
}

ContactBox contact_box(std::span<const Vec3> points, double margin, Index number) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : points) box.extend(p);
  const Vec3 low = box.min() - Vec3::Constant(margin), high = box.max() + Vec3::Constant(margin);
  return {CGAL::Bbox_3(low.x(), low.y(), low.z(), high.x(), high.y(), high.z()), number};
}

using ContactCorners = std::array<Vec3, 3>;

/// Returns true if triangles overlap, seen along the normal of the larger one, by more than a strip of width `distance`
/// or than half of the smaller one, and are within `distance` of its plane there. The slivers at the rim of a round
/// contact may be narrower than the distance; walls beside it overlap by little of their area.
bool lie_on_each_other(const ContactCorners& a, const ContactCorners& b, double distance) {
  const auto area_vector = [](const ContactCorners& t) -> Vec3 { return (t[1] - t[0]).cross(t[2] - t[0]); };
  const Vec3 of_a = area_vector(a), of_b = area_vector(b);
  const bool a_is_larger = of_a.squaredNorm() >= of_b.squaredNorm();
  const ContactCorners& larger = a_is_larger ? a : b;
  const Vec3 normal = (a_is_larger ? of_a : of_b).normalized();
  const auto height = [&](const Vec3& p) { return normal.dot(p - larger[0]); };
  std::vector<Vec3> overlap(a_is_larger ? b.begin() : a.begin(), a_is_larger ? b.end() : a.end());
  const auto [low, high] = std::minmax({height(overlap[0]), height(overlap[1]), height(overlap[2])});
  if (low > distance || high < -distance) return false;
  for (std::size_t e = 0; e < 3 && !overlap.empty(); ++e) {
    const Vec3 inward = normal.cross(larger[(e + 1) % 3] - larger[e]);
    std::vector<Vec3> kept;
    for (std::size_t i = 0; i < overlap.size(); ++i) {
      const Vec3 &p = overlap[i], &q = overlap[(i + 1) % overlap.size()];
      const double from = inward.dot(p - larger[e]), to = inward.dot(q - larger[e]);
      if (from >= 0) kept.push_back(p);
      if ((from < 0 && to > 0) || (from > 0 && to < 0)) kept.push_back(p + from / (from - to) * (q - p));
    }
    overlap = std::move(kept);
  }
  Vec3 twice_area = Vec3::Zero();
  double length = 0;
  for (std::size_t i = 0; i < overlap.size(); ++i) {
    const Vec3 &p = overlap[i], &q = overlap[(i + 1) % overlap.size()];
    if (std::abs(height(p)) > distance) return false;
    twice_area += (p - overlap[0]).cross(q - overlap[0]);
    length += (q - p).norm();
  }
  const double smaller = std::min(of_a.norm(), of_b.norm());
  return std::abs(twice_area.dot(normal)) > std::min(distance * length, 0.5 * smaller);
}

/// Vertices by their coordinates.
class VerticesInBoxes {
 public:
  VerticesInBoxes(std::span<const Index> vertices, std::span<const Vec3> positions) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const Index v : vertices) along_[axis].push_back({positions[v][axis], v});
      std::ranges::sort(along_[axis]);
    }
  }

  /// Returns the vertices between two planes, perpendicular to the axis along which there are the fewest, on both sides
  /// of a box.
  std::vector<Index> between(const Vec3& low, const Vec3& high) const {
    std::span<const std::pair<double, Index>> least = along_[0];
    for (int axis = 0; axis < 3; ++axis) {
      const auto from = std::ranges::lower_bound(along_[axis], low[axis], {}, &std::pair<double, Index>::first);
      const auto to = std::ranges::upper_bound(along_[axis], high[axis], {}, &std::pair<double, Index>::first);
      if (static_cast<std::size_t>(to - from) <= least.size()) least = {from, to};
    }
    std::vector<Index> vertices;
    for (const auto& [coordinate, v] : least) vertices.push_back(v);
    return vertices;
  }

 private:
  std::array<std::vector<std::pair<double, Index>>, 3> along_;
};

/// The triangles of a surface while clusters of them are replaced.
class ContactImprint {
 public:
  explicit ContactImprint(TriangleMesh mesh) : mesh_(std::move(mesh)) {
    Eigen::AlignedBox3d box;
    for (const Vec3& p : mesh_.positions) box.extend(p);
    distance_ = box.isEmpty() ? 0 : kTouchingShare * box.diagonal().norm();
  }

  /// Finds the clusters. Returns false if there is none, or too many triangles are near each other.
  bool find_clusters(const std::function<bool()>& cancelled);
  /// Makes vertices of clusters one that are near each other.
  void join_near_vertices();
  /// Replaces the triangles of clusters. Returns false if that is not possible, or there are too many.
  bool replace_clusters();
  /// Cuts triangles at the vertices of clusters that lie on their edges. Returns false if there are too many.
  bool cut_at_vertices();
  TriangleMesh take() { return std::move(mesh_); }

 private:
  /// A triangle that replaces one of the surface.
  struct Piece {
    std::array<Index, 3> corners;
    Index of;  ///< the triangle that it is a piece of
  };
  ContactCorners corners(Index t) const {
    const auto& [a, b, c] = mesh_.triangles[t];
    return {mesh_.positions[a], mesh_.positions[b], mesh_.positions[c]};
  }
  std::optional<std::array<double, 2>> crossing_of(const std::array<Index, 2>& edge, const std::array<Index, 2>& other,
                                                   int x, int y) const;
  bool replace(const std::vector<Index>& cluster, std::vector<Piece>& pieces);
  void set_triangles(const std::vector<Piece>& pieces);
  std::vector<Index> on_edge(Index a, Index b, std::span<const Index> vertices) const;
  std::vector<Index> near_edge(Index a, Index b, const VerticesInBoxes& vertices);
  const std::vector<Index>& inside(Index a, Index b);
  std::vector<std::array<Index, 2>> near_pairs(const std::vector<ContactBox>& boxes);

  static constexpr std::size_t kMostTests = 300'000'000;  ///< of a point beside a triangle or edge: a second

  TriangleMesh mesh_;
  double distance_;  ///< within which triangles touch
  std::size_t num_tests_ = 0;
  std::vector<std::vector<Index>> clusters_;
  std::vector<VerticesInBoxes> vertices_;                      ///< of each cluster that was replaced
  std::map<Index, std::vector<std::size_t>> clusters_of_;      ///< places in vertices_ of each vertex of a cluster
  std::vector<Index> crossings_;                               ///< vertices at which edges of clusters cross
  std::map<std::array<Index, 2>, std::vector<Index>> inside_;  ///< vertices inside an edge, from its lower number on
};

bool ContactImprint::find_clusters(const std::function<bool()>& cancelled) {
  std::vector<ContactBox> boxes;
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t)
    boxes.push_back(contact_box(corners(static_cast<Index>(t)), distance_ / 2, static_cast<Index>(t)));
  DisjointSets sets(mesh_.triangles.size());
  std::vector<char> overlaps(mesh_.triangles.size(), 0);
  const auto have_same_corners = [&](Index t, Index s) {
    return std::ranges::is_permutation(mesh_.triangles[t], mesh_.triangles[s]);
  };
  try {
    for_each_meeting(boxes, [&](Index t, Index s) {
      constexpr std::size_t kAskEvery = 1 << 16;
      if (++num_tests_ > kMostTests || (num_tests_ % kAskEvery == 0 && cancelled && cancelled()))
        throw ContactSearchEnded();
      if (have_same_corners(t, s) || !lie_on_each_other(corners(t), corners(s), distance_)) return;
      sets.join(t, s);
      overlaps[t] = overlaps[s] = 1;
    });
  } catch (const ContactSearchEnded&) {
    return false;
  }
  std::map<Index, std::vector<Index>> members;
  for (std::size_t t = 0; t < overlaps.size(); ++t)
    if (overlaps[t]) members[sets.of(static_cast<Index>(t))].push_back(static_cast<Index>(t));
  for (auto& [first, cluster] : members) clusters_.push_back(std::move(cluster));
  return !clusters_.empty();
}

void ContactImprint::join_near_vertices() {
  std::vector<char> is_of_cluster(mesh_.positions.size(), 0);
  for (const std::vector<Index>& cluster : clusters_)
    for (const Index t : cluster)
      for (const Index v : mesh_.triangles[t]) is_of_cluster[v] = 1;
  std::vector<ContactBox> boxes;
  for (std::size_t v = 0; v < is_of_cluster.size(); ++v)
    if (is_of_cluster[v])
      boxes.push_back(contact_box(std::span(&mesh_.positions[v], 1), distance_ / 2, static_cast<Index>(v)));
  DisjointSets sets(mesh_.positions.size());
  for_each_meeting(boxes, [&](Index v, Index w) {
    if ((mesh_.positions[v] - mesh_.positions[w]).norm() <= distance_) sets.join(v, w);
  });
  for (auto& t : mesh_.triangles)
    for (Index& v : t) v = sets.of(v);
}

/// Returns those of some vertices that lie on an edge, and are nearer to it than to its ends, from a to b: an edge from
/// one to the next is shorter than the whole.
std::vector<Index> ContactImprint::on_edge(Index a, Index b, std::span<const Index> vertices) const {
  constexpr double kLeast = 1e-9, kRounding = 1e-6;
  const Vec3& from = mesh_.positions[a];
  const Vec3 along = mesh_.positions[b] - from;
  std::vector<std::pair<double, Index>> found;
  for (const Index v : vertices) {
    if (v == a || v == b) continue;
    const Vec3 offset = mesh_.positions[v] - from;
    const double share = offset.dot(along) / along.squaredNorm();
    const double beside = (offset - share * along).norm(), length = along.norm();
    if (std::min(share, 1 - share) * length > std::max(kLeast * length, beside) &&
        beside <= distance_ * (1 + kRounding))
      found.push_back({share, v});
  }
  std::ranges::sort(found);
  std::vector<Index> sorted;
  for (const auto& [share, v] : found) sorted.push_back(v);
  return sorted;
}

/// Returns some vertices, among them all that `on_edge` may return.
std::vector<Index> ContactImprint::near_edge(Index a, Index b, const VerticesInBoxes& vertices) {
  const Vec3 &p = mesh_.positions[a], &q = mesh_.positions[b];
  const Vec3 margin = Vec3::Constant(2 * distance_);
  std::vector<Index> near = vertices.between(p.cwiseMin(q) - margin, p.cwiseMax(q) + margin);
  num_tests_ += near.size();
  return near;
}

/// Returns where two edges without a common end cross, seen along an axis, as coordinates x and y.
std::optional<std::array<double, 2>> ContactImprint::crossing_of(const std::array<Index, 2>& edge,
                                                                 const std::array<Index, 2>& other, int x,
                                                                 int y) const {
  if (edge[0] == other[0] || edge[0] == other[1] || edge[1] == other[0] || edge[1] == other[1]) return std::nullopt;
  const Vec3 &p = mesh_.positions[edge[0]], &q = mesh_.positions[other[0]];
  const Vec3 u = mesh_.positions[edge[1]] - p, v = mesh_.positions[other[1]] - q, w = q - p;
  const double det = u[x] * v[y] - u[y] * v[x];
  if (det == 0) return std::nullopt;
  const double s = (w[x] * v[y] - w[y] * v[x]) / det, t = (w[x] * u[y] - w[y] * u[x]) / det;
  if (!(s > 0 && s < 1 && t > 0 && t < 1)) return std::nullopt;
  return std::array{p[x] + s * u[x], p[y] + s * u[y]};
}

bool ContactImprint::replace(const std::vector<Index>& cluster, std::vector<Piece>& pieces) {
  constexpr double kLeastCosine = 0.99;  // of the angle between normals: the cluster lies in one plane
  std::vector<Index> own;                // its triangles with an area
  for (const Index t : cluster) {
    const auto& [a, b, c] = mesh_.triangles[t];
    if (a != b && b != c && c != a) own.push_back(t);
  }
  if (own.empty()) return true;
  const auto area_vector = [&](Index t) { return doubled_area_vector(mesh_, mesh_.triangles[t]); };
  const Index largest = *std::ranges::max_element(own, {}, [&](Index t) { return area_vector(t).squaredNorm(); });
  const Vec3 normal = area_vector(largest).normalized();
  const Vec3 on_plane = mesh_.positions[mesh_.triangles[largest][0]];
  for (const Index t : own)
    if (std::abs(area_vector(t).dot(normal)) < kLeastCosine * area_vector(t).norm()) return false;
  // Without the coordinate along which the plane is steepest, the others are as exact as they were.
  int axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  const int x = (axis + 1) % 3, y = (axis + 2) % 3;
  const auto lifted = [&](double px, double py) {
    Vec3 p;
    p[x] = px;
    p[y] = py;
    p[axis] = on_plane[axis] - (normal[x] * (px - on_plane[x]) + normal[y] * (py - on_plane[y])) / normal[axis];
    return p;
  };
  std::vector<Index> vertices;
  std::vector<std::array<Index, 2>> edges;
  for (const Index t : own)
    for (std::size_t e = 0; e < 3; ++e) {
      const Index a = mesh_.triangles[t][e], b = mesh_.triangles[t][(e + 1) % 3];
      vertices.push_back(a);
      edges.push_back({std::min(a, b), std::max(a, b)});
    }
  sort_unique(vertices);
  sort_unique(edges);
  const auto seen_box = [&](ContactCorners points, Index number) {  // as seen along the axis
    for (Vec3& p : points) p[axis] = 0;
    return contact_box(points, distance_, number);
  };
  std::vector<ContactBox> boxes;
  for (const auto& [a, b] : edges) {
    const Vec3 &p = mesh_.positions[a], &q = mesh_.positions[b];
    boxes.push_back(seen_box({p, q, q}, static_cast<Index>(boxes.size())));
  }
  // Crossings of edges become vertices here, one for all that are near each other: the triangulation makes several.
  const std::vector<std::array<Index, 2>> pairs = near_pairs(boxes);
  if (num_tests_ > kMostTests) return false;
  for (const auto& [i, j] : pairs) {
    const auto crossing = crossing_of(edges[i], edges[j], x, y);
    if (!crossing) continue;
    const Vec3 p = lifted((*crossing)[0], (*crossing)[1]);
    num_tests_ += vertices.size() + crossings_.size();
    if (num_tests_ > kMostTests) return false;
    const auto is_near = [&](Index v) { return (mesh_.positions[v] - p).norm() <= distance_; };
    if (std::ranges::any_of(vertices, is_near)) continue;
    const auto known = std::ranges::find_if(crossings_, is_near);  // of another cluster with both edges
    if (known == crossings_.end()) {
      vertices.push_back(static_cast<Index>(mesh_.positions.size()));
      crossings_.push_back(vertices.back());
      mesh_.positions.push_back(p);
    } else {
      vertices.push_back(*known);
    }
  }
  Overlay overlay;
  std::map<Index, Overlay::Vertex_handle> handles;
  for (const Index v : vertices) {
    const Overlay::Vertex_handle handle = handles[v] =
        overlay.insert(OverlayKernel::Point_2(mesh_.positions[v][x], mesh_.positions[v][y]));
    if (handle->info().value != kNoIndex) return false;  // two vertices at one place of the plane
    handle->info().value = v;
  }
  const VerticesInBoxes all(vertices, mesh_.positions);
  for (const auto& [a, b] : edges) {
    Index last = a;
    for (const Index v : on_edge(a, b, near_edge(a, b, all))) {
      overlay.insert_constraint(handles[last], handles[v]);
      last = v;
    }
    overlay.insert_constraint(handles[last], handles[b]);
  }
  std::vector<Index> numbers;
  for (auto v = overlay.finite_vertices_begin(); v != overlay.finite_vertices_end(); ++v) {
    if (v->info().value == kNoIndex) {
      v->info().value = static_cast<Index>(mesh_.positions.size());
      mesh_.positions.push_back(lifted(v->point().x(), v->point().y()));
    }
    numbers.push_back(v->info().value);
  }
  sort_unique(numbers);
  for (const Index v : numbers) clusters_of_[v].push_back(vertices_.size());
  vertices_.emplace_back(numbers, mesh_.positions);
  // Twice the signed area in the plane's coordinates.
  const auto area = [&](const Vec3& a, const Vec3& b, const Vec3& c) {
    return (b[x] - a[x]) * (c[y] - a[y]) - (b[y] - a[y]) * (c[x] - a[x]);
  };
  std::vector<std::array<Index, 3>> faces;
  std::vector<Vec3> centers;
  for (auto f = overlay.finite_faces_begin(); f != overlay.finite_faces_end(); ++f) {
    faces.push_back({f->vertex(0)->info().value, f->vertex(1)->info().value, f->vertex(2)->info().value});
    const auto& [a, b, c] = faces.back();
    centers.push_back((mesh_.positions[a] + mesh_.positions[b] + mesh_.positions[c]) / 3);
  }
  // A face becomes a piece of each triangle that its center is inside.
  boxes.clear();
  const auto num_own = static_cast<Index>(own.size());
  for (const Index t : own) boxes.push_back(seen_box(corners(t), static_cast<Index>(boxes.size())));
  for (const Vec3& center : centers)
    boxes.push_back(seen_box({center, center, center}, static_cast<Index>(boxes.size())));
  for (const auto& [i, j] : near_pairs(boxes)) {
    if (i >= num_own || j < num_own) continue;
    const Index t = own[i];
    const auto& face = faces[j - num_own];
    const Vec3& center = centers[j - num_own];
    const auto [p, q, r] = corners(t);
    const double sign = area(p, q, r) > 0 ? 1 : -1;
    if (sign * area(p, q, center) <= 0 || sign * area(q, r, center) <= 0 || sign * area(r, p, center) <= 0) continue;
    pieces.push_back({sign > 0 ? face : std::array<Index, 3>{face[0], face[2], face[1]}, t});
  }
  return num_tests_ <= kMostTests;
}

/// Returns the pairs of numbers of boxes that meet, the lower one first, ascending. If there are too many, it returns
/// some of them, and raises the number of tests above its limit.
std::vector<std::array<Index, 2>> ContactImprint::near_pairs(const std::vector<ContactBox>& boxes) {
  constexpr std::size_t kMostPairs = 30'000'000;  // 240 MB
  std::vector<std::array<Index, 2>> pairs;
  for_each_meeting(boxes, [&](Index a, Index b) {
    num_tests_ += pairs.size() < kMostPairs ? 1 : kMostTests;
    if (num_tests_ <= kMostTests) pairs.push_back({std::min(a, b), std::max(a, b)});
  });
  std::ranges::sort(pairs);
  return pairs;
}

void ContactImprint::set_triangles(const std::vector<Piece>& pieces) {
  std::vector<std::array<Index, 3>> triangles;
  std::vector<Index> groups;
  for (const Piece& piece : pieces) {
    triangles.push_back(piece.corners);
    if (!mesh_.face_groups.empty()) groups.push_back(mesh_.face_groups.of_face[piece.of]);
  }
  mesh_.triangles = std::move(triangles);
  mesh_.face_groups.of_face = std::move(groups);
}

bool ContactImprint::replace_clusters() {
  std::vector<char> is_replaced(mesh_.triangles.size(), 0);
  for (const std::vector<Index>& cluster : clusters_)
    for (const Index t : cluster) is_replaced[t] = 1;
  std::vector<Piece> pieces;
  for (std::size_t t = 0; t < is_replaced.size(); ++t) {
    const auto& [a, b, c] = mesh_.triangles[t];
    if (!is_replaced[t] && a != b && b != c && c != a) pieces.push_back({mesh_.triangles[t], static_cast<Index>(t)});
  }
  try {
    for (const std::vector<Index>& cluster : clusters_)
      if (!replace(cluster, pieces)) return false;
  } catch (const CGAL::Failure_exception&) {  // an assertion inside CGAL
    return false;
  }
  set_triangles(pieces);
  return true;
}

/// Returns the vertices inside an edge, from its lower number on, of the clusters that both ends are in.
const std::vector<Index>& ContactImprint::inside(Index a, Index b) {
  const auto [it, is_new] = inside_.try_emplace({std::min(a, b), std::max(a, b)});
  if (!is_new) return it->second;
  const auto of_a = clusters_of_.find(a), of_b = clusters_of_.find(b);
  if (of_a == clusters_of_.end() || of_b == clusters_of_.end()) return it->second;
  std::vector<std::size_t> common;
  std::ranges::set_intersection(of_a->second, of_b->second, std::back_inserter(common));
  std::vector<Index> vertices;
  for (const std::size_t cluster : common)
    std::ranges::copy(near_edge(a, b, vertices_[cluster]), std::back_inserter(vertices));
  sort_unique(vertices);
  return it->second = on_edge(it->first[0], it->first[1], vertices);
}

bool ContactImprint::cut_at_vertices() {
  constexpr std::size_t kMostPieces = 10'000'000;
  std::vector<Piece> whole, left;
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) left.push_back({mesh_.triangles[t], static_cast<Index>(t)});
  while (!left.empty()) {
    if (num_tests_ > kMostTests || whole.size() + left.size() > kMostPieces) return false;
    const Piece piece = left.back();
    left.pop_back();
    // If several edges are to be cut, the one with the least vertex numbers is cut first: equal triangles then have
    // equal pieces.
    std::optional<std::array<Index, 2>> least;
    std::size_t at = 0;
    bool is_sliver = false;  // its apex lies on its longest edge
    for (std::size_t e = 0; e < 3; ++e) {
      const auto [a, b] = std::minmax({piece.corners[e], piece.corners[(e + 1) % 3]});
      // An edge on which a vertex of a cluster lies is one of the cluster.
      if (inside(a, b).empty()) continue;
      is_sliver = is_sliver || std::ranges::find(inside(a, b), piece.corners[(e + 2) % 3]) != inside(a, b).end();
      if (least && *least < std::array{a, b}) continue;
      least = {a, b};
      at = e;
    }
    if (is_sliver) continue;
    if (!least) {
      whole.push_back(piece);
      continue;
    }
    const Index a = piece.corners[at], b = piece.corners[(at + 1) % 3], apex = piece.corners[(at + 2) % 3];
    std::vector<Index> chain = inside(a, b);
    if (a > b) std::ranges::reverse(chain);
    chain.insert(chain.begin(), a);
    chain.push_back(b);
    for (std::size_t i = 0; i + 1 < chain.size(); ++i) left.push_back({{chain[i], chain[i + 1], apex}, piece.of});
  }
  std::ranges::stable_sort(whole, {}, &Piece::of);
  set_triangles(whole);
  return true;
}

}  // namespace

std::optional<TriangleMesh> imprinted_contacts(const TriangleMesh& surface, const std::function<bool()>& cancelled) {
  ContactImprint imprint(welded(surface).mesh);
  if (!imprint.find_clusters(cancelled)) return std::nullopt;
  imprint.join_near_vertices();
  if (!imprint.replace_clusters() || !imprint.cut_at_vertices()) return std::nullopt;
  return imprint.take();
}

}  // namespace subvol::internal
