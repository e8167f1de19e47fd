// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/energies/high_order_energy.h"

#include "subvol/base/error.h"
#include "subvol/base/parallel_errors.h"
#include "subvol/base/sort_unique.h"
#include "subvol/fit/certificate/high_order_certificate.h"
#include "subvol/fit/elements/element_rule.h"
#include "subvol/fit/energies/cell_sweep.h"
#include "subvol/fit/energies/jacobian_hinge.h"
#include "subvol/fit/energies/regularized_barrier.h"
#include "subvol/fit/energies/step_limit.h"

#include <omp.h>
#include <Eigen/LU>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

namespace subvol::internal {

namespace {

JacobianHinge hinge_of(const DistortionBatch& batch, double threshold) {
  Wide f[9];
  for (int e = 0; e < 9; ++e) f[e] = load_wide(batch.jacobian[e]);
  return {f, threshold};
}

constexpr auto kNothingMore = [](std::size_t, std::size_t, std::size_t, const DistortionBatch&) {};

}  // namespace

HighOrderEnergy::~HighOrderEnergy() = default;

HighOrderEnergy::HighOrderEnergy(const ElementSpace& space, std::span<const Vec3> ideal_lengths,
                                 std::span<const int> points_per_direction, QuadratureRule rule)
    : space_(&space),
      rule_(rule),
      num_cells_(static_cast<double>(space.num_cells())),
      points_(points_per_direction.begin(), points_per_direction.end()) {
  if (ideal_lengths.size() != space.num_cells())
    throw InputError("HighOrderEnergy: ideal_lengths must hold one entry per cell (" +
                     std::to_string(space.num_cells()) + "), got " + std::to_string(ideal_lengths.size()));
  for (std::size_t c = 0; c < space.num_cells(); ++c) {
    const Vec3& h = ideal_lengths[c];
    if (!(h.minCoeff() > 0) || !h.allFinite())
      throw InputError("HighOrderEnergy: ideal_lengths must be positive and finite");
    inverse_ideal_.push_back(ideal_inverse(space.kind(c)) * h.cwiseInverse().asDiagonal());
  }
  rebuild_groups();
}

HighOrderEnergy::HighOrderEnergy(const ElementSpace& space, CellReference reference,
                                 std::span<const int> points_per_direction, QuadratureRule rule)
    : space_(&space),
      rule_(rule),
      num_cells_(static_cast<double>(space.num_cells())),
      reference_(std::move(reference)),
      points_(points_per_direction.begin(), points_per_direction.end()) {
  rebuild_groups();
}

void HighOrderEnergy::rebuild_groups() {
  const ElementSpace& space = *space_;
  own_emphasis_.resize(space.num_cells(), 0.0);
  if (points_.size() != space.num_cells())
    throw InputError("HighOrderEnergy: points_per_direction must hold one entry per cell");
  std::map<std::array<int, 3>, std::vector<Index>> lists;
  for (std::size_t c = 0; c < space.num_cells(); ++c) {
    if (points_[c] < 2) throw InputError("HighOrderEnergy: points_per_direction must be at least 2");
    const int order = space.pattern_order(space.pattern(c));
    lists[{static_cast<int>(space.kind(c)), order, points_[c]}].push_back(static_cast<Index>(c));
  }
  groups_.clear();
  std::size_t local_size = 0;
  for (const auto& [key, cells] : lists) {
    CellGroup& group = groups_.emplace_back();
    group.kind = static_cast<CellKind>(key[0]);
    group.order = key[1];
    group.points_per_direction = key[2];
    if (group.kind != CellKind::hex) {
      for (Index c : cells) group.modes.insert(group.modes.end(), space.modes(c).begin(), space.modes(c).end());
      sort_unique(group.modes);
    }
    group.make_tables(space.basis(), rule_);
    group.local_begin = local_size;
    for (std::size_t i = 0; i < cells.size(); i += kSimdLanes) {
      auto& batch = group.batches.emplace_back();
      group.active.push_back(static_cast<int>(std::min<std::size_t>(kSimdLanes, cells.size() - i)));
      group.nodes.resize(group.nodes.size() + group.num_modes * kSimdLanes, kNoIndex);
      group.signs.resize(group.nodes.size(), 0);
      const std::size_t first = (group.batches.size() - 1) * group.num_modes * kSimdLanes;
      for (int l = 0; l < kSimdLanes; ++l) {
        const Index c = batch[l] = cells[std::min(i + l, cells.size() - 1)];
        const auto modes = space.modes(c);
        for (std::size_t a = 0; a < modes.size(); ++a) {
          const std::size_t place = first + group.mode_number(modes[a]) * kSimdLanes + l;
          group.nodes[place] = space.nodes(c)[a];
          group.signs[place] = space.signs(c)[a];
        }
      }
    }
    local_size += 3 * group.nodes.size();
    fill_references(group);
  }
  local_.assign(local_size, 0.0);
  find_incidences();
}

void HighOrderEnergy::fill_references(CellGroup& group) const {
  group.by_point = static_cast<bool>(reference_);
  const std::size_t per_batch = group.by_point ? group.num_points() : 1;
  group.to_reference.resize(9 * per_batch * group.batches.size());
  constexpr Index kNoBadCell = std::numeric_limits<Index>::max();
  Index bad_cell = kNoBadCell;
#pragma omp parallel for schedule(static) reduction(min : bad_cell)
  for (std::size_t b = 0; b < group.batches.size(); ++b)
    for (std::size_t q = 0; q < per_batch; ++q)
      for (int l = 0; l < kSimdLanes; ++l) {
        const Index cell = group.batches[b][l];
        Mat3 inverse;
        if (reference_) {
          const Mat3 reference = reference_(cell, group.points[q]);
          inverse = reference.inverse();
          if (!(reference.determinant() > 0) || !inverse.allFinite()) bad_cell = std::min(bad_cell, cell);
        } else {
          inverse = inverse_ideal_[cell];
        }
        for (int e = 0; e < 9; ++e) lanes(group.to_reference[9 * (b * per_batch + q) + e])[l] = inverse(e / 3, e % 3);
      }
  if (bad_cell != kNoBadCell)
    throw InputError("HighOrderEnergy: the reference of cell " + std::to_string(bad_cell) + " has no positive volume");
}

/// Signed places: the place of a contribution that counts negative is stored as its complement.
void HighOrderEnergy::find_incidences() {
  std::vector<std::size_t>& offsets = incidence_offsets_;
  offsets.assign(space_->num_nodes() + 1, 0);
  const auto for_each_part = [&](const auto& f) {
    for (const CellGroup& group : groups_)
      for (std::size_t b = 0; b < group.batches.size(); ++b)
        for (std::size_t a = 0; a < group.num_modes; ++a)
          for (int l = 0; l < group.active[b]; ++l) {
            const std::size_t at = (b * group.num_modes + a) * kSimdLanes + l;
            if (group.nodes[at] == kNoIndex) continue;
            const auto place = static_cast<std::int64_t>(group.local_begin + 3 * (at - l) + l);
            f(group.nodes[at], group.signs[at] > 0 ? place : ~place);
          }
  };
  for_each_part([&](Index node, std::int64_t) { ++offsets[node + 1]; });
  for (std::size_t i = 0; i + 1 < offsets.size(); ++i) offsets[i + 1] += offsets[i];
  incidences_.resize(offsets.back());
  std::vector<std::size_t> next(offsets.begin(), offsets.end() - 1);
  for_each_part([&](Index node, std::int64_t place) { incidences_[next[node]++] = place; });
}

void HighOrderEnergy::set_hinge(double weight, double threshold) {
  if (!(weight >= 0) || !std::isfinite(weight) || !(threshold <= 1))
    throw InputError("HighOrderEnergy: a hinge needs a finite weight >= 0 and a threshold of at most 1");
  hinge_weight_ = weight;
  hinge_threshold_ = threshold;
}

void HighOrderEnergy::set_distortion(Distortion distortion, double floor) {
  kernels_ = &kernels_of(distortion);
  floor_ = floor;
}

std::size_t HighOrderEnergy::num_points() const {
  std::size_t total = 0;
  for (const CellGroup& group : groups_)
    for (int active : group.active) total += active * group.num_points();
  return total;
}

/// Runs per_batch(group number, batch, sweep) over all batches and sums the returned values in batch order.
template <class PerBatch>
double HighOrderEnergy::sum_batches(PerBatch&& per_batch) const {
  double total = 0;
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    const CellGroup& group = groups_[g];
    std::vector<double> sums(group.batches.size());
    ParallelErrors errors;
#pragma omp parallel
    {
      std::optional<CellSweep> sweep;
      errors.guard([&] { sweep.emplace(group); });
#pragma omp for schedule(dynamic)
      for (std::size_t b = 0; b < group.batches.size(); ++b)
        if (sweep) sums[b] = per_batch(g, b, *sweep);
    }
    errors.rethrow();
    for (double s : sums) total += s;
  }
  return total;
}

