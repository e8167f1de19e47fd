// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/energies/volume_energy.h"

#include "subvol/base/error.h"
#include "subvol/fit/certificate/certificate.h"
#include "subvol/fit/energies/cell_kernels.h"
#include "subvol/fit/energies/step_limit.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace subvol::internal {

VolumeEnergy::VolumeEnergy(const VolumeMesh& mesh, std::span<const Vec3> ideal_lengths, int points_per_direction)
    : mesh_(&mesh),
      num_nodes_(mesh.num_vertices()),
      weights_(mesh.num_cells(), 1.0 / static_cast<double>(std::max<std::size_t>(mesh.num_cells(), 1))),
      points_(mesh.num_cells(), points_per_direction),
      colors_(color_cells(mesh)),
      blocks_(mesh) {
  if (ideal_lengths.size() != mesh.num_cells())
    throw InputError("VolumeEnergy: ideal_lengths must hold one entry per cell (" + std::to_string(mesh.num_cells()) +
                     "), got " + std::to_string(ideal_lengths.size()));
  inverse_lengths_.reserve(ideal_lengths.size());
  for (const Vec3& h : ideal_lengths) {
    if (!(h.minCoeff() > 0) || !h.allFinite())
      throw InputError("VolumeEnergy: ideal_lengths must be positive and finite");
    inverse_lengths_.push_back(h.cwiseInverse());
  }
  rebuild_groups();
}

VolumeEnergy::VolumeEnergy(const VolumeMesh& mesh, CellReference reference, int points_per_direction)
    : mesh_(&mesh),
      num_nodes_(mesh.num_vertices()),
      inverse_lengths_(mesh.num_cells(), Vec3::Ones()),
      weights_(mesh.num_cells(), 1.0 / static_cast<double>(std::max<std::size_t>(mesh.num_cells(), 1))),
      reference_(std::move(reference)),
      points_(mesh.num_cells(), points_per_direction),
      colors_(color_cells(mesh)),
      blocks_(mesh) {
  rebuild_groups();
}

void VolumeEnergy::densify(std::span<const Index> cells, std::span<const Vec3>) {
  constexpr int kDensePoints = 5;  // per direction, as on level 1
  for (Index c : cells) {
    if (c < 0 || static_cast<std::size_t>(c) >= points_.size())
      throw InputError("VolumeEnergy: there is no cell " + std::to_string(c));
    points_[c] = std::max(points_[c], kDensePoints);
  }
  rebuild_groups();
}

void VolumeEnergy::rebuild_groups() {
  // Cells by (kind, points, color), each list in ascending order.
  std::map<std::pair<int, int>, std::vector<std::vector<Index>>> lists;
  for (std::size_t c = 0; c < mesh_->num_cells(); ++c) {
    auto& by_color = lists[{static_cast<int>(mesh_->kinds[c]), points_[c]}];
    if (by_color.size() <= static_cast<std::size_t>(colors_[c])) by_color.resize(colors_[c] + 1);
    by_color[colors_[c]].push_back(static_cast<Index>(c));
  }
  groups_.clear();
  for (const auto& [key, by_color] : lists) {
    Group& group = groups_.emplace_back();
    group.rule = make_element_rule(static_cast<CellKind>(key.first), key.second);
    group.color_offsets.assign(1, 0);
    for (const std::vector<Index>& cells : by_color) {
      for (std::size_t i = 0; i < cells.size(); i += kSimdLanes) {
        auto& batch = group.batches.emplace_back();
        for (std::size_t l = 0; l < kSimdLanes; ++l) batch[l] = cells[std::min(i + l, cells.size() - 1)];
        group.active.push_back(static_cast<int>(std::min<std::size_t>(kSimdLanes, cells.size() - i)));
      }
      group.color_offsets.push_back(group.batches.size());
    }
    if (reference_) fill_references(group);
  }
}

void VolumeEnergy::fill_references(Group& group) const {
  const std::size_t num_points = group.rule.num_points();
  const Mat3 ideal = ideal_matrix(group.rule.kind);
  group.to_reference.resize(group.batches.size() * num_points * 9 * kSimdLanes);
  constexpr Index kNoBadCell = std::numeric_limits<Index>::max();
  Index bad_cell = kNoBadCell;
#pragma omp parallel for schedule(static) reduction(min : bad_cell)
  for (std::size_t b = 0; b < group.batches.size(); ++b)
    for (std::size_t q = 0; q < num_points; ++q)
      for (int l = 0; l < kSimdLanes; ++l) {
        const Mat3 reference = reference_(group.batches[b][l], group.rule.points[q]);
        const Mat3 to_reference = ideal * reference.inverse();
        if (!(reference.determinant() > 0) || !to_reference.allFinite())
          bad_cell = std::min(bad_cell, group.batches[b][l]);
        for (int e = 0; e < 9; ++e)
          group.to_reference[(9 * (b * num_points + q) + e) * kSimdLanes + l] = to_reference(e / 3, e % 3);
      }
  if (bad_cell != kNoBadCell)
    throw InputError("VolumeEnergy: the reference of cell " + std::to_string(bad_cell) + " has no positive volume");
}

