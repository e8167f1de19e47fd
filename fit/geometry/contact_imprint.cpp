// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/geometry/contact_imprint.h"

#include "subvol/base/disjoint_sets.h"
#include "subvol/base/sort_unique.h"
#include "subvol/fit/geometry/box_pairs.h"
#include "subvol/fit/geometry/contact_overlay.h"
#include "subvol/fit/geometry/vertex_grid.h"
#include "subvol/surface/welded_surface.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <iterator>
#include <map>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

namespace subvol::internal {

namespace {

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

/// The triangles of a surface while clusters of them are replaced.
class ContactImprint {
 public:
  ContactImprint(TriangleMesh mesh, const std::function<bool()>& cancelled)
      : mesh_(std::move(mesh)), budget_(cancelled) {
    for (const Vec3& p : mesh_.positions) box_.extend(p);
    distance_ = box_.isEmpty() ? 0 : kTouchingShare * box_.diagonal().norm();
  }

  /// Returns false if there are no clusters, or some cannot be cut. ContactBudget::Spent: there are too many tests, or
  /// the work is cancelled.
  bool run() {
    find_clusters();
    if (clusters_.empty()) return false;
    join_near_vertices();
    ContactOverlay overlay(mesh_, box_, distance_, budget_);
    return replace_clusters(overlay) && cut_at_vertices(overlay);
  }
  TriangleMesh take() { return std::move(mesh_); }

 private:
  ContactCorners corners(Index t) const {
    const auto& [a, b, c] = mesh_.triangles[t];
    return {mesh_.positions[a], mesh_.positions[b], mesh_.positions[c]};
  }
  void find_clusters();
  void join_near_vertices();
  bool replace_clusters(ContactOverlay& overlay);
  bool cut_at_vertices(ContactOverlay& overlay);
  void set_triangles(const std::vector<ContactPiece>& pieces);