/// Adds scale times the contributions in local_ to the nodes.
void HighOrderEnergy::gather_nodes(double scale, std::span<Vec3> out) const {
#pragma omp parallel for schedule(static)
  for (std::size_t node = 0; node < out.size(); ++node) {
    Vec3 sum = Vec3::Zero();
    for (std::size_t i = incidence_offsets_[node]; i < incidence_offsets_[node + 1]; ++i) {
      const std::int64_t signed_place = incidences_[i], place = signed_place < 0 ? ~signed_place : signed_place;
      const double sign = signed_place < 0 ? -1 : 1;
      for (int r = 0; r < 3; ++r) sum[r] += sign * local_[place + r * kSimdLanes];
    }
    out[node] += scale * sum;
  }
}

void HighOrderEnergy::keep(const CellGroup& group, std::size_t batch, const std::vector<Wide>& coefficients) const {
  std::copy_n(reinterpret_cast<const double*>(coefficients.data()), coefficients.size() * kSimdLanes,
              local_.data() + group.local_begin + 3 * batch * group.num_modes * kSimdLanes);
}

/// Returns the energy at the nodes, using kernel(batches, count) at all points. With kBack, the contributions of the
/// batches to their modes are left in local_. Calls per_point(group number, batch, q, point) after each point.
template <bool kBack, class Kernel, class PerPoint>
double HighOrderEnergy::integrate_with(std::span<const Vec3> nodes, const Kernel& kernel,
                                       const PerPoint& per_point) const {
  return cell_share() * sum_batches([&](std::size_t g, std::size_t b, CellSweep& sweep) {
           const CellGroup& group = groups_[g];
           const double hinge = hinge_weight_at(group);
           DistortionBatch batches[kDistortionPointsAtOnce];
           for (DistortionBatch& batch : batches) batch.floor = floor_;
           Wide sum{};
           const auto evaluate = [&](std::size_t first, int count, Wide(*j)[9]) {
             Wide f[9];
             for (int n = 0; n < count; ++n) {
               product(j[n], group.reference(b, first + n), f);
               for (int e = 0; e < 9; ++e) store_wide(f[e], batches[n].jacobian[e]);
             }
             kernel(batches, count);
             for (int n = 0; n < count; ++n) {
               const std::size_t q = first + n;
               const Wide weight = group.weight(b, q);
               sum += weight * load_wide(batches[n].energy);
               if constexpr (kBack)
                 for (int e = 0; e < 9; ++e) f[e] = weight * load_wide(batches[n].stress[e]);
               if (hinge > 0) {
                 const JacobianHinge at = hinge_of(batches[n], hinge_threshold_);
                 sum += hinge * at.below * at.below;
                 if constexpr (kBack)
                   for (int e = 0; e < 9; ++e) f[e] += 2 * hinge * at.below * at.slope[e];
               }
               if constexpr (kBack) {
                 product_with_transpose(f, group.reference(b, q), j[n]);
               }
               per_point(g, b, q, batches[n]);
             }
           };
           sweep.load(b, nodes);
           sweep.template run<kBack>([&](std::size_t first, int count, Wide(*j)[9]) {
             for (int n = 0; n < count; n += kDistortionPointsAtOnce)
               evaluate(first + n, std::min(kDistortionPointsAtOnce, count - n), j + n);
           });
           if constexpr (kBack) keep(group, b, sweep.coefficients());
           double total = 0;
           for (int l = 0; l < group.active[b]; ++l) total += sum[l];
           return total;
         });
}

