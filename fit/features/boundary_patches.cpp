// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/boundary_patches.h"

#include "subvol/base/angle.h"
#include "subvol/base/disjoint_sets.h"
#include "subvol/base/error.h"
#include "subvol/fit/geometry/closest_point.h"
#include "subvol/fit/geometry/grouped_closest_point.h"
#include "subvol/surface/triangle_geometry.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <string>

namespace subvol::internal {

namespace {

/// Share of a patch's votes above which a region belongs to it; a fitted edge may miss the target's by half a face, so
/// that faces along it vote for the wrong side.
constexpr double kPatchShare = 0.2;
/// Share of a region's votes above which a patch belongs to it: small regions may have few.
constexpr double kRegionShare = 0.5;
/// Votes are cast by points this far from the face's center to its corners.
constexpr double kVoteOffset = 0.3;
/// Place of the points that angles are measured at, from the middle of an edge to the center of a face: that of the
/// centers of the faces' children.
constexpr double kAngleOffset = 0.5;

/// Marks the edges of paths, by edge of the topology.
std::vector<std::uint8_t> path_edges(const MeshTopology& topology, std::span<const CreasePath> paths) {
  std::vector<std::uint8_t> on_path(topology.num_edges(), 0);
  for (const CreasePath& path : paths)
    for (Index edge : edges_of_path(topology, path.vertices)) on_path[edge] = 1;
  return on_path;
}

/// Two places in `boundary_faces()` at each boundary edge; kNoIndex where there is no (second) face. Edges of more than
/// two boundary faces keep the first two.
std::vector<std::array<Index, 2>> faces_at_edges(const MeshTopology& topology) {
  std::vector<std::array<Index, 2>> faces(topology.num_edges(), {kNoIndex, kNoIndex});
  const auto boundary = topology.boundary_faces();
  for (std::size_t i = 0; i < boundary.size(); ++i) {
    const auto face = topology.face(boundary[i]);
    for (std::size_t j = 0; j < face.size(); ++j) {
      auto& pair = faces[topology.find_edge(face[j], face[(j + 1) % face.size()])];
      if (pair[0] == kNoIndex)
        pair[0] = static_cast<Index>(i);
      else if (pair[1] == kNoIndex)
        pair[1] = static_cast<Index>(i);
    }
  }
  return faces;
}

Vec3 center_of(std::span<const Index> face, std::span<const Vec3> positions) {
  Vec3 sum = Vec3::Zero();
  for (Index v : face) sum += positions[v];
  return sum / static_cast<double>(face.size());
}

void require_positions(const MeshTopology& topology, std::span<const Vec3> positions) {
  if (positions.size() != topology.num_vertices())
    throw InputError("boundary patches: " + std::to_string(positions.size()) + " positions for " +
                     std::to_string(topology.num_vertices()) + " vertices");
}

/// Votes of patches for regions.
struct Votes {
  std::vector<std::map<Index, double>> of_patch;  ///< by region
  std::vector<double> cast, received;             ///< by patch, by region
};

/// The faces of a mesh that vote, and the patch of each.
struct Voters {
  std::span<const Index> faces, patch_of_face;
  std::size_t num_patches;
};

/// Returns the points that vote, and the voter of each.
std::pair<std::vector<Vec3>, std::vector<std::size_t>> voting_points(const MeshTopology& topology, const Voters& voters,
                                                                     std::span<const Vec3> positions) {
  std::pair<std::vector<Vec3>, std::vector<std::size_t>> result;
  for (std::size_t i = 0; i < voters.faces.size(); ++i) {
    const Vec3 center = center_of(topology.face(voters.faces[i]), positions);
    for (Index v : topology.face(voters.faces[i])) {
      result.first.push_back(center + kVoteOffset * (positions[v] - center));
      result.second.push_back(i);
    }
  }
  return result;
}

/// hits: closest triangles of the target to the voting points.
Votes count_votes(const Voters& voters, std::span<const std::size_t> voter_of_point,
                  std::span<const ClosestPoint::Hit> hits, std::span<const Index> regions, std::size_t num_regions) {
  Votes votes{std::vector<std::map<Index, double>>(voters.num_patches), std::vector<double>(voters.num_patches, 0.0),
              std::vector<double>(num_regions, 0.0)};
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (hits[i].triangle == kNoIndex) continue;
    const Index region = regions[hits[i].triangle];
    const Index patch = voters.patch_of_face[voter_of_point[i]];
    votes.of_patch[patch][region] += 1;
    votes.cast[patch] += 1;
    votes.received[region] += 1;
  }
  return votes;
}

std::vector<Vec3> region_centers(const TriangleMesh& target, std::span<const Index> regions, std::size_t num_regions) {
  std::vector<Vec3> centers(num_regions, Vec3::Zero());
  std::vector<double> counts(num_regions, 0.0);
  for (std::size_t t = 0; t < target.triangles.size(); ++t) {
    for (Index v : target.triangles[t]) centers[regions[t]] += target.positions[v] / 3;
    counts[regions[t]] += 1;
  }
  for (std::size_t r = 0; r < centers.size(); ++r) centers[r] /= counts[r];
  return centers;
}

/// key, key_of_face: if not empty, only faces with this key count; kNoIndex if there are none.
Index patch_nearest_to(const Vec3& point, const MeshTopology& topology, const Voters& voters,
                       std::span<const Vec3> positions, Index key = 0, std::span<const Index> key_of_face = {}) {
  double distance = std::numeric_limits<double>::infinity();
  Index nearest = kNoIndex;
  for (std::size_t i = 0; i < voters.faces.size(); ++i) {
    if (!key_of_face.empty() && key_of_face[i] != key) continue;
    const double d = (center_of(topology.face(voters.faces[i]), positions) - point).squaredNorm();
    if (d < distance) distance = d, nearest = voters.patch_of_face[i];
  }
  return nearest;
}

/// Joins patches and regions that belong to each other. Numbers of regions follow those of patches.
class Matching {
 public:
  Matching(std::size_t patches, std::size_t regions)
      : patches_(static_cast<Index>(patches)), sets_(patches + regions), matched_(sets_.size(), 0) {}
  void match(Index patch, Index region) {
    sets_.join(patch, patches_ + region);
    matched_[patch] = matched_[patches_ + region] = 1;
  }
  bool has_patch(Index patch) const { return matched_[patch] != 0; }
  bool has_region(Index region) const { return matched_[patches_ + region] != 0; }
  PatchGroups groups() {
    PatchGroups result;
    std::vector<Index> number;
    result.count = sets_.number(number);
    result.of_patch.assign(number.begin(), number.begin() + patches_);
    result.of_region.assign(number.begin() + patches_, number.end());
    return result;
  }

