// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/energies/quality_energy.h"

#include "subvol/base/error.h"
#include "subvol/fit/certificate/certificate.h"
#include "subvol/fit/elements/shape_functions.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <string>
#include <utility>

namespace subvol::internal {

namespace {

// Per direction, the corners among them; dense after `densify`.
constexpr int kQualityPointsPerDirection = 3, kDensePoints = 5;
constexpr double kLeastDirectionLength = 1e-9;  // lengths of directions are not below this share of the cell's
constexpr double kNoCap = 1;                    // scaled Jacobians are at most 1
constexpr double kLeastGoalShare = -1;          // no inverted cell is worse than another one
constexpr double kFoldGoal = 0.5;  // residual of a fold that is good enough: 330 degrees if the limit is 300

constexpr double kSamePlace = 1e-12;  // in canonical coordinates

/// Returns the corner of a cell at a place in canonical coordinates, -1 if there is none. A tet has one point only,
/// which stands for the whole cell.
int corner_at(CellKind kind, const Vec3& at) {
  if (kind == CellKind::tet) return -1;
  const std::span<const Vec3> corners = canonical_vertices(kind);
  for (std::size_t a = 0; a < corners.size(); ++a)
    if ((at - corners[a]).norm() < kSamePlace) return static_cast<int>(a);
  return -1;
}

/// Returns the edge on which a place lies, as above.
int edge_at(CellKind kind, const Vec3& at) {
  if (kind == CellKind::tet) return -1;
  const CellTopology& topology = cell_topology(kind);
  for (int e = 0; e < topology.num_edges; ++e) {
    const Vec3 &a = canonical_vertices(kind)[topology.edges[e][0]], &b = canonical_vertices(kind)[topology.edges[e][1]];
    if ((at - a).norm() + (at - b).norm() < (b - a).norm() + kSamePlace) return e;
  }
  return -1;
}

/// The three directions at a point, divided by their lengths, and their scaled Jacobian.
struct Frame {
  std::array<Vec3, 3> u;  ///< of length 1, less for directions shorter than the least length
  std::array<double, 3> own_length;
  std::array<double, 3> length;  ///< the least length for shorter ones
  Vec3 cross12;
  double s;

  Frame(std::span<const ElementRule::Entry> entries, const Vec3* corners, double least_length) {
    std::array<Vec3, 3> d{Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
    for (const ElementRule::Entry& entry : entries)
      for (int k = 0; k < 3; ++k) d[k] += entry.gradient[k] * corners[entry.vertex];
    for (int k = 0; k < 3; ++k) {
      own_length[k] = d[k].norm();
      length[k] = std::max(own_length[k], least_length);
      u[k] = d[k] / length[k];
    }
    cross12 = u[1].cross(u[2]);
    s = u[0].dot(cross12);
  }

  /// Derivative by d_k of u_k . v, for a v that does not depend on it.
  Vec3 derivative_along(int k, const Vec3& v) const {
    if (own_length[k] < length[k]) return v / length[k];
    return (v - u[k].dot(v) * u[k]) / length[k];
  }

  /// ds/dd_k for k = 0, 1, 2.
  std::array<Vec3, 3> derivative() const {
    return {derivative_along(0, cross12), derivative_along(1, u[2].cross(u[0])), derivative_along(2, u[0].cross(u[1]))};
  }
};

/// Adds to a cell's energy what it has for quads that are no parallelograms, and the derivatives to `sums`.
/// x       corners of the cell.
/// weight  of |x_0 - x_1 + x_2 - x_3|^2.
template <bool kDerivatives, class Sums>
[[gnu::always_inline]] inline void add_twist(const CellTopology& topology, const std::array<Vec3, kMaxCellVertices>& x,
                                             double weight, double& energy, Sums& sums) {
  for (int f = 0; f < topology.num_faces; ++f) {
    if (topology.face_sizes[f] != 4) continue;
    const auto& face = topology.faces[f];
    const Vec3 residual = x[face[0]] - x[face[1]] + x[face[2]] - x[face[3]];
    energy += weight * residual.squaredNorm();
    if constexpr (kDerivatives)
      for (int a = 0; a < 4; ++a) {
        const double sign = a % 2 == 0 ? 1 : -1;
        sums.gradient[face[a]] += (2 * weight * sign) * residual;
        for (int b = 0; b < 4; ++b)
          if (face[a] <= face[b])
            sums.blocks[kMaxCellVertices * face[a] + face[b]].diagonal().array() +=
                2 * weight * sign * (b % 2 == 0 ? 1 : -1);
      }
  }
}

}  // namespace

/// Gradient and upper blocks of the Hessian of one cell, by pairs of corners a <= b.
struct QualityEnergy::CellSums {
  std::array<Vec3, kMaxCellVertices> gradient;
  std::array<Mat3, kMaxCellVertices * kMaxCellVertices> blocks;

