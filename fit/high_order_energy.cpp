// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/high_order_energy.h"

#include "fit/element_rule.h"
#include "fit/high_order_certificate.h"
#include "fit/step_limit.h"
#include "fit/wide.h"
#include "subvol/error.h"

#include <Eigen/LU>
#include <omp.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>

namespace subvol {

namespace {

static_assert(kWide == kLanes);

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Numbers that a point keeps of its second derivative: U, R V, stretch, pair_same, pair_cross (`hencky.h`).
constexpr int kFrozen = 27;
/// Symmetric 3x3 blocks of a second derivative by pairs (0,0) (1,1) (2,2) (0,1) (1,2) (2,0) of directions.
constexpr int kPairs[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}};

Wide load(const double* lanes) {
  Wide w;
  std::copy_n(lanes, kLanes, reinterpret_cast<double*>(&w));
  return w;
}
void store(const Wide& w, double* lanes) { std::copy_n(reinterpret_cast<const double*>(&w), kLanes, lanes); }
double* lanes(Wide& w) { return reinterpret_cast<double*>(&w); }

/// c = a b, or a b^T, of 3x3 matrices by rows.
inline void product(const Wide* a, const Wide* b, Wide* c) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) c[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
}
inline void product_with_transpose(const Wide* a, const Wide* b, Wide* c) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      c[3 * i + j] = a[3 * i] * b[3 * j] + a[3 * i + 1] * b[3 * j + 1] + a[3 * i + 2] * b[3 * j + 2];
}
inline void transpose_product(const Wide* a, const Wide* b, Wide* c) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) c[3 * i + j] = a[i] * b[j] + a[3 + i] * b[3 + j] + a[6 + i] * b[6 + j];
}

/// A change G of the Jacobian, by canonical coordinates, becomes the change U P (R V)^T of the stress:
///   W = U^T G R V,  P_ii = stretch_i W_ii,  P_ij = same_ij W_ij + cross_ij W_ji.
inline void apply_frozen(const Wide* frozen, Wide* g) {
  const Wide *u = frozen, *rv = frozen + 9, *stretch = frozen + 18, *same = frozen + 21, *cross = frozen + 24;
  Wide t[9], w[9], p[9];
  product(g, rv, t);
  transpose_product(u, t, w);
  for (int i = 0; i < 3; ++i) {
    const int j = i == 2 ? 0 : i + 1;
    p[4 * i] = stretch[i] * w[4 * i];
    p[3 * i + j] = same[i] * w[3 * i + j] + cross[i] * w[3 * j + i];
    p[3 * j + i] = same[i] * w[3 * j + i] + cross[i] * w[3 * i + j];
  }
  product(u, p, t);
  product_with_transpose(t, rv, g);
}

/// Adds, for every pair (c, d) of canonical directions, the symmetric part of the block that couples gradients e_c, e_d.
inline void add_blocks(const Wide* frozen, Wide* blocks) {
  const Wide *u = frozen, *rv = frozen + 9, *stretch = frozen + 18, *same = frozen + 21, *cross = frozen + 24;
  for (int pair = 0; pair < 6; ++pair) {
    const Wide *a = rv + 3 * kPairs[pair][0], *b = rv + 3 * kPairs[pair][1];
    Wide z[9], t[9], k[9];
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, l = (i + 2) % 3;
      z[4 * i] = stretch[i] * a[i] * b[i] + same[i] * a[j] * b[j] + same[l] * a[l] * b[l];
      z[3 * i + j] = cross[i] * a[j] * b[i];
      z[3 * j + i] = cross[i] * a[i] * b[j];
    }
    product(u, z, t);
    product_with_transpose(t, u, k);
    const double both = pair < 3 ? 0.5 : 1;  // (c, d) and (d, c)
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) blocks[9 * pair + 3 * i + j] += both * (k[3 * i + j] + k[3 * j + i]);
  }
}

}  // namespace

struct HighOrderEnergy::Group {
  CellKind kind;
  int order, points_per_direction;
  std::vector<Vec3> points;
  std::vector<double> weights;
  std::size_t num_modes = 0;
  std::vector<double> values, derivatives;  ///< hex: of the order + 1 line functions at every point of a line
  std::vector<LocalMode> modes;             ///< prism, tet: of any of the cells, ascending
  std::vector<Vec3> gradients;              ///< prism, tet: of every mode at every point
  std::vector<std::array<double, 6>> products;  ///< of every mode: mean of d_c N d_d N over the points, by kPairs

