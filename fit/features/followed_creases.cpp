// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/followed_creases.h"

#include "subvol/mesh/features.h"
#include "subvol/subdivision/audit.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

namespace subvol {

namespace {

constexpr int kMaxUnfoldings = 5;
constexpr double kMost = 0.5;

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
  // A crease added at one corner may leave a span of more than 180 degrees at another.
  for (int round = 0; round < kMaxUnfoldings; ++round) {
    const SubdivisionAudit found = audit(template_mesh);
    if (found.folding_edges.empty()) break;
    template_mesh.tags = unfolding_tags(template_mesh, found);
  }
}

bool FollowedCreases::hold_the_surface() const {
  double all = 0, followed = 0;
  for (const FeatureCurve& curve : curves_.curves) all += curve.length();
  for (const CreasePath& path : paths_) followed += curves_.curves[path.curve].length();
  return followed > kMost * all;
}

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

CreaseDistance FollowedCreases::distance(const BoundaryRefinement& limit, std::span<const Vec3> points,
                                         double diagonal) const {
  return crease_distance(curves_, points, segments(limit.crease_edges), diagonal);
}

}  // namespace subvol