/// Does so with the present distortion or the regularized barrier.
template <bool kBack, class PerPoint>
double HighOrderEnergy::integrate(std::span<const Vec3> nodes, int derivatives, const PerPoint& per_point) const {
  const auto regularized = [&](DistortionBatch* batches, int count) {
    derivatives < 2 ? regularized_gradient(batches, count, epsilon_) : regularized_hessian(batches, count, epsilon_);
  };
  const auto kernel = std::array{kernels_->energy, kernels_->gradient, kernels_->hessian}[derivatives];
  return epsilon_ > 0 ? integrate_with<kBack>(nodes, regularized, per_point)
                      : integrate_with<kBack>(nodes, kernel, per_point);
}

double HighOrderEnergy::value(std::span<const Vec3> nodes) const { return integrate<false>(nodes, 0, kNothingMore); }

double HighOrderEnergy::add_gradient(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient) const {
  const double energy = integrate<true>(nodes, 1, kNothingMore);
  if (std::isfinite(energy)) gather_nodes(scale * cell_share(), gradient);
  return energy;
}

/// Returns the weight of a point's hinge in the sum over its cell.
double HighOrderEnergy::hinge_weight_at(const CellGroup& group) const {
  return hinge_weight_ / static_cast<double>(group.num_points());
}