  std::vector<std::array<Index, kLanes>> batches;  ///< the last one is padded with repeats
  std::vector<int> active;                         ///< real cells of each batch
  std::vector<Index> nodes;                        ///< by batch, mode, lane; kNoIndex: the cell has no such mode
  std::vector<std::int8_t> signs;
  std::size_t local_begin = 0;                     ///< of the first batch in local_
  std::vector<Wide> to_reference;                  ///< A^-1: 9 per batch, or per point of each where cells have references
  std::vector<Wide> cell_weights;                  ///< of each batch
  bool by_point = false;
  std::vector<Wide> frozen;                        ///< kFrozen per point of every batch
  std::vector<Wide> mean_blocks;                   ///< 54 per batch: `add_blocks` over all points

  std::size_t num_points() const { return weights.size(); }
  const Wide* reference(std::size_t batch, std::size_t q) const {
    return to_reference.data() + 9 * (by_point ? batch * num_points() + q : batch);
  }
  std::size_t mode_number(const LocalMode& mode) const {
    if (kind == CellKind::hex) return (mode.k * (order + 1) + mode.j) * (order + 1) + mode.i;
    return std::lower_bound(modes.begin(), modes.end(), mode) - modes.begin();
  }
  void make_tables(Basis basis, QuadratureRule rule);
};

/// Rules, and the functions' values and gradients there.
void HighOrderEnergy::Group::make_tables(Basis basis, QuadratureRule rule) {
  const int n = points_per_direction, m = order + 1;
  Quadrature quadrature = make_quadrature(kind, rule, n);
  points = std::move(quadrature.points);
  weights = std::move(quadrature.weights);
  if (kind != CellKind::hex) {
    num_modes = modes.size();
    ShapeFunctions functions(kind, basis, order);
    products.assign(num_modes, {});
    for (std::size_t q = 0; q < num_points(); ++q) {
      functions.set_point(points[q]);
      for (std::size_t a = 0; a < num_modes; ++a) {
        Vec3 gradient;
        functions.value(modes[a], gradient);
        gradients.push_back(gradient);
        for (int p = 0; p < 6; ++p) products[a][p] += weights[q] * gradient[kPairs[p][0]] * gradient[kPairs[p][1]];
      }
    }
    return;
  }
  num_modes = static_cast<std::size_t>(m) * m * m;
  values.resize(n * m);
  derivatives.resize(n * m);
  std::vector<double> vv(m, 0.0), vd(m, 0.0), dd(m, 0.0);
  const LineRule line = rule == QuadratureRule::trapezoidal ? trapezoidal_rule(n) : gauss_lobatto_rule(n);
  for (int q = 0; q < n; ++q) {
    line_functions(basis, order, line.points[q], &values[q * m], &derivatives[q * m]);
    const double w = line.weights[q];
    for (int i = 0; i < m; ++i) {
      vv[i] += w * values[q * m + i] * values[q * m + i];
      vd[i] += w * values[q * m + i] * derivatives[q * m + i];
      dd[i] += w * derivatives[q * m + i] * derivatives[q * m + i];
    }
  }
  for (int k = 0; k < m; ++k)
    for (int j = 0; j < m; ++j)
      for (int i = 0; i < m; ++i)
        products.push_back({dd[i] * vv[j] * vv[k], vv[i] * dd[j] * vv[k], vv[i] * vv[j] * dd[k], vd[i] * vd[j] * vv[k],
                            vv[i] * vd[j] * vd[k], vd[i] * vv[j] * vd[k]});
}

/// Takes the coefficients of one batch to the Jacobians at its points, and back: the work space of one thread.
class HighOrderEnergy::Sweep {
 public:
  explicit Sweep(const Group& group)
      : group_(group), m_(group.order + 1), n_(group.points_per_direction), coefficients_(3 * group.num_modes) {
    if (group.kind != CellKind::hex) return;
    lines_.resize(static_cast<std::size_t>(m_) * m_ * n_ * 6);
    planes_.resize(static_cast<std::size_t>(m_) * n_ * n_ * 9);
    plane_sums_.resize(planes_.size());
  }

