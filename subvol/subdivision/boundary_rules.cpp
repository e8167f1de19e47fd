// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/subdivision/boundary_rules.h"

#include "subvol/mesh/feature_tags.h"

#include <algorithm>
#include <vector>

namespace subvol::internal {

namespace {

/// Share of one face in the averaged child of a smooth edge: the weight of each end, and that of the face's centroid.
struct FaceShare {
  double end, face;
};

/// Returns the mean of the centroids of the face's two fine quads at the edge, as weights of the ends and the centroid.
/// Only triangles and quads have this form: there the ends and the centroid determine the sum of the corners next to
/// the ends.
FaceShare averaged_share(int size) { return size == 3 ? FaceShare{3.0 / 16, 5.0 / 8} : FaceShare{1.0 / 4, 1.0 / 2}; }

VertexWeights smooth_vertex(BoundaryRule rule, int valence) {
  const double n = valence;
  if (rule == BoundaryRule::averaging) return {0.5, 1 / (4 * n), 1 / (4 * n), 0, {}};
  return {(n - 2) / n, 1 / (n * n), 1 / (n * n), 0, {}};
}

int count_sharp(std::span<const float> sharpness) {
  return static_cast<int>(std::count_if(sharpness.begin(), sharpness.end(), [](float s) { return s > 0; }));
}

VertexWeights crease_vertex(std::span<const float> sharpness) {
  int first = 0, last = static_cast<int>(sharpness.size()) - 1;
  while (!(sharpness[first] > 0)) ++first;
  while (!(sharpness[last] > 0)) --last;
  return {0.75, 0, 0, 0.125, {first, last}};
}

enum class Rule { smooth, crease, corner };

Rule vertex_rule(float corner, std::span<const float> edges) {
  const int sharp = count_sharp(edges);
  if (corner > 0 || sharp > 2) return Rule::corner;
  return sharp == 2 ? Rule::crease : Rule::smooth;
}

VertexWeights weights_of(Rule vertex, BoundaryRule rule, std::span<const float> edges) {
  if (vertex == Rule::corner) return {1, 0, 0, 0, {}};
  if (vertex == Rule::crease) return crease_vertex(edges);
  return smooth_vertex(rule, static_cast<int>(edges.size()));
}

/// Returns the mean of the sharpnesses that reach 0 in this step, at most 1.
float transition(float corner, std::span<const float> edges) {
  float sum = 0;
  int count = 0;
  auto visit = [&](float s) {
    if (s > 0 && child_sharpness(s) <= 0) {
      sum += s;
      ++count;
    }
  };
  visit(corner);
  for (float s : edges) visit(s);
  return count == 0 ? 0 : std::min(1.0f, sum / static_cast<float>(count));
}

}  // namespace

float child_sharpness(float sharpness) {
  if (sharpness >= static_cast<float>(kInfiniteSharpness)) return sharpness;
  return sharpness > 1 ? sharpness - 1 : 0;
}

EdgeWeights edge_weights(BoundaryRule rule, float sharpness, std::array<int, 2> sizes) {
  if (sharpness >= 1) return {0.5, {0, 0}};
  EdgeWeights smooth{0.25, {0.25, 0.25}};
  if (rule == BoundaryRule::averaging) {
    const FaceShare a = averaged_share(sizes[0]), b = averaged_share(sizes[1]);
    smooth = {(a.end + b.end) / 2, {a.face / 2, b.face / 2}};
  }
  const double s = sharpness, t = 1 - s;
  return {s * 0.5 + t * smooth.end, {t * smooth.face[0], t * smooth.face[1]}};
}

VertexWeights vertex_weights(BoundaryRule rule, float corner_sharpness, std::span<const float> edge_sharpness) {
  const Rule parent = vertex_rule(corner_sharpness, edge_sharpness);
  const VertexWeights before = weights_of(parent, rule, edge_sharpness);
  if (parent == Rule::smooth) return before;

  std::vector<float> child_edges(edge_sharpness.begin(), edge_sharpness.end());
  for (float& s : child_edges) s = child_sharpness(s);
  const Rule child = vertex_rule(child_sharpness(corner_sharpness), child_edges);
  if (child == parent) return before;

  // At most one of the two rules has crease ends: a crease can only turn smooth, and a corner has no ends.
  const VertexWeights after = weights_of(child, rule, child_edges);
  const double w = transition(corner_sharpness, edge_sharpness);
  return {w * before.self + (1 - w) * after.self, w * before.edge + (1 - w) * after.edge,
          w * before.face + (1 - w) * after.face, w * before.crease + (1 - w) * after.crease,
          parent == Rule::crease ? before.crease_ends : after.crease_ends};
}

}  // namespace subvol::internal