/// Keeps the square root of the hinge's Gauss-Newton Hessian at a point, in canonical coordinates. weight: of the
/// squared residual.
void HighOrderEnergy::freeze_hinge(CellGroup& group, std::size_t batch, std::size_t q, const DistortionBatch& at,
                                   double weight) const {
  const JacobianHinge hinge = hinge_of(at, hinge_threshold_);
  Wide slope[9];
  product_with_transpose(hinge.slope, group.reference(batch, q), slope);
  for (Wide& entry : slope) entry *= std::sqrt(2 * weight);
  keep_frozen(slope, 9, &group.frozen_hinges[9 * (batch * group.num_points() + q)]);
  Wide* blocks = &group.mean_blocks[54 * batch];
  for (int pair = 0; pair < 6; ++pair) {
    const auto [c, d] = kDirectionPairs[pair];
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) {
        blocks[9 * pair + 3 * i + k] += slope[3 * i + c] * slope[3 * k + d];
        if (c != d) blocks[9 * pair + 3 * i + k] += slope[3 * i + d] * slope[3 * k + c];
      }
  }
}

template <bool kCoupled>
double HighOrderEnergy::linearize_as(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient) {
  constexpr int kSize = frozen_size(kCoupled);
  for (CellGroup& group : groups_) {
    group.frozen.resize(kSize * group.num_points() * group.batches.size());
    group.mean_blocks.assign(54 * group.batches.size(), Wide{});
    group.frozen_hinges.resize(hinge_weight_ > 0 ? 9 * group.num_points() * group.batches.size() : 0);
  }
  const auto keep_point = [&](std::size_t g, std::size_t b, std::size_t q, const DistortionBatch& batch) {
    CellGroup& group = groups_[g];
    Wide frozen[kSize];
    const Wide weight = scale * cell_share() * group.weight(b, q);
    freeze<kCoupled>(batch, group.reference(b, q), weight, frozen);
    add_blocks<kCoupled>(frozen, &group.mean_blocks[54 * b]);
    keep_frozen(frozen, kSize, &group.frozen[kSize * (b * group.num_points() + q)]);
    if (hinge_weight_ > 0) freeze_hinge(group, b, q, batch, scale * cell_share() * hinge_weight_at(group));
  };
  const double energy = integrate<true>(nodes, 2, keep_point);
  gather_nodes(scale * cell_share(), gradient);
  return energy;
}

