// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/followed_creases.h"

#include "subvol/mesh/features.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/subdivision/audit.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <set>
#include <utility>

namespace subvol::internal {

namespace {

constexpr int kMaxUnfoldings = 5;           // rounds; each adds tags, and few need a second one
constexpr double kLeastHoldingShare = 0.5;  // of the length of the target's sharp edges

/// Adds tags that keep sheets from folding at corners. A crease added at one corner may leave a span of more than 180
/// degrees at another.
void unfold(VolumeMesh& mesh) {
  for (int round = 0; round < kMaxUnfoldings; ++round) {
    const SubdivisionAudit found = audit(mesh);
    if (found.folding_edges.empty()) break;
    mesh.tags = unfolding_tags(mesh, found);
  }
}

/// Adds the pieces of a curve along the edges that belong to a set: the curve itself if all of them do.
template <class Contains>
void add_pieces(const FeatureCurve& curve, const Contains& contains, std::vector<FeatureCurve>& pieces) {
  const std::size_t edges = curve.vertices.size() - 1;
  std::vector<std::uint8_t> belongs;
  for (std::size_t i = 0; i < edges; ++i) belongs.push_back(contains(curve.vertices[i], curve.vertices[i + 1]));
  const auto first_other = static_cast<std::size_t>(std::ranges::find(belongs, 0) - belongs.begin());
  if (first_other == edges) {
    pieces.push_back(curve);
    return;
  }
  const std::size_t begin = curve.closed() ? first_other : 0;  // no piece runs across the ends of a closed curve
  bool is_open = false;
  for (std::size_t k = 0; k < edges; ++k) {
    const std::size_t i = (begin + k) % edges;
    if (belongs[i]) {
      if (!is_open) pieces.push_back({{curve.vertices[i]}, {curve.points[i]}});
      pieces.back().vertices.push_back(curve.vertices[i + 1]);
      pieces.back().points.push_back(curve.points[i + 1]);
    }
    is_open = belongs[i];
  }
}

}  // namespace

FollowedCreases::FollowedCreases(const TriangleMesh& target, std::optional<double> angle_degrees,
                                 VolumeMesh& template_mesh, std::span<const std::array<Index, 2>> tagged)
    : curves_(feature_curves(target, angle_degrees.value_or(kUsualCreaseAngle), tagged)),
      paths_(follow_curves(template_mesh, curves_, angle_degrees ? PathEdges::all : PathEdges::creases)) {
  if (angle_degrees) tag(template_mesh);
  find_curves_of_creases(template_mesh);
}

FollowedCreases::FollowedCreases(FeatureCurves curves, std::vector<CreasePath> paths, VolumeMesh& mesh)
    : curves_(std::move(curves)), paths_(std::move(paths)) {
  mesh.tags = tags_of_paths(paths_, curves_);
  find_curves_of_creases(mesh);
}

void FollowedCreases::keep_interfaces(VolumeMesh& mesh, double angle_degrees, InnerCurves drawn_to) {
  const bool with_rims = drawn_to == InnerCurves::themselves_with_rims;
  const MeshTopology topology(mesh);
  const InterfaceMarks marks = mark_interfaces(topology, find_interfaces(mesh, topology));
  if (marks.edges.empty()) return;
  using Edge = std::array<Index, 2>;
  std::set<Edge> of_boundary, of_interfaces;
  const auto add = [&](const CreaseEdge& crease) {
    const Index e = topology.find_edge(crease.v0, crease.v1);
    if (topology.is_boundary_edge(e))
      of_boundary.insert(topology.edge(e));
    else
      of_interfaces.insert(topology.edge(e));
  };
  for (const CreaseEdge& crease : mesh.tags.creases) add(crease);
  for (const CreaseEdge& crease : features_by_angle(mesh, angle_degrees).creases)
    if (!topology.is_boundary_edge(topology.find_edge(crease.v0, crease.v1))) add(crease);
  for (std::size_t i = 0; i < marks.curves.size(); ++i) {
    const Index e = static_cast<Index>(i);
    const bool on_boundary = topology.is_boundary_edge(e);
    if (marks.curves[i] && (!on_boundary || with_rims) && !of_boundary.contains(topology.edge(e)))
      of_interfaces.insert(topology.edge(e));
  }
  std::vector<Edge> all(of_boundary.begin(), of_boundary.end());
  all.insert(all.end(), of_interfaces.begin(), of_interfaces.end());
  const FeatureCurves found = feature_curves({mesh.positions, {}}, angle_degrees, all);
  FeatureTags tags;
  std::vector<FeatureCurve> curves;
  for (const FeatureCurve& curve : found.curves)
    add_pieces(
        curve,
        [&](Index v, Index w) {
          return of_interfaces.contains({std::min(v, w), std::max(v, w)});
        },
        curves);
  for (const FeatureCurve& curve : curves) {
    for (std::size_t i = 0; i + 1 < curve.vertices.size(); ++i)
      tags.creases.push_back({curve.vertices[i], curve.vertices[i + 1]});
    for (const Index end : {curve.vertices.front(), curve.vertices.back()}) {
      const auto at = std::ranges::lower_bound(found.corners, end);
      const bool is_corner = at != found.corners.end() && *at == end;
      if (is_corner && found.corner_edges[static_cast<std::size_t>(at - found.corners.begin())] > 1)
        tags.corners.push_back({end});
    }
    if (drawn_to == InnerCurves::nothing) continue;
    paths_.push_back({static_cast<Index>(curves_.curves.size()), curve.vertices});
    curves_.curves.push_back(curve);
  }
  mesh.tags = merge_tags(mesh.tags, tags);
  keep_from_folding(mesh);
}

void FollowedCreases::find_curves_of_creases(const VolumeMesh& mesh) {
  std::map<std::pair<Index, Index>, Index> curve_of_edge;
  for (const CreasePath& path : paths_)
    for (std::size_t i = 0; i + 1 < path.vertices.size(); ++i)
      curve_of_edge[std::minmax(path.vertices[i], path.vertices[i + 1])] = path.curve;
  for (const CreaseEdge& crease : mesh.tags.creases) {
    const auto at = curve_of_edge.find({crease.v0, crease.v1});
    curve_of_crease_.push_back(at == curve_of_edge.end() ? kNoIndex : at->second);
  }
}

void FollowedCreases::tag(VolumeMesh& template_mesh) const {
  template_mesh.tags = merge_tags(template_mesh.tags, tags_of_paths(paths_, curves_));
  unfold(template_mesh);
}

void FollowedCreases::keep_from_folding(VolumeMesh& mesh) {
  unfold(mesh);
  curve_of_crease_.clear();
  find_curves_of_creases(mesh);
}

double FollowedCreases::followed_share() const {
  double all = 0, followed = 0;
  for (const FeatureCurve& curve : curves_.curves) all += curve.length();
  for (const CreasePath& path : paths_) followed += curves_.curves[path.curve].length();
  return all > 0 ? followed / all : 0;
}

bool FollowedCreases::hold_the_surface() const { return followed_share() > kLeastHoldingShare; }

void FollowedCreases::release(std::span<const std::uint8_t> vertices, VolumeMesh& mesh) {
  std::vector<CreaseEdge>& creases = mesh.tags.creases;
  std::set<Index> curves;
  for (std::size_t k = 0; k < creases.size(); ++k)
    if (vertices[creases[k].v0] || vertices[creases[k].v1]) curves.insert(curve_of_crease_[k]);
  std::size_t kept = 0;
  for (std::size_t k = 0; k < creases.size(); ++k) {
    const bool marked = vertices[creases[k].v0] || vertices[creases[k].v1];
    if (marked || (curve_of_crease_[k] != kNoIndex && curves.contains(curve_of_crease_[k]))) continue;
    creases[kept] = creases[k];
    curve_of_crease_[kept++] = curve_of_crease_[k];
  }
  creases.resize(kept);
  curve_of_crease_.resize(kept);
  std::erase_if(mesh.tags.corners, [&](const CornerVertex& corner) { return vertices[corner.vertex]; });
}

void FollowedCreases::refine(std::span<const Index> parents) {
  if (curve_of_crease_.empty()) return;
  std::vector<Index> children;
  for (Index parent : parents) children.push_back(curve_of_crease_[parent]);
  curve_of_crease_ = std::move(children);
}

std::vector<CreaseSegment> FollowedCreases::segments(std::span<const std::array<Index, 2>> edges) const {
  std::vector<CreaseSegment> result;
  for (std::size_t k = 0; k < edges.size() && !curve_of_crease_.empty(); ++k)
    result.push_back({edges[k], curve_of_crease_[k * curve_of_crease_.size() / edges.size()]});
  return result;
}

CreaseEnergy FollowedCreases::energy(std::span<const std::array<Index, 2>> edges, std::size_t num_samples, double width,
                                     double tangential_weight) const {
  std::vector<CreaseSegment> following = segments(edges);
  std::erase_if(following, [](const CreaseSegment& s) { return s.curve == kNoIndex; });
  return CreaseEnergy(curves_, std::move(following), num_samples, width, tangential_weight);
}

CreaseDistance FollowedCreases::distance(std::span<const std::array<Index, 2>> edges, std::span<const Vec3> points,
                                         double diagonal, const FeatureCurves* whole) const {
  return crease_distance(whole ? *whole : curves_, points, segments(edges), diagonal, &curves_);
}

}  // namespace subvol::internal