  TriangleMesh mesh_;
  ContactBudget budget_;
  Eigen::AlignedBox3d box_;
  double distance_;                           ///< within which triangles touch
  std::vector<std::vector<Index>> clusters_;  ///< of triangles that lie on each other, ascending
};

void ContactImprint::find_clusters() {
  const Vec3 margin = Vec3::Constant(distance_ / 2);
  std::vector<Eigen::AlignedBox3d> boxes;
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
    Eigen::AlignedBox3d box;
    for (const Vec3& p : corners(static_cast<Index>(t))) box.extend(p);
    boxes.push_back({box.min() - margin, box.max() + margin});
  }
  DisjointSets sets(mesh_.triangles.size());
  std::vector<char> overlaps(mesh_.triangles.size(), 0);
  for_each_box_pair(boxes, [&](Index t, Index s) {
    budget_.spend(1);
    const bool have_same_corners = std::ranges::is_permutation(mesh_.triangles[t], mesh_.triangles[s]);
    if (have_same_corners || !lie_on_each_other(corners(t), corners(s), distance_)) return;
    sets.join(t, s);
    overlaps[t] = overlaps[s] = 1;
  });
  std::map<Index, std::vector<Index>> members;
  for (std::size_t t = 0; t < overlaps.size(); ++t)
    if (overlaps[t]) members[sets.of(static_cast<Index>(t))].push_back(static_cast<Index>(t));
  for (auto& [first, cluster] : members) clusters_.push_back(std::move(cluster));
}

/// Makes vertices of clusters one that are near each other: each becomes the nearest one of those before it that stay.
void ContactImprint::join_near_vertices() {
  std::vector<Index> vertices;
  for (const std::vector<Index>& cluster : clusters_)
    for (const Index t : cluster) std::ranges::copy(mesh_.triangles[t], std::back_inserter(vertices));
  sort_unique(vertices);
  std::vector<Index> number(mesh_.positions.size());
  std::iota(number.begin(), number.end(), 0);
  VertexGrid staying(box_, distance_);
  for (const Index v : vertices) {
    std::size_t tests = 1;
    const Index nearest = staying.nearest(mesh_.positions[v], tests);
    budget_.spend(tests);
    if (nearest == kNoIndex)
      staying.add(v, mesh_.positions[v]);
    else
      number[v] = nearest;
  }
  for (auto& t : mesh_.triangles)
    for (Index& v : t) v = number[v];
}

void ContactImprint::set_triangles(const std::vector<ContactPiece>& pieces) {
  std::vector<std::array<Index, 3>> triangles;
  std::vector<Index> groups;
  for (const ContactPiece& piece : pieces) {
    triangles.push_back(piece.corners);
    if (!mesh_.face_groups.empty()) groups.push_back(mesh_.face_groups.of_face[piece.of]);
  }
  mesh_.triangles = std::move(triangles);
  mesh_.face_groups.of_face = std::move(groups);
}

/// Replaces the triangles of clusters. Returns false if that is not possible.
bool ContactImprint::replace_clusters(ContactOverlay& overlay) {
  std::vector<char> is_replaced(mesh_.triangles.size(), 0);
  for (const std::vector<Index>& cluster : clusters_)
    for (const Index t : cluster) is_replaced[t] = 1;
  std::vector<ContactPiece> pieces;
  for (std::size_t t = 0; t < is_replaced.size(); ++t) {
    const auto& [a, b, c] = mesh_.triangles[t];
    if (!is_replaced[t] && a != b && b != c && c != a) pieces.push_back({mesh_.triangles[t], static_cast<Index>(t)});
  }
  for (const std::vector<Index>& cluster : clusters_) {
    const std::optional<std::vector<ContactPiece>> cut = overlay.cut(cluster);
    if (!cut) return false;
    pieces.insert(pieces.end(), cut->begin(), cut->end());
  }
  set_triangles(pieces);
  return true;
}

/// Cuts triangles at the vertices of clusters that lie on their edges. Returns false if there are too many.
bool ContactImprint::cut_at_vertices(ContactOverlay& overlay) {
  constexpr std::size_t kMostPieces = 10'000'000;
  std::vector<ContactPiece> whole, left;
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) left.push_back({mesh_.triangles[t], static_cast<Index>(t)});
  while (!left.empty()) {
    if (whole.size() + left.size() > kMostPieces) return false;
    budget_.spend(1);
    const ContactPiece piece = left.back();
    left.pop_back();
    // If several edges are to be cut, the one with the least vertex numbers is cut first: equal triangles then have
    // equal pieces.
    std::optional<std::array<Index, 2>> least;
    std::size_t at = 0;
    bool is_sliver = false;  // its apex lies on its longest edge
    for (std::size_t e = 0; e < 3; ++e) {
      const auto [a, b] = std::minmax({piece.corners[e], piece.corners[(e + 1) % 3]});
      // An edge on which a vertex of a cluster lies is one of the cluster.
      if (overlay.inside(a, b).empty()) continue;
      is_sliver = is_sliver ||
                  std::ranges::find(overlay.inside(a, b), piece.corners[(e + 2) % 3]) != overlay.inside(a, b).end();
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
    std::vector<Index> chain = overlay.inside(a, b);
    if (a > b) std::ranges::reverse(chain);
    chain.insert(chain.begin(), a);
    chain.push_back(b);
    for (std::size_t i = 0; i + 1 < chain.size(); ++i) left.push_back({{chain[i], chain[i + 1], apex}, piece.of});
  }
  std::ranges::stable_sort(whole, {}, &ContactPiece::of);
  set_triangles(whole);
  return true;
}

}  // namespace

std::optional<TriangleMesh> imprinted_contacts(const TriangleMesh& surface, const std::function<bool()>& cancelled) {
  ContactImprint imprint(welded(surface).mesh, cancelled);
  try {
    if (imprint.run()) return imprint.take();
  } catch (const ContactBudget::Spent&) {
  }
  return std::nullopt;
}

}  // namespace subvol::internal
