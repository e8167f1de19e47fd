// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/mending/mend_surface.h"

#include "subvol/base/error.h"
#include "subvol/base/format.h"
#include "subvol/fit/geometry/surface_distance.h"
#include "subvol/fit/mending/local_mending.h"
#include "subvol/fit/mending/near_vertices.h"
#include "subvol/fit/mending/surface_faults.h"
#include "subvol/surface/boundary.h"
#include "subvol/surface/by_number.h"
#include "subvol/surface/corner_fans.h"
#include "subvol/surface/welded_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

namespace subvol {

using namespace internal;
namespace {

/// Distance below which vertices are one, as a share of the diagonal: the rounding of numbers in single precision.
constexpr double kSameVertexShare = 1e-7;

bool has_only_triangles(const PolygonMesh& surface) {
  for (std::size_t f = 0; f < surface.num_faces(); ++f)
    if (surface.face_offsets[f + 1] - surface.face_offsets[f] != 3) return false;
  return true;
}

void require_valid(const PolygonMesh& surface) {
  for (std::size_t v = 0; v < surface.positions.size(); ++v)
    if (!surface.positions[v].allFinite()) throw InputError("vertex " + std::to_string(v) + " is not finite");
  for (const Index v : surface.face_vertices)
    if (v < 0 || static_cast<std::size_t>(v) >= surface.positions.size())
      throw InputError("a face names vertex " + std::to_string(v) + " of " + std::to_string(surface.positions.size()));
}

/// Returns the edges of one triangle, by their vertices.
std::vector<std::array<Index, 2>> rim_edges(const TriangleMesh& mesh) {
  std::vector<std::array<Index, 2>> rims;
  for_each_edge(sorted_half_edges(mesh.triangles, mesh.positions.size()), [&](std::span<const SurfaceHalfEdge> edge) {
    if (edge.size() == 1) rims.push_back({edge[0].low, edge[0].high});
  });
  return rims;
}

/// A surface of triangles on which the steps of the mending work, one after the other.
class Mender {
 public:
  Mender(const PolygonMesh& surface, double distance, MendingGoal goal, const std::function<bool()>& cancelled)
      : given_(surface), distance_(distance), goal_(goal), cancelled_(cancelled) {
    mesh_.positions = surface.positions;
    for (std::size_t f = 0; f < surface.num_faces(); ++f) {
      const std::size_t h = surface.face_offsets[f];
      mesh_.triangles.push_back({surface.face_vertices[h], surface.face_vertices[h + 1], surface.face_vertices[h + 2]});
    }
    vertex_numbers_.resize(surface.positions.size());
    std::iota(vertex_numbers_.begin(), vertex_numbers_.end(), 0);
    face_numbers_.resize(surface.num_faces());
    std::iota(face_numbers_.begin(), face_numbers_.end(), 0);
    diagonal_ = bounding_box_diagonal(mesh_);
    reference_ = mesh_;
  }

  void merge_vertices();
  void close_rims();
  void drop_repeated_faces();
  void split_fans();
  /// Returns false if cancelled.
  bool mend_locally();
  MendedSurface result(const FeatureTags& tags);

 private:
  void drop(const std::vector<char>& is_dropped);
  /// Makes vertices one: those with the same entry.
  void merge(std::span<const Index> number);

  const PolygonMesh& given_;
  double distance_, diagonal_ = 0;
  MendingGoal goal_;
  const std::function<bool()>& cancelled_;
  TriangleMesh mesh_;
  /// The surface from which the distance is measured: as it was given, for solids without the faces that enclose
  /// nothing.
  TriangleMesh reference_;
  std::vector<Index> vertex_numbers_, face_numbers_;
  MendedSurface counts_;
};

void Mender::drop(const std::vector<char>& is_dropped) {
  std::size_t kept = 0;
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
    if (is_dropped[t]) continue;
    mesh_.triangles[kept] = mesh_.triangles[t];
    face_numbers_[kept++] = face_numbers_[t];
  }
  counts_.dropped_faces += mesh_.triangles.size() - kept;
  mesh_.triangles.resize(kept);
  face_numbers_.resize(kept);
}

void Mender::merge_vertices() {
  std::vector<Index> all(mesh_.positions.size());
  std::iota(all.begin(), all.end(), 0);
  merge(near_vertices(mesh_.positions, all, std::min(distance_, kSameVertexShare * diagonal_)));
}

/// Merges vertices on both sides of cracks.
void Mender::close_rims() { merge(crack_vertices(mesh_.positions, rim_edges(mesh_), distance_)); }

void Mender::merge(std::span<const Index> number) {
  std::set<Index> merged;
  std::vector<char> is_dropped(mesh_.triangles.size(), 0);
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
    auto& corners = mesh_.triangles[t];
    for (Index& v : corners) {
      if (number[v] != v) merged.insert(v);
      v = number[v];
    }
    is_dropped[t] = corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0];
  }
  counts_.merged_vertices += merged.size();
  drop(is_dropped);
}