double HighOrderEnergy::linearize(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient) {
  return is_coupled() ? linearize_as<true>(nodes, scale, gradient) : linearize_as<false>(nodes, scale, gradient);
}

template <bool kCoupled>
void HighOrderEnergy::multiply_as(std::span<const Vec3> in) const {
  constexpr int kSize = frozen_size(kCoupled);
  sum_batches([&](std::size_t g, std::size_t b, CellSweep& sweep) {
    const CellGroup& group = groups_[g];
    const Narrow* frozen = &group.frozen[kSize * b * group.num_points()];
    const Narrow* hinges = group.frozen_hinges.empty() ? nullptr : &group.frozen_hinges[9 * b * group.num_points()];
    sweep.load(b, in);
    sweep.run<true>([&](std::size_t first, int count, Wide(*j)[9]) {
      for (int n = 0; n < count; ++n) {
        if (!hinges) {
          apply_frozen<kCoupled>(frozen + kSize * (first + n), j[n]);
          continue;
        }
        const Narrow* slope = hinges + 9 * (first + n);
        Wide along{};
        for (int e = 0; e < 9; ++e) along += widen(slope[e]) * j[n][e];
        apply_frozen<kCoupled>(frozen + kSize * (first + n), j[n]);
        for (int e = 0; e < 9; ++e) j[n][e] += along * widen(slope[e]);
      }
    });
    keep(group, b, sweep.coefficients());
    return 0.0;
  });
}

void HighOrderEnergy::multiply(std::span<const Vec3> in, std::span<Vec3> out) const {
  is_coupled() ? multiply_as<true>(in) : multiply_as<false>(in);
  std::fill(out.begin(), out.end(), Vec3::Zero());
  gather_nodes(1, out);
}

void HighOrderEnergy::add_diagonal_blocks(const SparseMap& map, const SparseMap&, std::span<Mat3> diagonal) const {
  std::vector<Mat3> own(space_->num_nodes(), Mat3::Zero());
  for (const CellGroup& group : groups_)
    for (std::size_t b = 0; b < group.batches.size(); ++b)
      for (std::size_t a = 0; a < group.num_modes; ++a)
        for (int l = 0; l < group.active[b]; ++l) {
          const Index node = group.nodes[(b * group.num_modes + a) * kSimdLanes + l];
          if (node == kNoIndex) continue;
          for (int pair = 0; pair < 6; ++pair)
            for (int e = 0; e < 9; ++e)
              own[node](e / 3, e % 3) += group.products[a][pair] * group.mean_blocks[54 * b + 9 * pair + e][l];
        }
  for (std::size_t i = 0; i < map.num_rows(); ++i)
    for (std::size_t k = 0; k < map.row_size(i); ++k) {
      const double w = map.row_values(i)[k];
      diagonal[map.row_columns(i)[k]] += w * w * own[i];
    }
}

/// Calls per_point(group number, batch, q, lane, J, D) at every point, where J and D are the Jacobians of `nodes` and
/// `direction`. Batches run in parallel.
template <class PerPoint>
void HighOrderEnergy::for_each_pair(std::span<const Vec3> nodes, std::span<const Vec3> direction,
                                    const PerPoint& per_point) const {
  std::size_t most_points = 0;
  for (const CellGroup& group : groups_) most_points = std::max(most_points, group.num_points());
  std::vector<std::vector<Wide>> jacobians(omp_get_max_threads(), std::vector<Wide>(9 * most_points));
  sum_batches([&](std::size_t g, std::size_t b, CellSweep& sweep) {
    const CellGroup& group = groups_[g];
    std::vector<Wide>& kept = jacobians[omp_get_thread_num()];
    sweep.load(b, nodes);
    sweep.run<false>(
        [&](std::size_t first, int count, const Wide(*j)[9]) { std::copy_n(j[0], 9 * count, &kept[9 * first]); });
    sweep.load(b, direction);
    sweep.run<false>([&](std::size_t first, int count, const Wide(*d)[9]) {
      for (int n = 0; n < count; ++n)
        for (int l = 0; l < group.active[b]; ++l) {
          Mat3 j, e;
          for (int k = 0; k < 9; ++k) {
            j(k / 3, k % 3) = kept[9 * (first + n) + k][l];
            e(k / 3, k % 3) = d[n][k][l];
          }
          per_point(g, b, first + n, l, j, e);
        }
    });
    return 0.0;
  });
}

