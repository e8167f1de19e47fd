// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/subdivision/limit_masks.h"

#include "subvol/mesh/feature_tags.h"
#include "subvol/subdivision/boundary_rules.h"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace subvol::internal {

namespace {

using Row = Eigen::RowVectorXd;

/// Places of edges and faces in a ring mask of valence n.
struct Ring {
  int n;
  int size() const { return 1 + 2 * n; }
  int edge(int i) const { return 1 + (i + n) % n; }
  int face(int i) const { return 1 + n + (i + n) % n; }
};

/// Turns weights on the ring after one refinement into weights on the ring before it: the product with the matrix of
/// the rules.
Row before_refinement(const Row& mask, const RingSharpness& sharpness) {
  const Ring ring{static_cast<int>(sharpness.edges.size())};
  const VertexWeights vertex = vertex_weights(BoundaryRule::catmull_clark, sharpness.corner, sharpness.edges);
  Row before = Row::Zero(ring.size()), centroids = Row::Zero(ring.n);
  before[0] = mask[0] * vertex.self;
  for (int i = 0; i < ring.n; ++i) {
    const EdgeWeights edge = edge_weights(BoundaryRule::catmull_clark, sharpness.edges[i], {4, 4});
    const double on_edge = mask[ring.edge(i)];
    before[0] += on_edge * edge.end;
    before[ring.edge(i)] += on_edge * edge.end + mask[0] * vertex.edge;
    centroids[(i + ring.n - 1) % ring.n] += on_edge * edge.face[0];
    centroids[i] += on_edge * edge.face[1] + mask[ring.face(i)] + mask[0] * vertex.face;
  }
  if (vertex.crease != 0)
    for (const int end : vertex.crease_ends) before[ring.edge(end)] += mask[0] * vertex.crease;
  for (int i = 0; i < ring.n; ++i)
    for (const int corner : {0, ring.edge(i), ring.edge(i + 1), ring.face(i)}) before[corner] += centroids[i] / 4;
  return before;
}

bool is_finite_sharp(float s) { return s > 0 && s < static_cast<float>(kInfiniteSharpness); }

bool is_stationary(const RingSharpness& ring) {
  return !is_finite_sharp(ring.corner) && std::none_of(ring.edges.begin(), ring.edges.end(), is_finite_sharp);
}

std::vector<int> sharp_edges(const RingSharpness& ring) {
  std::vector<int> ends;
  for (std::size_t i = 0; i < ring.edges.size(); ++i)
    if (ring.edges[i] > 0) ends.push_back(static_cast<int>(i));
  return ends;
}

/// The ring once no finite sharpness is left, and its states in the refinements up to then.
struct Decay {
  RingSharpness stationary;
  std::vector<RingSharpness> steps;
  /// Turns weights on the stationary ring into weights on the ring at the start.
  RingMask at_start(Row mask) const {
    for (auto step = steps.rbegin(); step != steps.rend(); ++step) mask = before_refinement(mask, *step);
    return {mask.data(), mask.data() + mask.size()};
  }
};

Decay decay(const RingSharpness& ring) {
  Decay result{ring, {}};
  while (!is_stationary(result.stationary)) {
    result.steps.push_back(result.stationary);
    result.stationary.corner = child_sharpness(result.stationary.corner);
    for (float& s : result.stationary.edges) s = child_sharpness(s);
  }
  return result;
}

Row smooth_limit(const Ring& ring) {
  const double n = ring.n;
  Row mask = Row::Constant(ring.size(), 1 / (n * (n + 5)));
  mask[0] = n / (n + 5);
  mask.segment(1, ring.n) *= 4;
  return mask;
}

Row crease_limit(const Ring& ring, int a, int b) {
  Row mask = Row::Zero(ring.size());
  mask[0] = 4.0 / 6;
  mask[ring.edge(a)] = mask[ring.edge(b)] = 1.0 / 6;
  return mask;
}

Row dart_limit(const RingSharpness& sharpness) {
  constexpr int kDartLimitRefinements = 512;  // by then the powers of the next eigenvalue vanish for usual valences
  Row mask = Row::Unit(2 * static_cast<int>(sharpness.edges.size()) + 1, 0);
  for (int i = 0; i < kDartLimitRefinements; ++i) mask = before_refinement(mask, sharpness);
  return mask / mask.sum();
}

Row stationary_limit(const RingSharpness& sharpness) {
  const Ring ring{static_cast<int>(sharpness.edges.size())};
  const std::vector<int> ends = sharp_edges(sharpness);
  if (sharpness.corner > 0 || ends.size() > 2) return Row::Unit(ring.size(), 0);
  if (ends.size() == 2) return crease_limit(ring, ends[0], ends[1]);
  return ends.empty() ? smooth_limit(ring) : dart_limit(sharpness);
}

/// The dominant eigenvalue of the Fourier mode of angle t around a vertex, and the weight of faces relative to edges in
/// its left eigenvector.
struct Mode {
  double eigenvalue, face_weight;
};

Mode fourier_mode(double t) {
  const double c = std::cos(t), half = std::cos(t / 2);
  const double lambda = (5 + c + std::sqrt((c + 9) * (c + 1))) / 16;
  // At t = pi edges and faces do not mix: the weight of the faces is 0.
  return {lambda, half < 1e-12 ? 0 : 2 * (lambda - 3.0 / 8 - c / 8) / half};
}

std::array<Row, 2> smooth_tangents(const Ring& ring) {
  const double t = 2 * std::numbers::pi / ring.n;
  const Mode mode = fourier_mode(t);
  std::array<Row, 2> tangents = {Row::Zero(ring.size()), Row::Zero(ring.size())};
  for (int i = 0; i < ring.n; ++i) {
    tangents[0][ring.edge(i)] += std::cos(t * i);
    tangents[1][ring.edge(i)] += std::sin(t * i);
    tangents[0][ring.face(i)] += mode.face_weight * std::cos(t * (i + 0.5));
    tangents[1][ring.face(i)] += mode.face_weight * std::sin(t * (i + 0.5));
  }
  return tangents;
}

/// Returns the mask of the tangent into a sector of `count` quads from edge `first`: the weights inside are sines, the
/// others follow from the left eigenvector equations of the vertex and of the two border edges.
Row inward_tangent(const Ring& ring, int first, int count, bool corner) {
  Row mask = Row::Zero(ring.size());
  const double t = std::numbers::pi / count;
  const Mode mode = fourier_mode(t);
  double edges = 0, faces = 0;
  for (int j = 1; j < count; ++j) edges += mask[ring.edge(first + j)] = std::sin(j * t);
  for (int j = 0; j < count; ++j) faces += mask[ring.face(first + j)] = mode.face_weight * std::sin((j + 0.5) * t);
  if (count == 1) {
    mask[0] = -3;
    mask[ring.face(first)] = mask[ring.edge(first)] = mask[ring.edge(first + 1)] = 1;
    return mask;
  }
  const double lambda = mode.eigenvalue;
  const double into_border = mask[ring.edge(first + 1)] / 16 + mask[ring.face(first)] / 4;
  const double into_vertex = 3.0 / 8 * edges + faces / 4;
  // The unknowns are the weight a of the vertex and b of both border edges:
  //   (lambda - 1/2) b - a / 8 = into_border,   (lambda - 3/4) a - b = into_vertex     (crease)
  // At a corner the vertex does not depend on the border: (lambda - 1/2) b = into_border, and the weights sum to 0.
  double a, b;
  if (corner) {
    b = into_border / (lambda - 0.5);
    a = -(edges + faces + 2 * b);
  } else {
    const double determinant = (lambda - 0.5) * (lambda - 0.75) - 1.0 / 8;
    a = (into_border + (lambda - 0.5) * into_vertex) / determinant;
    b = (lambda - 0.75) * a - into_vertex;
  }
  mask[0] = a;
  mask[ring.edge(first)] += b;
  mask[ring.edge(first + count)] += b;
  return mask;
}

std::array<Row, 2> sector_tangents(const Ring& ring, int first, int count, bool corner) {
  Row along = Row::Zero(ring.size());
  along[ring.edge(first)] += 1;
  along[ring.edge(first + count)] -= 1;
  if (!corner || count > 2) return {along, inward_tangent(ring, first, count, corner)};
  std::array<Row, 2> tangents = {Row::Zero(ring.size()), Row::Zero(ring.size())};
  tangents[0][ring.edge(first)] = tangents[1][ring.edge(first + count)] = 1;
  tangents[0][0] = tangents[1][0] = -1;
  return tangents;
}

/// Returns what is left of the smooth tangents after many refinements, scaled back: there is no closed form.
std::array<Row, 2> dart_tangents(const RingSharpness& sharpness) {
  constexpr int kDartTangentRefinements = 24;  // by then, only the tangents are left
  std::array<Row, 2> tangents = smooth_tangents({static_cast<int>(sharpness.edges.size())});
  for (Row& tangent : tangents)
    for (int i = 0; i < kDartTangentRefinements; ++i) tangent = 2 * before_refinement(tangent, sharpness);
  return tangents;
}

std::array<Row, 2> stationary_tangents(const RingSharpness& sharpness, const TangentSector& sector) {
  const Ring ring{static_cast<int>(sharpness.edges.size())};
  const std::size_t num_ends = sharp_edges(sharpness).size();
  if (num_ends == 0) return smooth_tangents(ring);
  if (num_ends == 1) return dart_tangents(sharpness);
  return sector_tangents(ring, sector.first, sector.count, sharpness.corner > 0 || num_ends > 2);
}

}  // namespace

RingMask limit_mask(const RingSharpness& sharpness) {
  const Decay ring = decay(sharpness);
  return ring.at_start(stationary_limit(ring.stationary));
}

std::vector<TangentSector> tangent_sectors(const RingSharpness& sharpness) {
  const int n = static_cast<int>(sharpness.edges.size());
  const std::vector<int> ends = sharp_edges(decay(sharpness).stationary);
  if (ends.size() < 2) return {{0, n}};
  std::vector<TangentSector> sectors;
  for (std::size_t i = 0; i < ends.size(); ++i)
    sectors.push_back({ends[i], (ends[(i + 1) % ends.size()] - ends[i] + n) % n});
  return sectors;
}

std::array<RingMask, 2> tangent_masks(const RingSharpness& sharpness, const TangentSector& sector) {
  const Decay ring = decay(sharpness);
  const std::array<Row, 2> tangents = stationary_tangents(ring.stationary, sector);
  return {ring.at_start(tangents[0]), ring.at_start(tangents[1])};
}

}  // namespace subvol::internal