 private:
  Index patches_;
  DisjointSets sets_;
  std::vector<std::uint8_t> matched_;
};

void match_by_shares(const Votes& votes, Matching& matching) {
  for (std::size_t p = 0; p < votes.of_patch.size(); ++p)
    for (const auto& [region, count] : votes.of_patch[p])
      if (count >= kPatchShare * votes.cast[p] || count > kRegionShare * votes.received[region])
        matching.match(static_cast<Index>(p), region);
}

/// A patch whose votes are spread over more than five regions.
void match_lone_patches(const Votes& votes, Matching& matching) {
  for (std::size_t p = 0; p < votes.of_patch.size(); ++p) {
    if (matching.has_patch(static_cast<Index>(p)) || votes.of_patch[p].empty()) continue;
    const auto most = std::ranges::max_element(votes.of_patch[p], {}, [](const auto& vote) { return vote.second; });
    matching.match(static_cast<Index>(p), most->first);
  }
}

double angle_between_planes(const Vec3& n0, const Vec3& n1, const Vec3& from_0_to_1) {
  const double turn = angle_degrees_between(n0, n1);
  return from_0_to_1.dot(n0 - n1) > 0 ? 180 + turn : 180 - turn;
}

}  // namespace

std::vector<Index> edges_of_path(const MeshTopology& topology, std::span<const Index> path) {
  const auto exists = [&](Index v) { return v >= 0 && static_cast<std::size_t>(v) < topology.num_vertices(); };
  std::vector<Index> edges;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const Index v = path[i], w = path[i + 1];
    const Index edge = exists(v) && exists(w) ? topology.find_edge(v, w) : kNoIndex;
    if (edge == kNoIndex || !topology.is_boundary_edge(edge))
      throw InputError("a path runs along vertices " + std::to_string(v) + " and " + std::to_string(w) +
                       ", which have no boundary edge of the mesh in common");
    edges.push_back(edge);
  }
  return edges;
}

BoundaryPatches boundary_patches(const MeshTopology& topology, std::span<const CreasePath> paths) {
  const std::vector<std::uint8_t> on_path = path_edges(topology, paths);
  const auto pairs = faces_at_edges(topology);
  DisjointSets sets(topology.boundary_faces().size());
  for (std::size_t e = 0; e < pairs.size(); ++e)
    if (!on_path[e] && pairs[e][1] != kNoIndex) sets.join(pairs[e][0], pairs[e][1]);
  BoundaryPatches patches;
  patches.count = sets.number(patches.of_face);
  return patches;
}