/// Merges faces on the same vertices: those of equal orientation become one, and two that face each other vanish.
void Mender::drop_repeated_faces() {
  std::map<std::array<Index, 3>, std::array<std::vector<std::size_t>, 2>> by_corners;
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
    std::array<Index, 3> c = mesh_.triangles[t];
    const bool turns = (c[0] < c[1]) + (c[1] < c[2]) + (c[2] < c[0]) == 1;
    std::sort(c.begin(), c.end());
    by_corners[c][turns].push_back(t);
  }
  std::vector<char> is_dropped(mesh_.triangles.size(), 0);
  for (const auto& [corners, sides] : by_corners) {
    const bool both = !sides[0].empty() && !sides[1].empty();
    for (const auto& faces : sides)
      for (std::size_t i = both ? 0 : 1; i < faces.size(); ++i) is_dropped[faces[i]] = 1;
  }
  if (goal_ != MendingGoal::layers) {
    // They enclose nothing, and may be of any size: they do not count when the distance is measured.
    std::vector<char> counts(reference_.triangles.size(), 1);
    for (std::size_t t = 0; t < is_dropped.size(); ++t)
      if (is_dropped[t]) counts[face_numbers_[t]] = 0;
    std::size_t kept = 0;
    for (std::size_t f = 0; f < counts.size(); ++f)
      if (counts[f]) reference_.triangles[kept++] = reference_.triangles[f];
    reference_.triangles.resize(kept);
  }
  drop(is_dropped);
}

/// Gives each fan of faces a vertex of its own. Faces are in one fan if they share an edge there; at an edge of more
/// than two faces those that bound one solid (`pair_around_edge`), if that can be told.
void Mender::split_fans() {
  const std::size_t num_vertices = mesh_.positions.size();
  const std::vector<SurfaceHalfEdge> sides = sorted_half_edges(mesh_.triangles, num_vertices);
  const bool outward = signed_volume_of(mesh_) >= 0;
  CornerFans fans(mesh_.triangles);
  std::vector<std::array<std::size_t, 2>> pairs;
  for_each_edge(sides, [&](std::span<const SurfaceHalfEdge> edge) {
    pairs.clear();
    if (edge.size() > 2 && pair_around_edge(mesh_, edge, outward, pairs)) {
      for (const auto& [i, j] : pairs) fans.join(edge[i], edge[j]);
    } else {
      for (std::size_t i = 1; i < edge.size(); ++i) fans.join(edge[0], edge[i]);
    }
  });
  std::map<Index, Index> copy_of_fan;  // a vertex's fans but for the first
  std::vector<Index> first_fan(num_vertices, kNoIndex);
  std::set<Index> touched;
  for (std::size_t c = 0; c < fans.num_corners(); ++c) {
    Index& v = mesh_.triangles[c / 3][c % 3];
    const Index fan = fans.of(c);
    if (first_fan[v] == kNoIndex) first_fan[v] = fan;
    if (first_fan[v] == fan) continue;
    const auto [copy, is_new] = copy_of_fan.try_emplace(fan, static_cast<Index>(mesh_.positions.size()));
    if (is_new) {
      const Vec3 position = mesh_.positions[v];
      mesh_.positions.push_back(position);
      vertex_numbers_.push_back(vertex_numbers_[v]);
      touched.insert({v, copy->second});
    }
    v = copy->second;
  }
  counts_.split_vertices = copy_of_fan.size();
  const std::vector<Index> vertices(touched.begin(), touched.end());
  if (!vertices.empty()) move_toward_fans(mesh_, vertices, distance_);
}

bool Mender::mend_locally() {
  const LocalMending done = subvol::mend_locally(mesh_, distance_, goal_, cancelled_);
  if (done.is_cancelled) return false;
  counts_.flipped_edges += done.flipped_edges;
  counts_.moved_vertices += done.moved_vertices;
  drop(done.is_dropped);
  return true;
}