  void load(std::size_t batch, std::span<const Vec3> nodes) {
    const std::size_t first = batch * group_.num_modes * kLanes;
    for (std::size_t a = 0; a < group_.num_modes; ++a)
      for (int l = 0; l < kLanes; ++l) {
        const Index node = group_.nodes[first + a * kLanes + l];
        const double sign = group_.signs[first + a * kLanes + l];
        for (int r = 0; r < 3; ++r) lanes(coefficients_[3 * a + r])[l] = node == kNoIndex ? 0.0 : sign * nodes[node][r];
      }
  }

  /// Calls op(q, J) at every point q with the 9 entries of J = dx/du. With kBack, op leaves there what is summed into
  /// the coefficients: out_a = sum_q J_q grad N_a(q).
  template <bool kBack, class Op>
  void run(Op&& op) {
    if (group_.kind == CellKind::hex)
      run_tensor<kBack>(op);
    else
      run_dense<kBack>(op);
  }

  const std::vector<Wide>& coefficients() const { return coefficients_; }

 private:
  template <bool kBack, class Op>
  void run_dense(Op&& op) {
    const std::size_t num_modes = group_.num_modes;
    std::vector<Wide>& sums = plane_sums_;
    if constexpr (kBack) sums.assign(coefficients_.size(), Wide{});
    for (std::size_t q = 0; q < group_.num_points(); ++q) {
      const Vec3* gradients = group_.gradients.data() + q * num_modes;
      Wide j[9] = {};
      for (std::size_t a = 0; a < num_modes; ++a)
        for (int r = 0; r < 3; ++r)
          for (int c = 0; c < 3; ++c) j[3 * r + c] += gradients[a][c] * coefficients_[3 * a + r];
      op(q, j);
      if constexpr (kBack)
        for (std::size_t a = 0; a < num_modes; ++a)
          for (int r = 0; r < 3; ++r)
            sums[3 * a + r] += gradients[a][0] * j[3 * r] + gradients[a][1] * j[3 * r + 1] + gradients[a][2] * j[3 * r + 2];
    }
    if constexpr (kBack) coefficients_.swap(sums);
  }

  /// One direction at a time: coefficients (k, j, i) -> lines (k, j, q1) -> planes (k, q2, q1) -> points.
  template <bool kBack, class Op>
  void run_tensor(Op&& op) {
    to_lines();
    to_planes();
    if constexpr (kBack) std::fill(plane_sums_.begin(), plane_sums_.end(), Wide{});
    const std::size_t plane = static_cast<std::size_t>(n_) * n_;
    for (int q3 = 0; q3 < n_; ++q3) {
      const double *v = &group_.values[q3 * m_], *d = &group_.derivatives[q3 * m_];
      for (std::size_t q = 0; q < plane; ++q) {
        Wide j[9] = {};
        for (int k = 0; k < m_; ++k) {
          const Wide* b = &planes_[9 * (k * plane + q)];
          for (int r = 0; r < 3; ++r) {
            j[3 * r] += v[k] * b[r];
            j[3 * r + 1] += v[k] * b[3 + r];
            j[3 * r + 2] += d[k] * b[6 + r];
          }
        }
        op(q3 * plane + q, j);
        if constexpr (kBack)
          for (int k = 0; k < m_; ++k) {
            Wide* b = &plane_sums_[9 * (k * plane + q)];
            for (int r = 0; r < 3; ++r) {
              b[r] += v[k] * j[3 * r];
              b[3 + r] += v[k] * j[3 * r + 1];
              b[6 + r] += d[k] * j[3 * r + 2];
            }
          }
      }
    }
    if constexpr (kBack) {
      from_planes();
      from_lines();
    }
  }

  /// lines: values along u, then derivatives.
  void to_lines() {
    for (int kj = 0; kj < m_ * m_; ++kj)
      for (int q = 0; q < n_; ++q) {
        Wide sum[6] = {};
        for (int i = 0; i < m_; ++i) {
          const Wide* c = &coefficients_[3 * (kj * m_ + i)];
          const double v = group_.values[q * m_ + i], d = group_.derivatives[q * m_ + i];
          for (int r = 0; r < 3; ++r) {
            sum[r] += v * c[r];
            sum[3 + r] += d * c[r];
          }
        }
        std::copy_n(sum, 6, &lines_[6 * (static_cast<std::size_t>(kj) * n_ + q)]);
      }
  }

