// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/limit_masks.h"

#include "subvol/boundary_rules.h"
#include "subvol/feature_tags.h"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace subvol {

namespace {

using Matrix = Eigen::MatrixXd;
using Row = Eigen::RowVectorXd;

/// Places in a ring of valence n.
struct Ring {
  int n;
  int size() const { return 1 + 2 * n; }
  int edge(int i) const { return 1 + (i + n) % n; }
  int face(int i) const { return 1 + n + (i + n) % n; }
};

Row centroid(const Ring& ring, int i) {
  Row row = Row::Zero(ring.size());
  row[0] = row[ring.face(i)] = 0.25;
  row[ring.edge(i)] += 0.25;
  row[ring.edge(i + 1)] += 0.25;
  return row;
}

/// The rules of one refinement on the ring.
Matrix ring_matrix(const RingSharpness& sharpness) {
  const Ring ring{static_cast<int>(sharpness.edges.size())};
  Matrix matrix = Matrix::Zero(ring.size(), ring.size());
  const VertexWeights vertex = vertex_weights(BoundaryRule::catmull_clark, sharpness.corner, sharpness.edges);
  matrix(0, 0) = vertex.self;
  for (int i = 0; i < ring.n; ++i) {
    matrix(0, ring.edge(i)) += vertex.edge;
    matrix.row(0) += vertex.face * centroid(ring, i);
    const EdgeWeights edge = edge_weights(BoundaryRule::catmull_clark, sharpness.edges[i], {4, 4});
    matrix(ring.edge(i), 0) += edge.end;
    matrix(ring.edge(i), ring.edge(i)) += edge.end;
    matrix.row(ring.edge(i)) += edge.face[0] * centroid(ring, i - 1) + edge.face[1] * centroid(ring, i);
    matrix.row(ring.face(i)) = centroid(ring, i);
  }
  if (vertex.crease != 0)
    for (int end : vertex.crease_ends) matrix(0, ring.edge(end)) += vertex.crease;
  return matrix;
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

/// Refines until no finite sharpness is left; returns the product of the rules on the way.
Matrix decay(RingSharpness& ring) {
  const int size = Ring{static_cast<int>(ring.edges.size())}.size();
  Matrix product = Matrix::Identity(size, size);
  while (!is_stationary(ring)) {
    product = ring_matrix(ring) * product;
    ring.corner = child_sharpness(ring.corner);
    for (float& s : ring.edges) s = child_sharpness(s);
  }
  return product;
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
  constexpr int kSquarings = 9;  // 512 refinements: the next eigenvalue of any usual valence has vanished
  Matrix power = ring_matrix(sharpness);
  for (int i = 0; i < kSquarings; ++i) power = (power * power).eval();
  return power.row(0) / power.row(0).sum();
}

Row stationary_limit(const RingSharpness& sharpness) {
  const Ring ring{static_cast<int>(sharpness.edges.size())};
  const std::vector<int> ends = sharp_edges(sharpness);
  if (sharpness.corner > 0 || ends.size() > 2) return Row::Unit(ring.size(), 0);
  if (ends.size() == 2) return crease_limit(ring, ends[0], ends[1]);
  return ends.empty() ? smooth_limit(ring) : dart_limit(sharpness);
}

/// The dominant eigenvalue of the Fourier mode of angle t around a vertex, and the weight of faces against edges in
/// its left eigenvector.
struct Mode {
  double eigenvalue, face_weight;
};

Mode fourier_mode(double t) {
  const double c = std::cos(t), half = std::cos(t / 2);
  const double lambda = (5 + c + std::sqrt((c + 9) * (c + 1))) / 16;
  // At t = pi edges and faces do not mix and the face alone is left.
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

/// Into a sector of `count` quads from edge `first`: sine weights inside, the rest from the left eigenvector equations
/// of the vertex and of the two border edges.
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
  // Unknown: weight a of the vertex, b of both border edges.
  //   (lambda - 1/2) b - a / 8 = into_border,   (lambda - 3/4) a - b = into_vertex     (crease)
  // At a corner the vertex takes nothing from the border: (lambda - 1/2) b = into_border, and the weights sum to 0.
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

std::vector<double> to_mask(const Row& row) { return {row.data(), row.data() + row.size()}; }

}  // namespace

RingMask limit_mask(const RingSharpness& sharpness) {
  if (is_stationary(sharpness)) return to_mask(stationary_limit(sharpness));
  RingSharpness ring = sharpness;
  const Matrix before = decay(ring);
  return to_mask(stationary_limit(ring) * before);
}

std::vector<TangentSector> tangent_masks(const RingSharpness& sharpness) {
  RingSharpness stationary = sharpness;
  Matrix before = decay(stationary);
  const Ring ring{static_cast<int>(sharpness.edges.size())};
  const std::vector<int> ends = sharp_edges(stationary);
  std::vector<TangentSector> sectors;
  const auto add = [&](int first, int count, const std::array<Row, 2>& tangents) {
    sectors.push_back({first, count, to_mask(tangents[0] * before), to_mask(tangents[1] * before)});
  };
  if (ends.size() < 2) {
    if (ends.size() == 1) {
      // No closed form: the differences that are left after many refinements, scaled back to size.
      constexpr int kRefinements = 24;
      const Matrix step = ring_matrix(stationary);
      for (int i = 0; i < kRefinements; ++i) before = (2 * (step * before)).eval();
    }
    add(0, ring.n, smooth_tangents(ring));
    return sectors;
  }
  const bool corner = stationary.corner > 0 || ends.size() > 2;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const int first = ends[i], count = (ends[(i + 1) % ends.size()] - first + ring.n) % ring.n;
    add(first, count, sector_tangents(ring, first, count, corner));
  }
  return sectors;
}

}  // namespace subvol