  void clear(int corners) {
    for (int a = 0; a < corners; ++a) {
      gradient[a].setZero();
      for (int b = a; b < corners; ++b) blocks[kMaxCellVertices * a + b].setZero();
    }
  }

  /// Adds weight * residual^2, where the residual has the derivatives dr/dd_k by the directions at a point.
  void add(std::span<const ElementRule::Entry> entries, double weight, double residual,
           const std::array<Vec3, 3>& derivatives) {
    std::array<Vec3, kMaxCellVertices> j;
    for (std::size_t a = 0; a < entries.size(); ++a) {
      const auto& g = entries[a].gradient;
      j[a] = g[0] * derivatives[0] + g[1] * derivatives[1] + g[2] * derivatives[2];
      gradient[entries[a].vertex] += (2 * weight * residual) * j[a];
    }
    for (std::size_t a = 0; a < entries.size(); ++a) {
      const Vec3 scaled = (2 * weight) * j[a];
      for (std::size_t b = a; b < entries.size(); ++b)
        blocks[kMaxCellVertices * entries[a].vertex + entries[b].vertex].noalias() += scaled * j[b].transpose();
    }
  }
};

QualityEnergy::Points QualityEnergy::make_points(CellKind kind, int points_per_direction, double inner_weight) {
  Points points{make_element_rule(kind, points_per_direction), {}, {}, {}, {}};
  points.jacobians = PointJacobians(points.rule);
  const double corner_weight = 1.0 / cell_topology(kind).num_trivalent;
  for (const Vec3& at : points.rule.points) {
    const int corner = corner_at(kind, at);
    points.corner.push_back(corner);
    points.edge.push_back(corner >= 0 ? -1 : edge_at(kind, at));
    points.weights.push_back(kind == CellKind::tet ? 1 : corner >= 0 ? corner_weight : inner_weight);
  }
  return points;
}

QualityEnergy::QualityEnergy(const VolumeMesh& mesh, std::span<const Vec3> lengths, const QualityTuning& tuning)
    : mesh_(&mesh),
      tuning_(tuning),
      lengths_(lengths.begin(), lengths.end()),
      dense_(mesh.num_cells(), 0),
      corner_emphasis_(mesh.cell_vertices.size(), 1),
      cell_emphasis_(mesh.num_cells(), 1),
      blocks_(mesh) {
  if (lengths.size() != mesh.num_cells())
    throw InputError("QualityEnergy: lengths must hold one entry per cell (" + std::to_string(mesh.num_cells()) +
                     "), got " + std::to_string(lengths.size()));
  for (const Vec3& h : lengths)
    if (!(h.minCoeff() > 0) || !h.allFinite()) throw InputError("QualityEnergy: lengths must be positive and finite");
  for (int kind = 0; kind < kNumCellKinds; ++kind)
    points_[kind] = {make_points(static_cast<CellKind>(kind), kQualityPointsPerDirection, tuning.inner_weight),
                     make_points(static_cast<CellKind>(kind), kDensePoints, tuning.inner_weight)};
  const std::vector<int> colors = color_cells(mesh);
  const int num_colors = colors.empty() ? 0 : *std::max_element(colors.begin(), colors.end()) + 1;
  color_offsets_.assign(num_colors + 1, 0);
  for (const int color : colors) ++color_offsets_[color + 1];
  for (int color = 0; color < num_colors; ++color) color_offsets_[color + 1] += color_offsets_[color];
  std::vector<std::size_t> next(color_offsets_.begin(), color_offsets_.end() - 1);
  order_.resize(colors.size());
  for (std::size_t c = 0; c < colors.size(); ++c) order_[next[colors[c]]++] = static_cast<Index>(c);
}

QualityEnergy::QualityEnergy(const QualityEnergy& whole, const VolumeMesh& part, std::span<const Index> cells)
    : QualityEnergy(
          part,
          [&] {
            std::vector<Vec3> lengths;
            for (const Index c : cells) lengths.push_back(whole.lengths_[c]);
            return lengths;
          }(),
          whole.tuning_) {
  weights_ = whole.weights_;
  if (!whole.caps_of_cell_.empty()) caps_of_cell_.assign(cells.size(), kNoIndex);
  for (std::size_t c = 0; c < cells.size(); ++c) {
    dense_[c] = whole.dense_[cells[c]];
    if (whole.caps_of_cell_.empty() || whole.caps_of_cell_[cells[c]] == kNoIndex) continue;
    caps_of_cell_[c] = static_cast<Index>(caps_.size());
    caps_.push_back(whole.caps_[whole.caps_of_cell_[cells[c]]]);
  }
  if (!whole.folds_) return;
  folds_.emplace(*whole.folds_, cells);
  live_edge_ = whole.live_edge_;
  fold_emphasis_.assign(folds_->size(), 1);
}

void QualityEnergy::set_weights(const QualityWeights& weights) {
  for (const double w : {weights.cosine, weights.hinge, weights.edge, weights.least_edge, weights.twist})
    if (!(w >= 0) || !std::isfinite(w)) throw InputError("QualityWeights: weights must be >= 0 and finite");
  if (!(weights.threshold <= 1)) throw InputError("QualityWeights: the threshold must be at most 1");
  weights_ = weights;
}

void QualityEnergy::set_caps(std::span<const EdgeCap> edges, std::span<const VertexCap> vertices) {
  std::vector<double> of_vertex(mesh_->num_vertices(), kNoCap);
  for (const VertexCap& v : vertices) of_vertex[v.vertex] = std::min(of_vertex[v.vertex], v.cap);
  std::map<std::pair<Index, Index>, double> of_edge;
  std::vector<std::uint8_t> has_cap(mesh_->num_vertices(), 0);
  for (const EdgeCap& edge : edges) {
    const auto [at, added] = of_edge.try_emplace(std::minmax(edge.ends[0], edge.ends[1]), edge.cap);
    at->second = std::min(at->second, edge.cap);
    for (const Index v : edge.ends) has_cap[v] = 1;
  }
  caps_.clear();
  caps_of_cell_.assign(mesh_->num_cells(), kNoIndex);
  for (std::size_t c = 0; c < mesh_->num_cells(); ++c) {
    const auto cell = mesh_->cell(c);
    const bool concerned =
        std::any_of(cell.begin(), cell.end(), [&](Index v) { return has_cap[v] != 0 || of_vertex[v] < kNoCap; });
    if (!concerned) continue;
    CellCaps caps;
    caps.edges.fill(kNoCap);
    for (std::size_t a = 0; a < cell.size(); ++a) caps.corners[a] = of_vertex[cell[a]];
    const CellTopology& topology = cell_topology(mesh_->kinds[c]);
    for (int e = 0; e < topology.num_edges; ++e) {
      const int a = topology.edges[e][0], b = topology.edges[e][1];
      const auto at = of_edge.find(std::minmax(cell[a], cell[b]));
      if (at == of_edge.end()) continue;
      caps.edges[e] = at->second;
      for (const int end : {a, b}) caps.corners[end] = std::min(caps.corners[end], at->second);
    }
    caps_of_cell_[c] = static_cast<Index>(caps_.size());
    caps_.push_back(caps);
  }
}

void QualityEnergy::forbid_folds(std::span<const EdgeCap> edges, double least_edge) {
  live_edge_ = least_edge;
  folds_.emplace(*mesh_, tuning_.least_fold_limit);
  folds_->want(edges, *mesh_);
  fold_emphasis_.assign(folds_->size(), 1);
}

/// Returns the cap at a point of a cell.
double QualityEnergy::cap(std::size_t cell, const Points& points, std::size_t q) const {
  if (caps_of_cell_.empty() || caps_of_cell_[cell] == kNoIndex) return kNoCap;
  const CellCaps& caps = caps_[caps_of_cell_[cell]];
  if (points.corner[q] >= 0) return caps.corners[points.corner[q]];
  return points.edge[q] >= 0 ? caps.edges[points.edge[q]] : kNoCap;
}

/// Returns the cell's energy; with derivatives, also adds those to `sums`.
template <bool kDerivatives>
double QualityEnergy::evaluate(std::size_t cell, std::span<const Vec3> nodes, CellSums& sums) const {
  const auto vertices = mesh_->cell(cell);
  const Points& points = points_of(cell);
  std::array<Vec3, kMaxCellVertices> x;
  for (std::size_t a = 0; a < vertices.size(); ++a) x[a] = nodes[vertices[a]];
  const Vec3& h = lengths_[cell];
  const double least_length = tuning_.least_length * h.minCoeff();
  double energy = 0;
  const auto add = [&](std::size_t q, double weight, double residual, const std::array<Vec3, 3>& derivatives) {
    energy += weight * residual * residual;
    if constexpr (kDerivatives) sums.add(points.rule.point(q), weight, residual, derivatives);
  };
  std::array<double, PointJacobians::kMostPointJacobians> jacobians;
  points.jacobians.evaluate(x.data(), least_length, jacobians.data());
  for (std::size_t q = 0; q < points.rule.num_points(); ++q) {
    constexpr double kPointJacobianRounding = 1e-9;  // more than `Frame` and `PointJacobians` differ by
    const int corner = points.corner[q];
    const double threshold = std::min(weights_.threshold, cap(cell, points, q));
    const bool has_hinge_only = corner < 0 && mesh_->kinds[cell] != CellKind::tet;
    if (has_hinge_only && jacobians[q] > threshold + kPointJacobianRounding) continue;
    const Frame frame(points.rule.point(q), x.data(), least_length);
    const double below = threshold - frame.s;
    if (below > 0) {
      std::array<Vec3, 3> derivative;
      if constexpr (kDerivatives) {
        derivative = frame.derivative();
        for (Vec3& d : derivative) d = -d;
      }
      add(q, weights_.hinge * points.weights[q] * emphasis(cell, corner), below, derivative);
    }
    if (has_hinge_only) continue;
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3;
      const double cosine = frame.u[i].dot(frame.u[j]);
      std::array<Vec3, 3> derivative{Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
      if constexpr (kDerivatives) {
        derivative[i] = frame.derivative_along(i, frame.u[j]);
        derivative[j] = frame.derivative_along(j, frame.u[i]);
      }
      add(q, weights_.cosine * points.weights[q], cosine, derivative);
      const double least = weights_.least_edge * h[i], short_by = 1 - frame.own_length[i] / least;
      if (!(short_by > 0)) continue;
      derivative = {Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
      if constexpr (kDerivatives) derivative[i] = -frame.u[i].normalized() / least;
      add(q, weights_.edge * points.weights[q] * emphasis(cell, corner), short_by, derivative);
    }
  }
  const double twist = weights_.twist / (6 * std::pow(h.prod(), 2.0 / 3));
  add_twist<kDerivatives>(cell_topology(mesh_->kinds[cell]), x, twist, energy, sums);
  return energy;
}

/// Adds to the gradient and the Hessian what folds contribute. Few edges are folded, so this is serial.
double QualityEnergy::add_fold_derivatives(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient,
                                           BlockSparse* hessian) const {
  if (!folds_) return 0;
  const std::vector<double> residuals = folds_->residuals(*mesh_, nodes);
  double sum = 0;
  for (std::size_t e = 0; e < residuals.size(); ++e) {
    if (!(residuals[e] > 0)) continue;
    sum += fold_weight(e) * residuals[e] * residuals[e];
    for (const BoundaryFolds::Side& side : folds_->linearized(e, *mesh_, nodes).sides) {
      const auto vertices = mesh_->cell(side.cell);
      const double twice = 2 * scale * fold_weight(e);
      for (std::size_t i = 0; i < side.corners.size(); ++i)
        gradient[vertices[side.corners[i]]] += (twice * residuals[e]) * side.derivative[i];
      if (!hessian) continue;
      const Index* slots = blocks_.of_cell(side.cell);
      for (std::size_t i = 0; i < side.corners.size(); ++i)
        for (std::size_t j = 0; j < side.corners.size(); ++j) {
          // (p + q)^2 <= 2 p^2 + 2 q^2 keeps both sides in their own cells.
          const Mat3 block = (2 * twice) * side.derivative[i] * side.derivative[j].transpose();
          float* at = hessian->block(slots[side.corners[i] * static_cast<int>(vertices.size()) + side.corners[j]]);
          for (int k = 0; k < 9; ++k) at[k] += static_cast<float>(block(k / 3, k % 3));
        }
    }
  }
  return sum;
}

template <bool kHessian>
double QualityEnergy::add_derivatives(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient,
                                      BlockSparse* hessian) const {
  std::vector<double> energies(mesh_->num_cells());
#pragma omp parallel
  {
    CellSums sums;
    for (std::size_t color = 0; color + 1 < color_offsets_.size(); ++color) {
#pragma omp for schedule(dynamic, 64)
      for (std::size_t i = color_offsets_[color]; i < color_offsets_[color + 1]; ++i) {
        const auto cell = static_cast<std::size_t>(order_[i]);
        const auto vertices = mesh_->cell(cell);
        const int n = static_cast<int>(vertices.size());
        sums.clear(n);
        energies[cell] = evaluate<true>(cell, nodes, sums);
        for (int a = 0; a < n; ++a) gradient[vertices[a]] += scale * sums.gradient[a];
        if constexpr (!kHessian) continue;
        const Index* slots = blocks_.of_cell(cell);
        for (int a = 0; a < n; ++a)
          for (int b = a; b < n; ++b) {
            const Mat3& block = sums.blocks[kMaxCellVertices * a + b];
            float* upper = hessian->block(slots[a * n + b]);
            for (int e = 0; e < 9; ++e) upper[e] += static_cast<float>(scale * block(e / 3, e % 3));
            if (a == b) continue;
            float* lower = hessian->block(slots[b * n + a]);
            for (int e = 0; e < 9; ++e) lower[e] += static_cast<float>(scale * block(e % 3, e / 3));
          }
      }
    }
  }
  double sum = add_fold_derivatives(nodes, scale, gradient, kHessian ? hessian : nullptr);
  for (const double energy : energies) sum += energy;
  return sum;
}

double QualityEnergy::value(std::span<const Vec3> nodes) const {
  const std::vector<double> energies = cell_values(nodes);
  return std::accumulate(energies.begin(), energies.end(), 0.0);
}

std::vector<double> QualityEnergy::cell_values(std::span<const Vec3> nodes) const {
  std::vector<double> energies(mesh_->num_cells());
#pragma omp parallel
  {
    CellSums unused;
#pragma omp for schedule(static)
    for (std::size_t c = 0; c < energies.size(); ++c) energies[c] = evaluate<false>(c, nodes, unused);
  }
  if (!folds_) return energies;
  const std::vector<double> residuals = folds_->residuals(*mesh_, nodes);
  for (std::size_t e = 0; e < residuals.size(); ++e) {
    if (!(residuals[e] > 0)) continue;
    for (const Index c : folds_->cells_of(e)) energies[c] += 0.5 * fold_weight(e) * residuals[e] * residuals[e];
  }
  return energies;
}

double QualityEnergy::add_gradient(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient) const {
  return add_derivatives<false>(nodes, scale, gradient, nullptr);
}

double QualityEnergy::linearize(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient) {
  if (hessian_.blocks.empty()) hessian_ = blocks_.zero_matrix();
  hessian_.set_zero();
  return add_derivatives<true>(nodes, scale, gradient, &hessian_);
}

void QualityEnergy::add_diagonal_blocks(const SparseMap& map, const SparseMap& map_transposed,
                                        std::span<Mat3> diagonal) const {
  internal::add_diagonal_blocks(map, map_transposed, hessian_, diagonal);
}

double QualityEnergy::least_scaled_jacobian(std::size_t cell, const Points& points, std::span<const Vec3> nodes) const {
  const auto vertices = mesh_->cell(cell);
  std::array<Vec3, kMaxCellVertices> x;
  for (std::size_t a = 0; a < vertices.size(); ++a) x[a] = nodes[vertices[a]];
  const double least_length = kLeastDirectionLength * lengths_[cell].minCoeff();
  return std::min(1.0, points.jacobians.least(x.data(), least_length));
}

void QualityEnergy::least_scaled_jacobians(std::span<const Vec3> nodes, std::span<double> least) const {
  if (least.size() != mesh_->num_cells()) throw InputError("QualityEnergy: expected one place per cell");
#pragma omp parallel for schedule(static)
  for (std::size_t c = 0; c < least.size(); ++c) least[c] = least_scaled_jacobian(c, points_of(c), nodes);
}

std::vector<Index> QualityEnergy::poor_between_points(std::span<const Vec3> nodes, double goal) const {
  std::vector<std::uint8_t> is_poor(mesh_->num_cells());
#pragma omp parallel for schedule(static)
  for (std::size_t c = 0; c < is_poor.size(); ++c) {
    if (dense_[c] != 0 || (!caps_of_cell_.empty() && caps_of_cell_[c] != kNoIndex)) continue;
    const Points& dense = points_[static_cast<std::size_t>(mesh_->kinds[c])][1];
    is_poor[c] = least_scaled_jacobian(c, points_of(c), nodes) >= goal && least_scaled_jacobian(c, dense, nodes) < goal;
  }
  std::vector<Index> result;
  for (std::size_t c = 0; c < is_poor.size(); ++c)
    if (is_poor[c]) result.push_back(static_cast<Index>(c));
  return result;
}

QualityEnergy::State QualityEnergy::emphasize_poor(std::span<const Vec3> nodes, double goal) {
  std::vector<double> least(mesh_->num_cells()), shares(mesh_->num_cells());
  const auto update = [this](double share, double& emphasis) {
    emphasis = share < 1 ? std::min(tuning_.most_emphasis, tuning_.emphasis_rise * emphasis)
                         : std::max(1.0, tuning_.emphasis_fall * emphasis);
  };
#pragma omp parallel for schedule(static)
  for (std::size_t c = 0; c < least.size(); ++c) {
    const auto vertices = mesh_->cell(c);
    const Points& points = points_of(c);
    std::array<Vec3, kMaxCellVertices> x;
    for (std::size_t a = 0; a < vertices.size(); ++a) x[a] = nodes[vertices[a]];
    double inner = 1, all = 1;
    least[c] = 1;
    for (std::size_t q = 0; q < points.rule.num_points(); ++q) {
      const Frame frame(points.rule.point(q), x.data(), kLeastDirectionLength * lengths_[c].minCoeff());
      const double s = frame.s;
      const double at_cap = cap(c, points, q);
      const double own_goal =
          at_cap < kNoCap ? std::min(goal, std::max(tuning_.least_goal, at_cap - tuning_.below_cap)) : goal;
      double share = std::clamp(s / own_goal, kLeastGoalShare, 1.0);
      if (live_edge_ > 0 && points.corner[q] >= 0)
        for (int k = 0; k < 3; ++k) share = std::min(share, frame.length[k] / (live_edge_ * lengths_[c][k]));
      least[c] = std::min(least[c], s);
      all = std::min(all, share);
      if (points.corner[q] >= 0)
        update(share, corner_emphasis_[mesh_->cell_offsets[c] + points.corner[q]]);
      else
        inner = std::min(inner, share);
    }
    update(inner, cell_emphasis_[c]);
    shares[c] = all;
  }
  if (folds_) {
    const std::vector<double> folded = folds_->residuals(*mesh_, nodes);
    for (std::size_t e = 0; e < folded.size(); ++e) {
      const double share = std::min(1.0, (1 - folded[e]) / (1 - kFoldGoal));
      update(share, fold_emphasis_[e]);
      for (const Index c : folds_->cells_of(e)) shares[c] = std::min(shares[c], share);
    }
  }
  State state;
  for (std::size_t c = 0; c < least.size(); ++c) {
    state.least = std::min(state.least, least[c]);
    state.least_share = std::min(state.least_share, shares[c]);
    if (!(shares[c] < 1)) continue;
    state.poor.push_back(static_cast<Index>(c));
    state.shares.push_back(shares[c]);
  }
  return state;
}

void QualityEnergy::reset_emphasis() {
  std::fill(corner_emphasis_.begin(), corner_emphasis_.end(), 1.0);
  std::fill(cell_emphasis_.begin(), cell_emphasis_.end(), 1.0);
  std::fill(fold_emphasis_.begin(), fold_emphasis_.end(), 1.0);
}

std::vector<Index> QualityEnergy::uncertified(std::span<const Vec3> nodes) const {
  return certify(nodes, *mesh_).not_certified;
}

std::vector<Index> QualityEnergy::ruined(std::span<const Vec3> before, std::span<const Vec3> after) const {
  // Scaled Jacobian from which on no loss matters. Below it, a cell must keep half of what it had, and an inverted cell
  // may lose this much.
  constexpr double kAcceptableScaledJacobian = 0.05, kKeptShare = 0.5, kMostLoss = 0.02;
  std::vector<std::uint8_t> is_ruined(mesh_->num_cells());
#pragma omp parallel for schedule(static)
  for (std::size_t c = 0; c < is_ruined.size(); ++c) {
    const double now = least_scaled_jacobian(c, points_of(c), after);
    if (now >= kAcceptableScaledJacobian) continue;
    const double was = least_scaled_jacobian(c, points_of(c), before);
    is_ruined[c] = was > 0 ? now < kKeptShare * was : now < was - kMostLoss;
  }
  std::vector<Index> result;
  for (std::size_t c = 0; c < is_ruined.size(); ++c)
    if (is_ruined[c]) result.push_back(static_cast<Index>(c));
  return result;
}

std::vector<Index> QualityEnergy::nodes_of(std::span<const Index> cells) const {
  std::vector<Index> nodes;
  for (const Index c : cells) {
    const auto vertices = mesh_->cell(c);
    nodes.insert(nodes.end(), vertices.begin(), vertices.end());
  }
  return nodes;
}

void QualityEnergy::densify(std::span<const Index> cells, std::span<const Vec3>) {
  for (const Index c : cells) {
    if (c < 0 || static_cast<std::size_t>(c) >= dense_.size())
      throw InputError("QualityEnergy: there is no cell " + std::to_string(c));
    dense_[c] = 1;
  }
}

}  // namespace subvol::internal