  /// planes: derivatives along u, along v, values.
  void to_planes() {
    for (int k = 0; k < m_; ++k)
      for (int q2 = 0; q2 < n_; ++q2)
        for (int q1 = 0; q1 < n_; ++q1) {
          Wide sum[9] = {};
          for (int j = 0; j < m_; ++j) {
            const Wide* a = &lines_[6 * (static_cast<std::size_t>(k * m_ + j) * n_ + q1)];
            const double v = group_.values[q2 * m_ + j], d = group_.derivatives[q2 * m_ + j];
            for (int r = 0; r < 3; ++r) {
              sum[r] += v * a[3 + r];
              sum[3 + r] += d * a[r];
              sum[6 + r] += v * a[r];
            }
          }
          std::copy_n(sum, 9, &planes_[9 * ((static_cast<std::size_t>(k) * n_ + q2) * n_ + q1)]);
        }
  }

  void from_planes() {
    for (int k = 0; k < m_; ++k)
      for (int j = 0; j < m_; ++j)
        for (int q1 = 0; q1 < n_; ++q1) {
          Wide sum[6] = {};
          for (int q2 = 0; q2 < n_; ++q2) {
            const Wide* b = &plane_sums_[9 * ((static_cast<std::size_t>(k) * n_ + q2) * n_ + q1)];
            const double v = group_.values[q2 * m_ + j], d = group_.derivatives[q2 * m_ + j];
            for (int r = 0; r < 3; ++r) {
              sum[r] += d * b[3 + r] + v * b[6 + r];
              sum[3 + r] += v * b[r];
            }
          }
          std::copy_n(sum, 6, &lines_[6 * (static_cast<std::size_t>(k * m_ + j) * n_ + q1)]);
        }
  }

  void from_lines() {
    for (int kj = 0; kj < m_ * m_; ++kj)
      for (int i = 0; i < m_; ++i) {
        Wide sum[3] = {};
        for (int q = 0; q < n_; ++q) {
          const Wide* a = &lines_[6 * (static_cast<std::size_t>(kj) * n_ + q)];
          const double v = group_.values[q * m_ + i], d = group_.derivatives[q * m_ + i];
          for (int r = 0; r < 3; ++r) sum[r] += v * a[r] + d * a[3 + r];
        }
        std::copy_n(sum, 3, &coefficients_[3 * (kj * m_ + i)]);
      }
  }

  const Group& group_;
  int m_, n_;
  std::vector<Wide> coefficients_, lines_, planes_, plane_sums_;
};

HighOrderEnergy::~HighOrderEnergy() = default;