void VolumeEnergy::gather(const Group& group, std::size_t batch, std::span<const Vec3> nodes,
                          double (*x)[3][kSimdLanes]) const {
  const int n = cell_topology(group.rule.kind).num_vertices;
  for (int l = 0; l < kSimdLanes; ++l) {
    const Index* corners = mesh_->cell_vertices.data() + mesh_->cell_offsets[group.batches[batch][l]];
    for (int a = 0; a < n; ++a)
      for (int r = 0; r < 3; ++r) x[a][r][l] = nodes[corners[a]][r];
  }
}

/// Runs per_batch(group, batch number) over all batches, color by color, and sums the returned values in batch order.
template <class PerBatch>
double VolumeEnergy::sum_batches(PerBatch&& per_batch) const {
  double total = 0;
  for (const Group& group : groups_) {
    std::vector<double> sums(group.batches.size());
#pragma omp parallel
    for (std::size_t color = 0; color + 1 < group.color_offsets.size(); ++color) {
#pragma omp for schedule(static)
      for (std::size_t b = group.color_offsets[color]; b < group.color_offsets[color + 1]; ++b)
        sums[b] = per_batch(group, b);
    }
    for (double s : sums) total += s;
  }
  return total;
}

/// Corners and ideal cells of one batch.
struct VolumeEnergy::BatchState {
  alignas(64) double x[kMaxCellVertices][3][kSimdLanes], inverse_h[3][kSimdLanes];

  BatchState(const VolumeEnergy& energy, const Group& group, std::size_t batch, std::span<const Vec3> nodes) {
    energy.gather(group, batch, nodes, x);
    for (int c = 0; c < 3; ++c)
      for (int l = 0; l < kSimdLanes; ++l) inverse_h[c][l] = energy.inverse_lengths_[group.batches[batch][l]][c];
  }
};

/// Evaluates a kernel at all points of a batch, as many at a time as the kernel has batches, and calls
/// per_point(q, kernel batch) with the results.
template <class Kernel, class PerPoint>
void VolumeEnergy::for_points(const Group& group, std::size_t b, const BatchState& state, Kernel& kernel,
                              void (Kernel::*evaluate)(int), const PerPoint& per_point) const {
  const std::size_t num_points = group.rule.num_points(), at_once = std::size(kernel.batches);
  for (std::size_t first = 0; first < num_points; first += at_once) {
    const int count = static_cast<int>(std::min(at_once, num_points - first));
    for (int n = 0; n < count; ++n) {
      auto& jacobian = kernel.batches[n].jacobian;
      jacobians(group.rule.point(first + n), state.x, state.inverse_h, jacobian);
      if (reference_) multiply_lanes(jacobian, group.reference(b, first + n));
    }
    (kernel.*evaluate)(count);
    for (int n = 0; n < count; ++n) per_point(first + n, kernel.batches[n]);
  }
}

template <class Kernel>
double VolumeEnergy::value_of(std::span<const Vec3> nodes) const {
  return sum_batches([&](const Group& group, std::size_t b) {
    const BatchState state(*this, group, b, nodes);
    Kernel kernel(epsilon_, *kernels_, floor_);
    double sum = 0;
    for_points(group, b, state, kernel, &Kernel::evaluate_energy, [&](std::size_t q, const auto& batch) {
      for (int l = 0; l < group.active[b]; ++l)
        sum += weights_[group.batches[b][l]] * group.rule.weights[q] * batch.energy[l];
    });
    return sum;
  });
}