MendedSurface Mender::result(const FeatureTags& tags) {
  // Vertices that no face names any more are dropped.
  std::vector<Index> number(mesh_.positions.size(), kNoIndex);
  for (const auto& t : mesh_.triangles)
    for (const Index v : t) number[v] = 0;
  std::size_t kept = 0;
  for (std::size_t v = 0; v < number.size(); ++v) {
    if (number[v] == kNoIndex) continue;
    number[v] = static_cast<Index>(kept);
    mesh_.positions[kept] = mesh_.positions[v];
    vertex_numbers_[kept++] = vertex_numbers_[v];
  }
  mesh_.positions.resize(kept);
  vertex_numbers_.resize(kept);
  for (auto& t : mesh_.triangles)
    for (Index& v : t) v = number[v];
  MendedSurface result = std::move(counts_);
  result.surface = as_polygons(mesh_);
  result.surface.face_groups = groups_by_number(given_.face_groups, face_numbers_);
  result.tags = tags_by_number(tags, result.surface, vertex_numbers_);
  if (!mesh_.triangles.empty()) result.distance = surface_distance(mesh_, reference_).max();
  result.vertex_numbers = std::move(vertex_numbers_);
  result.face_numbers = std::move(face_numbers_);
  return result;
}

MendedSurface unchanged(const PolygonMesh& surface, const FeatureTags& tags) {
  MendedSurface result;
  result.surface = surface;
  result.tags = tags;
  result.vertex_numbers.resize(surface.positions.size());
  std::iota(result.vertex_numbers.begin(), result.vertex_numbers.end(), 0);
  result.face_numbers.resize(surface.num_faces());
  std::iota(result.face_numbers.begin(), result.face_numbers.end(), 0);
  return result;
}

/// `is_manifold` for polygons of three corners.
bool has_one_fan_at_each_vertex(const PolygonMesh& surface) {
  std::vector<std::array<Index, 3>> triangles;
  for (std::size_t h = 0; h + 2 < surface.face_vertices.size(); h += 3)
    triangles.push_back({surface.face_vertices[h], surface.face_vertices[h + 1], surface.face_vertices[h + 2]});
  return is_manifold(triangles, surface.positions.size());
}

}  // namespace

MendedSurface mend_surface(const PolygonMesh& surface, const FeatureTags& tags, double distance, MendingGoal goal,
                           const std::function<bool()>& cancelled) {
  require_valid(surface);
  const auto ended = [&](MendedSurface result) {
    result.is_cancelled = cancelled && cancelled();
    return result;
  };
  if (!(distance > 0) || surface.num_faces() == 0 || !has_only_triangles(surface)) return unchanged(surface, tags);
  const bool has_cracks = goal == MendingGoal::solid_with_cracks && !rim_edges(triangulate(surface)).empty();
  if (!has_cracks && has_one_fan_at_each_vertex(surface) && find_faults(surface, goal, cancelled).none())
    return unchanged(surface, tags);
  if (cancelled && cancelled()) return ended(unchanged(surface, tags));
  Mender mender(surface, distance, goal, cancelled);
  mender.merge_vertices();
  if (has_cracks) mender.close_rims();
  mender.drop_repeated_faces();
  mender.split_fans();
  if (!mender.mend_locally()) return ended(unchanged(surface, tags));
  MendedSurface result = mender.result(tags);
  // Each change is small, but several may add up.
  return result.distance <= distance ? result : unchanged(surface, tags);
}

std::string to_text(const MendedSurface& mended, double diagonal) {
  std::string text;
  const auto tell = [&](std::size_t count, const char* one, const char* many) {
    if (count > 0) text += (text.empty() ? "" : ", ") + std::to_string(count) + ' ' + (count == 1 ? one : many);
  };
  tell(mended.merged_vertices, "vertex merged with another", "vertices merged with others");
  tell(mended.split_vertices, "vertex of several fans of faces split", "vertices of several fans of faces split");
  tell(mended.dropped_faces, "face dropped", "faces dropped");
  tell(mended.flipped_edges, "edge flipped", "edges flipped");
  tell(mended.moved_vertices, "vertex moved", "vertices moved");
  if (text.empty()) return text;
  return formatted("mended within %.3g (%.2g %% of the diagonal): ", mended.distance,
                   diagonal > 0 ? 100 * mended.distance / diagonal : 0) +
         text;
}

}  // namespace subvol