HighOrderEnergy::HighOrderEnergy(const ElementSpace& space, std::span<const Vec3> ideal_lengths,
                                 std::span<const int> points_per_direction, QuadratureRule rule)
    : space_(&space), rule_(rule), points_(points_per_direction.begin(), points_per_direction.end()) {
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
      reference_(std::move(reference)),
      points_(points_per_direction.begin(), points_per_direction.end()) {
  rebuild_groups();
}

void HighOrderEnergy::rebuild_groups() {
  const ElementSpace& space = *space_;
  cell_weights_.resize(space.num_cells(), 1.0);
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
    Group& group = groups_.emplace_back();
    group.kind = static_cast<CellKind>(key[0]);
    group.order = key[1];
    group.points_per_direction = key[2];
    if (group.kind != CellKind::hex) {
      for (Index c : cells) group.modes.insert(group.modes.end(), space.modes(c).begin(), space.modes(c).end());
      std::sort(group.modes.begin(), group.modes.end());
      group.modes.erase(std::unique(group.modes.begin(), group.modes.end()), group.modes.end());
    }
    group.make_tables(space.basis(), rule_);
    group.local_begin = local_size;
    for (std::size_t i = 0; i < cells.size(); i += kLanes) {
      auto& batch = group.batches.emplace_back();
      group.active.push_back(static_cast<int>(std::min<std::size_t>(kLanes, cells.size() - i)));
      group.nodes.resize(group.nodes.size() + group.num_modes * kLanes, kNoIndex);
      group.signs.resize(group.nodes.size(), 0);
      const std::size_t first = (group.batches.size() - 1) * group.num_modes * kLanes;
      Wide& weights = group.cell_weights.emplace_back();
      for (int l = 0; l < kLanes; ++l) {
        const Index c = batch[l] = cells[std::min(i + l, cells.size() - 1)];
        weights[l] = cell_weights_[c];
        const auto modes = space.modes(c);
        for (std::size_t a = 0; a < modes.size(); ++a) {
          const std::size_t place = first + group.mode_number(modes[a]) * kLanes + l;
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

void HighOrderEnergy::fill_references(Group& group) const {
  group.by_point = static_cast<bool>(reference_);
  const std::size_t per_batch = group.by_point ? group.num_points() : 1;
  group.to_reference.resize(9 * per_batch * group.batches.size());
  std::atomic<Index> bad_cell{kNoIndex};
#pragma omp parallel for schedule(static)
  for (std::size_t b = 0; b < group.batches.size(); ++b)
    for (std::size_t q = 0; q < per_batch; ++q)
      for (int l = 0; l < kLanes; ++l) {
        const Index cell = group.batches[b][l];
        Mat3 inverse;
        if (reference_) {
          const Mat3 reference = reference_(cell, group.points[q]);
          inverse = reference.inverse();
          if (!(reference.determinant() > 0) || !inverse.allFinite()) bad_cell = cell;
        } else {
          inverse = inverse_ideal_[cell];
        }
        for (int e = 0; e < 9; ++e) lanes(group.to_reference[9 * (b * per_batch + q) + e])[l] = inverse(e / 3, e % 3);
      }
  if (bad_cell != kNoIndex)
    throw InputError("HighOrderEnergy: the reference of cell " + std::to_string(bad_cell) + " has no positive volume");
}

/// Signed places: that of a part which counts negative is stored as its complement.
void HighOrderEnergy::find_incidences() {
  std::vector<std::size_t>& offsets = incidence_offsets_;
  offsets.assign(space_->num_nodes() + 1, 0);
  const auto for_each_part = [&](const auto& f) {
    for (const Group& group : groups_)
      for (std::size_t b = 0; b < group.batches.size(); ++b)
        for (std::size_t a = 0; a < group.num_modes; ++a)
          for (int l = 0; l < group.active[b]; ++l) {
            const std::size_t at = (b * group.num_modes + a) * kLanes + l;
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

std::size_t HighOrderEnergy::num_points() const {
  std::size_t total = 0;
  for (const Group& group : groups_)
    for (int active : group.active) total += active * group.num_points();
  return total;
}

/// Runs per_batch(group number, batch, sweep) over all batches and sums what it returns in batch order.
template <class PerBatch>
double HighOrderEnergy::sum_batches(PerBatch&& per_batch) const {
  double total = 0;
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    const Group& group = groups_[g];
    std::vector<double> sums(group.batches.size());
#pragma omp parallel
    {
      Sweep sweep(group);
#pragma omp for schedule(dynamic)
      for (std::size_t b = 0; b < group.batches.size(); ++b) sums[b] = per_batch(g, b, sweep);
    }
    for (double s : sums) total += s;
  }
  return total;
}

/// Adds scale times what the batches left in local_ to the nodes.
void HighOrderEnergy::gather_nodes(double scale, std::span<Vec3> out) const {
#pragma omp parallel for schedule(static)
  for (std::size_t node = 0; node < out.size(); ++node) {
    Vec3 sum = Vec3::Zero();
    for (std::size_t i = incidence_offsets_[node]; i < incidence_offsets_[node + 1]; ++i) {
      const std::int64_t signed_place = incidences_[i], place = signed_place < 0 ? ~signed_place : signed_place;
      const double sign = signed_place < 0 ? -1 : 1;
      for (int r = 0; r < 3; ++r) sum[r] += sign * local_[place + r * kLanes];
    }
    out[node] += scale * sum;
  }
}

void HighOrderEnergy::keep(const Group& group, std::size_t batch, const std::vector<Wide>& coefficients) const {
  std::copy_n(reinterpret_cast<const double*>(coefficients.data()), coefficients.size() * kLanes,
              local_.data() + group.local_begin + 3 * batch * group.num_modes * kLanes);
}

double HighOrderEnergy::value(std::span<const Vec3> nodes) const {
  const double weight = 1.0 / static_cast<double>(space_->num_cells());
  return weight * sum_batches([&](std::size_t g, std::size_t b, Sweep& sweep) {
    const Group& group = groups_[g];
    HenckyBatch hencky;
    Wide sum{};
    sweep.load(b, nodes);
    sweep.template run<false>([&](std::size_t q, const Wide* j) {
      Wide f[9];
      product(j, group.reference(b, q), f);
      for (int e = 0; e < 9; ++e) store(f[e], hencky.jacobian[e]);
      hencky_energy(hencky);
      sum += group.weights[q] * load(hencky.energy);
    });
    double total = 0;
    for (int l = 0; l < group.active[b]; ++l) total += group.cell_weights[b][l] * sum[l];
    return total;
  });
}

double HighOrderEnergy::add_gradient(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient) const {
  const double weight = 1.0 / static_cast<double>(space_->num_cells());
  const double energy = weight * sum_batches([&](std::size_t g, std::size_t b, Sweep& sweep) {
    const Group& group = groups_[g];
    HenckyBatch hencky;
    Wide sum{};
    const Wide cell_weight = group.cell_weights[b];
    sweep.load(b, nodes);
    sweep.template run<true>([&](std::size_t q, Wide* j) {
      const Wide* reference = group.reference(b, q);
      Wide f[9];
      product(j, reference, f);
      for (int e = 0; e < 9; ++e) store(f[e], hencky.jacobian[e]);
      hencky_gradient(hencky);
      for (int e = 0; e < 9; ++e) f[e] = group.weights[q] * cell_weight * load(hencky.stress[e]);
      product_with_transpose(f, reference, j);
      sum += group.weights[q] * load(hencky.energy);
    });
    keep(group, b, sweep.coefficients());
    double total = 0;
    for (int l = 0; l < group.active[b]; ++l) total += group.cell_weights[b][l] * sum[l];
    return total;
  });
  if (energy < kInfinity) gather_nodes(scale * weight, gradient);
  return energy;
}

double HighOrderEnergy::linearize(std::span<const Vec3> nodes, double scale, std::span<Vec3> gradient) {
  const double weight = 1.0 / static_cast<double>(space_->num_cells());
  for (Group& group : groups_) {
    group.frozen.resize(kFrozen * group.num_points() * group.batches.size());
    group.mean_blocks.resize(54 * group.batches.size());
  }
  const double energy = weight * sum_batches([&](std::size_t g, std::size_t b, Sweep& sweep) {
    Group& group = groups_[g];
    HenckyBatch hencky;
    Wide sum{};
    Wide* blocks = &group.mean_blocks[54 * b];
    const Wide cell_weight = group.cell_weights[b];
    std::fill_n(blocks, 54, Wide{});
    sweep.load(b, nodes);
    sweep.template run<true>([&](std::size_t q, Wide* j) {
      const Wide* reference = group.reference(b, q);
      Wide* frozen = &group.frozen[kFrozen * (b * group.num_points() + q)];
      Wide f[9];
      product(j, reference, f);
      for (int e = 0; e < 9; ++e) store(f[e], hencky.jacobian[e]);
      hencky_hessian(hencky);
      for (int e = 0; e < 9; ++e) f[e] = group.weights[q] * cell_weight * load(hencky.stress[e]);
      product_with_transpose(f, reference, j);
      sum += group.weights[q] * load(hencky.energy);
      const Wide w = scale * weight * group.weights[q] * cell_weight;
      for (int e = 0; e < 9; ++e) frozen[e] = load(hencky.u[e]);
      for (int e = 0; e < 9; ++e) f[e] = load(hencky.v[e]);
      product(reference, f, frozen + 9);
      for (int i = 0; i < 3; ++i) {
        frozen[18 + i] = w * load(hencky.stretch[i]);
        frozen[21 + i] = w * load(hencky.pair_same[i]);
        frozen[24 + i] = w * load(hencky.pair_cross[i]);
      }
      add_blocks(frozen, blocks);
    });
    keep(group, b, sweep.coefficients());
    double total = 0;
    for (int l = 0; l < group.active[b]; ++l) total += group.cell_weights[b][l] * sum[l];
    return total;
  });
  gather_nodes(scale * weight, gradient);
  return energy;
}

void HighOrderEnergy::multiply(std::span<const Vec3> in, std::span<Vec3> out) const {
  sum_batches([&](std::size_t g, std::size_t b, Sweep& sweep) {
    const Group& group = groups_[g];
    const Wide* frozen = &group.frozen[kFrozen * b * group.num_points()];
    sweep.load(b, in);
    sweep.template run<true>([&](std::size_t q, Wide* j) { apply_frozen(frozen + kFrozen * q, j); });
    keep(group, b, sweep.coefficients());
    return 0.0;
  });
  std::fill(out.begin(), out.end(), Vec3::Zero());
  gather_nodes(1, out);
}

void HighOrderEnergy::add_diagonal_blocks(const SparseMap& map, const SparseMap&, std::span<Mat3> diagonal) const {
  std::vector<Mat3> own(space_->num_nodes(), Mat3::Zero());
  for (const Group& group : groups_)
    for (std::size_t b = 0; b < group.batches.size(); ++b)
      for (std::size_t a = 0; a < group.num_modes; ++a)
        for (int l = 0; l < group.active[b]; ++l) {
          const Index node = group.nodes[(b * group.num_modes + a) * kLanes + l];
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

/// Calls per_point(group, batch, q, lane, J, D) with the Jacobians of two fields at every point, batches in parallel.
template <class PerPoint>
void HighOrderEnergy::for_each_pair(std::span<const Vec3> nodes, std::span<const Vec3> direction,
                                    const PerPoint& per_point) const {
  std::vector<std::vector<Wide>> jacobians(omp_get_max_threads());
  sum_batches([&](std::size_t g, std::size_t b, Sweep& sweep) {
    const Group& group = groups_[g];
    std::vector<Wide>& kept = jacobians[omp_get_thread_num()];
    kept.resize(9 * group.num_points());
    sweep.load(b, nodes);
    sweep.template run<false>([&](std::size_t q, const Wide* j) { std::copy_n(j, 9, &kept[9 * q]); });
    sweep.load(b, direction);
    sweep.template run<false>([&](std::size_t q, const Wide* d) {
      for (int l = 0; l < group.active[b]; ++l) {
        Mat3 j, e;
        for (int k = 0; k < 9; ++k) {
          j(k / 3, k % 3) = kept[9 * q + k][l];
          e(k / 3, k % 3) = d[k][l];
        }
        per_point(g, b, q, l, j, e);
      }
    });
    return 0.0;
  });
}

double HighOrderEnergy::max_step(std::span<const Vec3> nodes, std::span<const Vec3> direction, double limit) const {
  StepLimit steps(limit);
  for_each_pair(nodes, direction, [&](std::size_t, std::size_t, std::size_t, int, const Mat3& j, const Mat3& d) {
    steps.admit(j, d);
  });
  return steps.step();
}

bool HighOrderEnergy::stiffen(std::span<const Vec3> nodes, std::span<const Vec3> direction, double t) {
  constexpr double kStiffer = 10;
  std::atomic<bool> changed{false};
  for_each_pair(nodes, direction, [&](std::size_t g, std::size_t b, std::size_t q, int l, const Mat3& j, const Mat3& d) {
    if (StepLimit::safe(j, d, t)) return;
    Group& group = groups_[g];
    Wide* frozen = &group.frozen[kFrozen * (b * group.num_points() + q)];
    Wide more[kFrozen];
    std::copy_n(frozen, kFrozen, more);
    for (int k = 18; k < kFrozen; ++k) {
      more[k] = Wide{};
      more[k][l] = (kStiffer - 1) * frozen[k][l];
      frozen[k][l] *= kStiffer;
    }
    add_blocks(more, &group.mean_blocks[54 * b]);
    changed = true;
  });
  return changed;
}

std::vector<Index> HighOrderEnergy::uncertified(std::span<const Vec3> nodes) const {
  return certify(*space_, nodes).not_certified;
}

void HighOrderEnergy::densify(std::span<const Index> cells) {
  constexpr int kMostPoints = 33;
  constexpr double kHeavier = 2, kHeaviest = 64;
  for (Index c : cells) {
    points_[c] = std::min(std::max(points_[c], kMostPoints), 2 * points_[c] - 1);
    cell_weights_[c] = std::min(kHeaviest, kHeavier * cell_weights_[c]);
  }
  rebuild_groups();
}

}  // namespace subvol
