// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/disjoint_sets.h"
#include "subvol/base/sort_unique.h"
#include "subvol/fit/geometry/contact_imprint.h"
#include "subvol/fit/geometry/self_intersection.h"
#include "subvol/fit/geometry/triangle_meeting.h"
#include "subvol/surface/surface_parts.h"
#include "subvol/surface/triangle_geometry.h"
#include "subvol/surface/welded_surface.h"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>
#include <CGAL/exceptions.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>
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

/// The triangles of a surface while clusters of them are replaced.
class ContactImprint {
 public:
  explicit ContactImprint(TriangleMesh mesh) : mesh_(std::move(mesh)) {}

  /// Finds the clusters. Returns false if there is none, or triangles cross.
  bool find_clusters(const std::function<bool()>& cancelled);
  /// Replaces their triangles. Returns false if that is not possible, or there are too many.
  bool replace_clusters();
  /// Cuts triangles at the vertices of clusters that lie on their edges. Returns false if there are too many.
  bool cut_at_vertices();
  /// Drops all but the first of the triangles that have the same corners.
  void drop_equal();
  TriangleMesh take() { return std::move(mesh_); }

 private:
  /// A triangle that replaces one of the surface.
  struct Piece {
    std::array<Index, 3> corners;
    Index of;  ///< the triangle that it is a piece of
  };
  bool replace(const std::vector<Index>& cluster, std::vector<Piece>& pieces);
  void set_triangles(const std::vector<Piece>& pieces);
  const std::vector<Index>& inside(Index a, Index b);

  static constexpr std::size_t kMostTests = 300'000'000;  ///< of a point beside a triangle or edge: a second

  TriangleMesh mesh_;
  std::size_t num_tests_ = 0;
  std::vector<std::vector<Index>> clusters_;
  std::vector<Index> vertices_;                                ///< of clusters, ascending
  std::map<std::array<Index, 2>, std::vector<Index>> inside_;  ///< vertices inside an edge, from its lower number on
};

bool ContactImprint::find_clusters(const std::function<bool()>& cancelled) {
  const SelfIntersections found = self_intersections(mesh_, cancelled);
  if (!found.is_complete) return false;
  DisjointSets sets(mesh_.triangles.size());
  std::vector<char> overlaps(mesh_.triangles.size(), 0);
  const auto join = [&](Index t, Index s) {
    sets.join(t, s);
    overlaps[t] = overlaps[s] = 1;
  };
  const auto corners = [&](Index t) {
    const auto& [a, b, c] = mesh_.triangles[t];
    return std::array<Vec3, 3>{mesh_.positions[a], mesh_.positions[b], mesh_.positions[c]};
  };
  for (const auto& [t, s] : found.pairs) {
    const MeetingKind kind = meeting_of(corners(t), corners(s)).kind;
    if (kind == MeetingKind::crossing) return false;
    if (kind == MeetingKind::face) join(t, s);
  }
  // The halves of a quad that is flat up to rounding do not overlap exactly.
  for (const auto& [t, s] : edge_contacts(surface_parts(mesh_))) join(t, s);
  std::map<Index, std::vector<Index>> members;
  for (std::size_t t = 0; t < overlaps.size(); ++t)
    if (overlaps[t]) members[sets.of(static_cast<Index>(t))].push_back(static_cast<Index>(t));
  for (auto& [first, cluster] : members) clusters_.push_back(std::move(cluster));
  return !clusters_.empty();
}