PatchGroups patch_groups(const MeshTopology& topology, const BoundaryPatches& patches, std::span<const Vec3> positions,
                         const TriangleMesh& target, const SignedFeatures& features) {
  require_positions(topology, positions);
  if (patches.of_face.size() != topology.boundary_faces().size())
    throw InputError("patch_groups: one patch is needed for each boundary face");
  if (features.regions.size() != target.triangles.size())
    throw InputError("patch_groups: one region is needed for each triangle of the target");
  for (Index p : patches.of_face)
    if (p < 0 || static_cast<std::size_t>(p) >= patches.count)
      throw InputError("patch_groups: there is no patch " + std::to_string(p));
  for (Index r : features.regions)
    if (r < 0 || static_cast<std::size_t>(r) >= features.num_regions)
      throw InputError("patch_groups: there is no region " + std::to_string(r));
  Matching matching(patches.count, features.num_regions);
  const Voters voters{topology.boundary_faces(), patches.of_face, patches.count};
  const auto [points, voter_of_point] = voting_points(topology, voters, positions);
  std::vector<ClosestPoint::Hit> hits(points.size());
  ClosestPoint(target).closest(points, hits);
  const Votes votes = count_votes(voters, voter_of_point, hits, features.regions, features.num_regions);
  match_by_shares(votes, matching);
  match_lone_patches(votes, matching);
  const std::vector<Vec3> centers = region_centers(target, features.regions, features.num_regions);
  for (std::size_t r = 0; r < centers.size() && patches.count > 0; ++r)
    if (!matching.has_region(static_cast<Index>(r)))
      matching.match(patch_nearest_to(centers[r], topology, voters, positions), static_cast<Index>(r));
  return matching.groups();
}

PatchGroups sheet_patch_groups(const MeshTopology& topology, std::span<const Index> faces,
                               std::span<const Index> patch_of_face, std::size_t num_patches,
                               std::span<const Index> key_of_face, std::span<const Vec3> positions,
                               const TriangleMesh& target, std::span<const Index> regions, std::size_t num_regions,
                               std::span<const Index> keys) {
  require_positions(topology, positions);
  const Voters voters{faces, patch_of_face, num_patches};
  const auto [points, voter_of_point] = voting_points(topology, voters, positions);
  std::vector<Index> key_of_point;
  for (const std::size_t voter : voter_of_point) key_of_point.push_back(key_of_face[voter]);
  std::vector<ClosestPoint::Hit> hits(points.size());
  GroupedClosestPoint(target, keys).closest(points, key_of_point, hits);
  const Votes votes = count_votes(voters, voter_of_point, hits, regions, num_regions);
  Matching matching(num_patches, num_regions);
  match_by_shares(votes, matching);
  match_lone_patches(votes, matching);
  const std::vector<Vec3> centers = region_centers(target, regions, num_regions);
  std::vector<Index> key_of_region(num_regions, 0);
  for (std::size_t t = 0; t < regions.size(); ++t) key_of_region[regions[t]] = keys[t];
  for (std::size_t r = 0; r < centers.size(); ++r) {
    if (matching.has_region(static_cast<Index>(r))) continue;
    const Index patch = patch_nearest_to(centers[r], topology, voters, positions, key_of_region[r], key_of_face);
    if (patch != kNoIndex) matching.match(patch, static_cast<Index>(r));
  }
  return matching.groups();
}

std::vector<EdgeAngle> smooth_edge_angles(const MeshTopology& topology, std::span<const CreasePath> paths,
                                          std::span<const Vec3> positions, const TriangleMesh& target) {
  require_positions(topology, positions);
  const std::vector<std::uint8_t> on_path = path_edges(topology, paths);
  const auto pairs = faces_at_edges(topology);
  const auto faces = topology.boundary_faces();
  std::vector<EdgeAngle> angles;
  std::vector<Vec3> points;
  for (std::size_t e = 0; e < pairs.size(); ++e) {
    if (on_path[e] || pairs[e][1] == kNoIndex) continue;
    const auto& ends = topology.edge(static_cast<Index>(e));
    const Vec3 middle = 0.5 * (positions[ends[0]] + positions[ends[1]]);
    for (Index f : pairs[e])
      points.push_back(middle + kAngleOffset * (center_of(topology.face(faces[f]), positions) - middle));
    angles.push_back({ends, 180});
  }
  std::vector<ClosestPoint::Hit> hits(points.size());
  ClosestPoint(target).closest(points, hits);
  for (std::size_t i = 0; i < angles.size(); ++i) {
    const auto &a = hits[2 * i], &b = hits[2 * i + 1];
    if (a.triangle == kNoIndex || b.triangle == kNoIndex) continue;
    angles[i].angle = angle_between_planes(triangle_normal(target, a.triangle), triangle_normal(target, b.triangle),
                                           b.point - a.point);
  }
  std::ranges::sort(angles, {}, &EdgeAngle::ends);
  return angles;
}

}  // namespace subvol::internal