template <class Kernel>
double VolumeEnergy::gradient_of(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient) const {
  // Feasibility is known only at the end: the gradient is gathered in a copy, so that an infeasible state adds nothing.
  std::vector<Vec3> local(num_nodes_, Vec3::Zero());
  const double energy = sum_batches([&](const Group& group, std::size_t b) {
    const BatchState state(*this, group, b, nodes);
    alignas(64) double g[kMaxCellVertices][3][kSimdLanes] = {}, factor[3][kSimdLanes];
    Kernel kernel(epsilon_, *kernels_, floor_);
    double sum = 0;
    for_points(group, b, state, kernel, &Kernel::evaluate_gradient, [&](std::size_t q, auto& batch) {
      if (reference_) multiply_lanes_transposed(batch.stress, group.reference(b, q));
      for (int l = 0; l < kSimdLanes; ++l) {
        const double w = weights_[group.batches[b][l]] * group.rule.weights[q];
        for (int c = 0; c < 3; ++c) factor[c][l] = scale * w * state.inverse_h[c][l];
        if (l < group.active[b]) sum += w * batch.energy[l];
      }
      add_point_gradient(group.rule.point(q), batch.stress, factor, g);
    });
    const int n = cell_topology(group.rule.kind).num_vertices;
    for (int l = 0; l < group.active[b]; ++l) {
      const Index* corners = mesh_->cell_vertices.data() + mesh_->cell_offsets[group.batches[b][l]];
      for (int a = 0; a < n; ++a) local[corners[a]] += Vec3(g[a][0][l], g[a][1][l], g[a][2][l]);
    }
    return sum;
  });
  if (energy < kInfinity) {
#pragma omp parallel for schedule(static)
    for (std::size_t i = 0; i < num_nodes_; ++i) gradient[i] += local[i];
  }
  return energy;
}

template <class Kernel>
double VolumeEnergy::hessian_of(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient,
                                BlockSparse& hessian) const {
  return sum_batches([&](const Group& group, std::size_t b) {
    constexpr int n_max = kMaxCellVertices;
    const BatchState state(*this, group, b, nodes);
    alignas(64) double g[n_max][3][kSimdLanes] = {}, k[n_max * n_max][9][kSimdLanes], factor[3][kSimdLanes],
                       weight[kSimdLanes];
    Kernel kernel(epsilon_, *kernels_, floor_);
    const int n = cell_topology(group.rule.kind).num_vertices;
    for (int a = 0; a < n; ++a)
      for (int c = a; c < n; ++c) std::fill_n(&k[a * n_max + c][0][0], 9 * kSimdLanes, 0.0);
    double sum = 0;
    for_points(group, b, state, kernel, &Kernel::evaluate_hessian, [&](std::size_t q, auto& batch) {
      const double(*reference)[kSimdLanes] = reference_ ? group.reference(b, q) : nullptr;
      if (reference) multiply_lanes_transposed(batch.stress, reference);
      for (int l = 0; l < kSimdLanes; ++l) {
        const double w = weights_[group.batches[b][l]] * group.rule.weights[q];
        weight[l] = scale * w;
        for (int c = 0; c < 3; ++c) factor[c][l] = scale * w * state.inverse_h[c][l];
        if (l < group.active[b]) sum += w * batch.energy[l];
      }
      add_point_gradient(group.rule.point(q), batch.stress, factor, g);
      kernel.add_hessian(batch, group.rule.point(q), reference, state.inverse_h, weight, k);
    });
    for (int l = 0; l < group.active[b]; ++l) {
      const Index cell = group.batches[b][l];
      const Index* corners = mesh_->cell_vertices.data() + mesh_->cell_offsets[cell];
      const Index* slots = blocks_.of_cell(cell);
      for (int a = 0; a < n; ++a) {
        gradient[corners[a]] += Vec3(g[a][0][l], g[a][1][l], g[a][2][l]);
        for (int c = a; c < n; ++c) {
          const double(*block)[kSimdLanes] = k[a * n_max + c];
          float* upper = hessian.block(slots[a * n + c]);
          for (int e = 0; e < 9; ++e) upper[e] += static_cast<float>(block[e][l]);
          if (c == a) continue;
          float* lower = hessian.block(slots[c * n + a]);
          for (int e = 0; e < 9; ++e) lower[e] += static_cast<float>(block[e % 3 * 3 + e / 3][l]);
        }
      }
    }
    return sum;
  });
}

double VolumeEnergy::value(std::span<const Vec3> nodes) const {
  return epsilon_ > 0 ? value_of<RegularizedKernel>(nodes) : value_of<DistortionKernel>(nodes);
}

double VolumeEnergy::add_gradient(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient) const {
  return epsilon_ > 0 ? gradient_of<RegularizedKernel>(nodes, scale, gradient)
                      : gradient_of<DistortionKernel>(nodes, scale, gradient);
}