double HighOrderEnergy::max_step(std::span<const Vec3> nodes, std::span<const Vec3> direction, double limit) const {
  if (epsilon_ > 0) return limit;
  StepLimit steps(limit);
  for_each_pair(nodes, direction,
                [&](std::size_t, std::size_t, std::size_t, int, const Mat3& j, const Mat3& d) { steps.admit(j, d); });
  return steps.step();
}

/// Makes a point of one lane stiffer: both its frozen numbers and their part of `mean_blocks`.
void HighOrderEnergy::stiffen_point(CellGroup& group, std::size_t batch, std::size_t q, int lane) {
  const int size = frozen_size(kernels_->coupled);
  Wide more[kMostFrozen];
  scale_frozen(&group.frozen[size * (batch * group.num_points() + q)], size, lane, tuning_.stiffening_factor, more);
  Wide* blocks = &group.mean_blocks[54 * batch];
  kernels_->coupled ? add_blocks<true>(more, blocks) : add_blocks<false>(more, blocks);
}

bool HighOrderEnergy::stiffen(std::span<const Vec3> nodes, std::span<const Vec3> direction, double t) {
  if (epsilon_ > 0) return false;
  std::atomic<bool> changed{false};
  for_each_pair(nodes, direction,
                [&](std::size_t g, std::size_t b, std::size_t q, int l, const Mat3& j, const Mat3& d) {
                  if (StepLimit::safe(j, d, t)) return;
                  stiffen_point(groups_[g], b, q, l);
                  changed = true;
                });
  return changed;
}

bool HighOrderEnergy::stiffen(std::span<const Index> cells) {
  for (CellGroup& group : groups_)
    for (std::size_t b = 0; b < group.batches.size(); ++b)
      for (int l = 0; l < group.active[b]; ++l)
        if (std::binary_search(cells.begin(), cells.end(), group.batches[b][l]))
          for (std::size_t q = 0; q < group.num_points(); ++q) stiffen_point(group, b, q, l);
  return !cells.empty();
}

std::vector<Index> HighOrderEnergy::uncertified(std::span<const Vec3> nodes) const {
  return epsilon_ > 0 ? std::vector<Index>() : not_certified(nodes);
}

std::vector<Index> HighOrderEnergy::not_certified(std::span<const Vec3> nodes) const {
  return certify(*space_, nodes).not_certified;
}

void HighOrderEnergy::set_regularization(double epsilon) {
  if (!(epsilon >= 0) || !std::isfinite(epsilon))
    throw InputError("HighOrderEnergy: epsilon must be 0 or positive and finite");
  epsilon_ = epsilon;
}

bool HighOrderEnergy::has_emphasis() const {
  return emphasis_ > 0 || std::ranges::any_of(own_emphasis_, [](double k) { return k > 0; });
}

void HighOrderEnergy::set_weights(std::span<const double> weights) {
  if (weights.size() != space_->num_cells())
    throw InputError("HighOrderEnergy: expected one weight per cell (" + std::to_string(space_->num_cells()) +
                     "), got " + std::to_string(weights.size()));
  if (!std::ranges::all_of(weights, [](double w) { return w > 0 && std::isfinite(w); }))
    throw InputError("HighOrderEnergy: weights must be positive and finite");
  if (has_emphasis()) throw InputError("HighOrderEnergy: an emphasis does not go with weights of cells");
  cell_weights_.assign(weights.begin(), weights.end());
  weigh_points({});
}