bool ContactImprint::replace(const std::vector<Index>& cluster, std::vector<Piece>& pieces) {
  num_tests_ += cluster.size() * cluster.size();
  if (num_tests_ > kMostTests) return false;
  // Without the coordinate along which the plane is steepest, the others are as exact as they were.
  const Vec3 normal = doubled_area_vector(mesh_, mesh_.triangles[cluster[0]]);
  const Vec3 on_plane = mesh_.positions[mesh_.triangles[cluster[0]][0]];
  int axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  const int x = (axis + 1) % 3, y = (axis + 2) % 3;
  Overlay overlay;
  std::map<Index, Overlay::Vertex_handle> handles;
  const auto handle = [&](Index v) {
    const auto [it, is_new] = handles.try_emplace(v);
    if (is_new) {
      it->second = overlay.insert(OverlayKernel::Point_2(mesh_.positions[v][x], mesh_.positions[v][y]));
      it->second->info().value = v;
    }
    return it->second;
  };
  for (const Index t : cluster)
    for (const Index v : mesh_.triangles[t])
      if (handle(v)->info().value != v) return false;  // two vertices at one place of the plane
  for (const Index t : cluster)
    for (std::size_t e = 0; e < 3; ++e)
      overlay.insert_constraint(handle(mesh_.triangles[t][e]), handle(mesh_.triangles[t][(e + 1) % 3]));
  for (auto v = overlay.finite_vertices_begin(); v != overlay.finite_vertices_end(); ++v) {
    if (v->info().value == kNoIndex) {
      v->info().value = static_cast<Index>(mesh_.positions.size());
      Vec3 p;
      p[x] = v->point().x();
      p[y] = v->point().y();
      p[axis] = on_plane[axis] - (normal[x] * (p[x] - on_plane[x]) + normal[y] * (p[y] - on_plane[y])) / normal[axis];
      mesh_.positions.push_back(p);
    }
    vertices_.push_back(v->info().value);
  }
  // Twice the signed area in the plane's coordinates.
  const auto area = [&](const Vec3& a, const Vec3& b, const Vec3& c) {
    return (b[x] - a[x]) * (c[y] - a[y]) - (b[y] - a[y]) * (c[x] - a[x]);
  };
  for (auto f = overlay.finite_faces_begin(); f != overlay.finite_faces_end(); ++f) {
    const std::array<Index, 3> corners{f->vertex(0)->info().value, f->vertex(1)->info().value,
                                       f->vertex(2)->info().value};
    const Vec3 center = (mesh_.positions[corners[0]] + mesh_.positions[corners[1]] + mesh_.positions[corners[2]]) / 3;
    for (const Index t : cluster) {
      const auto& [a, b, c] = mesh_.triangles[t];
      const Vec3 &p = mesh_.positions[a], &q = mesh_.positions[b], &r = mesh_.positions[c];
      const double sign = area(p, q, r) > 0 ? 1 : -1;
      if (sign * area(p, q, center) <= 0 || sign * area(q, r, center) <= 0 || sign * area(r, p, center) <= 0) continue;
      pieces.push_back({sign > 0 ? corners : std::array<Index, 3>{corners[0], corners[2], corners[1]}, t});
    }
  }
  return true;
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
  for (std::size_t t = 0; t < is_replaced.size(); ++t)
    if (!is_replaced[t]) pieces.push_back({mesh_.triangles[t], static_cast<Index>(t)});
  try {
    for (const std::vector<Index>& cluster : clusters_)
      if (!replace(cluster, pieces)) return false;
  } catch (const CGAL::Failure_exception&) {  // an assertion inside CGAL
    return false;
  }
  set_triangles(pieces);
  sort_unique(vertices_);
  return true;
}

/// Returns the vertices of clusters inside an edge, from its lower number on.
const std::vector<Index>& ContactImprint::inside(Index a, Index b) {
  constexpr double kOnEdge = 1e-9;  // distance from the edge, share of its length
  const auto [it, is_new] = inside_.try_emplace({std::min(a, b), std::max(a, b)});
  if (!is_new) return it->second;
  num_tests_ += vertices_.size();
  const Vec3& from = mesh_.positions[it->first[0]];
  const Vec3 along = mesh_.positions[it->first[1]] - from;
  std::vector<std::pair<double, Index>> found;
  for (const Index v : vertices_) {
    if (v == a || v == b) continue;
    const Vec3 offset = mesh_.positions[v] - from;
    const double share = offset.dot(along) / along.squaredNorm();
    if (share > kOnEdge && share < 1 - kOnEdge && (offset - share * along).norm() <= kOnEdge * along.norm())
      found.push_back({share, v});
  }
  std::ranges::sort(found);
  for (const auto& [share, v] : found) it->second.push_back(v);
  return it->second;
}

bool ContactImprint::cut_at_vertices() {
  std::vector<Piece> whole, left;
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) left.push_back({mesh_.triangles[t], static_cast<Index>(t)});
  const auto is_of_cluster = [&](Index v) { return std::ranges::binary_search(vertices_, v); };
  while (!left.empty()) {
    const Piece piece = left.back();
    left.pop_back();
    bool is_cut = false;
    for (std::size_t e = 0; e < 3 && !is_cut; ++e) {
      const Index a = piece.corners[e], b = piece.corners[(e + 1) % 3], apex = piece.corners[(e + 2) % 3];
      // An edge on which a vertex of a cluster lies is one of the cluster.
      if (!is_of_cluster(a) || !is_of_cluster(b)) continue;
      std::vector<Index> chain = inside(a, b);
      if (num_tests_ > kMostTests) return false;
      std::erase(chain, apex);  // of a sliver
      if (chain.empty()) continue;
      if (a > b) std::ranges::reverse(chain);
      chain.insert(chain.begin(), a);
      chain.push_back(b);
      for (std::size_t i = 0; i + 1 < chain.size(); ++i) left.push_back({{chain[i], chain[i + 1], apex}, piece.of});
      is_cut = true;
    }
    if (!is_cut) whole.push_back(piece);
  }
  std::ranges::stable_sort(whole, {}, &Piece::of);
  set_triangles(whole);
  return true;
}

void ContactImprint::drop_equal() {
  std::set<std::array<Index, 3>> seen;
  std::vector<Piece> kept;
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
    std::array<Index, 3> corners = mesh_.triangles[t];
    std::ranges::sort(corners);
    if (seen.insert(corners).second) kept.push_back({mesh_.triangles[t], static_cast<Index>(t)});
  }
  set_triangles(kept);
}

}  // namespace

std::optional<TriangleMesh> imprinted_contacts(const TriangleMesh& surface, const std::function<bool()>& cancelled) {
  ContactImprint imprint(welded(surface).mesh);
  if (!imprint.find_clusters(cancelled) || !imprint.replace_clusters() || !imprint.cut_at_vertices())
    return std::nullopt;
  imprint.drop_equal();
  return imprint.take();
}

}  // namespace subvol::internal