double VolumeEnergy::add_hessian(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient,
                                 BlockSparse& hessian) const {
  return epsilon_ > 0 ? hessian_of<RegularizedKernel>(nodes, scale, gradient, hessian)
                      : hessian_of<DistortionKernel>(nodes, scale, gradient, hessian);
}

void VolumeEnergy::set_distortion(Distortion distortion, double floor) {
  kernels_ = &kernels_of(distortion);
  floor_ = floor;
}

void VolumeEnergy::set_regularization(double epsilon) {
  if (!(epsilon >= 0) || !std::isfinite(epsilon))
    throw InputError("VolumeEnergy: epsilon must be 0 or positive and finite");
  epsilon_ = epsilon;
}

void VolumeEnergy::set_weights(std::span<const double> weights) {
  if (weights.size() != weights_.size())
    throw InputError("VolumeEnergy: expected one weight per cell (" + std::to_string(weights_.size()) + "), got " +
                     std::to_string(weights.size()));
  double sum = 0;
  for (double w : weights) {
    if (!(w > 0) || !std::isfinite(w)) throw InputError("VolumeEnergy: weights must be positive and finite");
    sum += w;
  }
  for (std::size_t c = 0; c < weights.size(); ++c) weights_[c] = weights[c] / sum;
}

void VolumeEnergy::least_determinants(std::span<const Vec3> nodes, std::span<double> least) const {
  if (least.size() != mesh_->num_cells()) throw InputError("VolumeEnergy: expected one place per cell");
  std::fill(least.begin(), least.end(), kInfinity);
  sum_batches([&](const Group& group, std::size_t b) {
    const BatchState state(*this, group, b, nodes);
    alignas(64) double jacobian[9][kSimdLanes];
    for (std::size_t q = 0; q < group.rule.num_points(); ++q) {
      jacobians(group.rule.point(q), state.x, state.inverse_h, jacobian);
      if (reference_) multiply_lanes(jacobian, group.reference(b, q));
      for (int l = 0; l < group.active[b]; ++l) {
        Mat3 j;
        for (int k = 0; k < 9; ++k) j(k / 3, k % 3) = jacobian[k][l];
        double& lowest = least[group.batches[b][l]];
        lowest = std::min(lowest, j.determinant());
      }
    }
    return 0.0;
  });
}

double VolumeEnergy::linearize(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient) {
  if (hessian_.blocks.empty()) hessian_ = pattern();
  hessian_.set_zero();
  return add_hessian(nodes, scale, gradient, hessian_);
}

void VolumeEnergy::multiply(std::span<const Vec3> in, std::span<Vec3> out) const { hessian_.multiply(in, out); }

void VolumeEnergy::add_diagonal_blocks(const SparseMap& map, const SparseMap& map_transposed,
                                       std::span<Mat3> diagonal) const {
  internal::add_diagonal_blocks(map, map_transposed, hessian_, diagonal);
}

std::vector<Index> VolumeEnergy::uncertified(std::span<const Vec3> nodes) const {
  return epsilon_ > 0 ? std::vector<Index>() : not_certified(nodes);
}

std::vector<Index> VolumeEnergy::not_certified(std::span<const Vec3> nodes) const {
  return certify(nodes, *mesh_).not_certified;
}

double VolumeEnergy::max_step(std::span<const Vec3> nodes, std::span<const Vec3> direction, double limit) const {
  if (epsilon_ > 0) return limit;
  StepLimit steps(limit);
  sum_batches([&](const Group& group, std::size_t b) {
    alignas(64) double x[kMaxCellVertices][3][kSimdLanes], d[kMaxCellVertices][3][kSimdLanes], ones[3][kSimdLanes];
    double jx[9][kSimdLanes], jd[9][kSimdLanes];
    std::fill_n(&ones[0][0], 3 * kSimdLanes, 1.0);
    gather(group, b, nodes, x);
    gather(group, b, direction, d);
    for (std::size_t q = 0; q < group.rule.num_points(); ++q) {
      jacobians(group.rule.point(q), x, ones, jx);
      jacobians(group.rule.point(q), d, ones, jd);
      for (int l = 0; l < kSimdLanes; ++l) {
        Mat3 j, e;
        for (int k = 0; k < 9; ++k) {
          j(k / 3, k % 3) = jx[k][l];
          e(k / 3, k % 3) = jd[k][l];
        }
        steps.admit(j, e);
      }
    }
    return 0.0;
  });
  return steps.step();
}

}  // namespace subvol::internal