void HighOrderEnergy::least_determinants(std::span<const Vec3> nodes, std::span<double> least) const {
  if (least.size() != space_->num_cells()) throw InputError("HighOrderEnergy: expected one place per cell");
  std::ranges::fill(least, std::numeric_limits<double>::infinity());
  integrate<false>(nodes, 0, [&](std::size_t g, std::size_t b, std::size_t, const DistortionBatch& batch) {
    for (int l = 0; l < kSimdLanes; ++l) {
      Mat3 j;
      for (int e = 0; e < 9; ++e) j(e / 3, e % 3) = batch.jacobian[e][l];
      double& lowest = least[groups_[g].batches[b][l]];
      lowest = std::min(lowest, j.determinant());
    }
  });
}

void HighOrderEnergy::emphasize_poor(std::span<const Vec3> nodes, double emphasis) {
  if (!(emphasis >= 0 && emphasis <= kMostHighOrderEmphasis))
    throw InputError("HighOrderEnergy: emphasis is out of range");
  emphasis_ = emphasis;
  weigh_points(nodes);
}

/// Weighs the points by the weights of their cells and, with an emphasis, by the shape of the cells at these nodes; the
/// mean of all weights is 1.
void HighOrderEnergy::weigh_points(std::span<const Vec3> nodes) {
  for (CellGroup& group : groups_) group.point_weights.clear();
  if (!has_emphasis() && cell_weights_.empty()) return;
  std::vector<std::vector<Wide>> weights;
  for (const CellGroup& group : groups_) {
    auto& of_group = weights.emplace_back(group.num_points() * group.batches.size(), Wide{} + 1.0);
    for (std::size_t i = 0; i < of_group.size() && !cell_weights_.empty(); ++i)
      for (int l = 0; l < kSimdLanes; ++l) of_group[i][l] = cell_weights_[group.batches[i / group.num_points()][l]];
  }
  const auto weigh = [&](std::size_t g, std::size_t b, std::size_t q, const DistortionBatch& batch) {
    Wide& weight = weights[g][b * groups_[g].num_points() + q];
    for (int l = 0; l < kSimdLanes; ++l) {
      Mat3 f;
      for (int e = 0; e < 9; ++e) f(e / 3, e % 3) = batch.jacobian[e][l];
      const double shape = f.determinant() / (f.col(0).norm() * f.col(1).norm() * f.col(2).norm());
      const double lack = shape > 0 ? std::max(0.0, 1 - shape / tuning_.fair_shape) : 1;  // 1 also for NaN
      weight[l] *= 1 + std::max(emphasis_, own_emphasis_[groups_[g].batches[b][l]]) * lack * lack;
    }
  };
  if (has_emphasis()) integrate<false>(nodes, 0, weigh);
  double sum = 0;
  for (std::size_t g = 0; g < groups_.size(); ++g)
    for (std::size_t i = 0; i < weights[g].size(); ++i)
      for (int l = 0; l < groups_[g].active[i / groups_[g].num_points()]; ++l)
        sum += groups_[g].weights[i % groups_[g].num_points()] * weights[g][i][l];
  const double inverse_mean = static_cast<double>(space_->num_cells()) / sum;
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    for (Wide& weight : weights[g]) weight *= inverse_mean;
    groups_[g].point_weights = std::move(weights[g]);
  }
}

void HighOrderEnergy::densify(std::span<const Index> cells, std::span<const Vec3> nodes) {
  for (Index c : cells) {
    if (c < 0 || static_cast<std::size_t>(c) >= points_.size())
      throw InputError("HighOrderEnergy: there is no cell " + std::to_string(c));
    points_[c] = std::min(std::max(points_[c], tuning_.most_points_per_direction), 2 * points_[c] - 1);
    own_emphasis_[c] = std::min(most_own_emphasis_, std::max(tuning_.first_emphasis, 2 * own_emphasis_[c]));
  }
  rebuild_groups();
  weigh_points(nodes);
}

}  // namespace subvol::internal
