// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/hex_boxes.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace subvol {

namespace {

/// Share of the mean edges up to which errors of models are small as long as nothing is known of det J.
constexpr double kSmallError = 0.15;
/// Beyond this sum it does not pay to look: the shifts of `determinant_bound` sum up to about that much, if the mean
/// edges tell the mean matrix, and what they leave must be more than the variation of J (measured).
constexpr double kHopelessError = 0.55;

/// Boxes of each precision that keep their coefficients (15 KB, 8 KB) until they are halved.
constexpr int kMostKept = 64;

// Of the lowest det J, by the mean edges, up to `kGood` of it: what errors may come to.
constexpr double kShare = 0.1, kGood = 0.3;

constexpr double kNarrowRoundoff = std::numeric_limits<float>::epsilon() / 2;

Wide size(const Wide& x) { return x < 0 ? -x : x; }

/// Which of the first kWide entries of a matrix, by columns, are of that column.
constexpr Wide kIsColumn[] = {{1, 1, 1, 0, 0, 0, 0, 0}, {0, 0, 0, 1, 1, 1, 0, 0}, {0, 0, 0, 0, 0, 0, 1, 1}};

/// Columns of a contraction that are worked on at a time.
constexpr int kSome = 5;

/// Of the functions along u and w, ascending. Fewer than 5 gain nothing (measured).
std::vector<int> model_degrees(Basis basis, int order) {
  if (order == 1 || (basis == Basis::legendre && order < kWide)) return {order};
  return {5, kWide - 1};
}

/// out[o out_stride + m] = in[m] + sum_{k > 0} table[k kStride + o] in[k in_stride + m], o < num_out, for `length`
/// numbers m, rounded up to whole vectors; k < n[m / kWide].
template <int num_out>
void contract_to(const double* table, const double* in, int in_stride, const int* n, int length, double* out,
                 int out_stride) {
  for (int m = 0; m < length; m += kWide) {
    Wide sums[num_out];
    std::fill_n(sums, num_out, load_wide(in + m));
    const int end = n[m / kWide];
    for (int k = 1; k < end; ++k) {
      const Wide x = load_wide(in + k * in_stride + m);
      for (int o = 0; o < num_out; ++o) sums[o] += table[k * LineModels::kStride + o] * x;
    }
    for (int o = 0; o < num_out; ++o) store_wide(sums[o], out + o * out_stride + m);
  }
}

/// out[o row + m] = start[m] + sum_{0 < i < n} table[i kStride + o] in[i row + m], o < num_out, for m < row: vectors,
/// two at a time.
template <int num_out>
void contract_narrow_to(const float* table, const Narrow* start, const Narrow* in, int n, int row, Narrow* out) {
  const auto contract = [&]<class Vector>(int m, const Vector&) {
    const auto load = [](const Narrow* from) {
      Vector result;
      std::memcpy(&result, from, sizeof result);
      return result;
    };
    Vector sums[num_out];
    std::fill_n(sums, num_out, load(start + m));
    for (int i = 1; i < n; ++i) {
      const Vector x = load(in + i * row + m);
      for (int o = 0; o < num_out; ++o) sums[o] += table[i * LineModels::kStride + o] * x;
    }
    for (int o = 0; o < num_out; ++o) std::memcpy(out + o * row + m, &sums[o], sizeof(Vector));
  };
  int m = 0;
  for (; m + 2 <= row; m += 2) contract(m, WideFloats{});
  if (m < row) contract(m, Narrow{});
}

using Contraction = void (*)(const double*, const double*, int, const int*, int, double*, int);
/// The one for so many outputs.
Contraction contraction(int num_out) {
  static constexpr Contraction all[] = {nullptr,        contract_to<1>, contract_to<2>, contract_to<3>, contract_to<4>,
                                        contract_to<5>, contract_to<6>, contract_to<7>, contract_to<8>};
  return all[num_out];
}

using NarrowContraction = void (*)(const float*, const Narrow*, const Narrow*, int, int, Narrow*);
NarrowContraction narrow_contraction(int num_out) {
  static constexpr NarrowContraction all[] = {nullptr,
                                              contract_narrow_to<1>,
                                              contract_narrow_to<2>,
                                              contract_narrow_to<3>,
                                              contract_narrow_to<4>,
                                              contract_narrow_to<5>,
                                              contract_narrow_to<6>,
                                              contract_narrow_to<7>,
                                              contract_narrow_to<8>};
  return all[num_out];
}

}  // namespace

template <class Vector>
typename CoefficientsPool<Vector>::Pooled CoefficientsPool<Vector>::take() {
  if (spare_.empty()) {
    spare_.reserve(++num_made_);  // so that returning them never allocates
    spare_.push_back(std::make_unique<Coefficients>());
  }
  Pooled result(spare_.back().release(), Return{this});
  spare_.pop_back();
  return result;
}

HexBoxes::HexBoxes(Basis basis, int order)
    : n_(order + 1), lanes_((n_ + kWide - 1) / kWide * kWide), row_((n_ * n_ + kWide - 1) / kWide * kWide) {
  for (const int degree : model_degrees(basis, order)) tiers_[0].push_back(&LineModels::get(basis, order, degree));
  tiers_[1] = {&LineModels::get(basis, order, kWide - 1)};
  tiers_[2] = tiers_[0];
  const int most = tiers_[0].back()->degree() + 1, face = n_ * n_;
  for (int d = 0; d < 3; ++d) {
    modes_[d].assign(row_ * n_ + kWide, 0);
    after_w_[d].assign(most * row_ + kWide, 0);
    after_v_[d].assign((n_ + kSome) * most, Wide{});
    narrow_after_v_[d].assign(n_ * most, Narrow{});
    is_used_[d].assign(lanes_, 0);
  }
  bounds_ = tiers_[1][0]->bounds();
  slope_bounds_ = tiers_[1][0]->slope_bounds();
  lane_bounds_.assign(lanes_, 0);
  inverse_bounds_ = inverse_slope_bounds_ = mode_slope_bounds_ = mode_bounds_ = lane_bounds_;
  weights_.assign(3 * n_ * kWeights, 0);
  std::copy_n(bounds_.begin(), n_, lane_bounds_.begin());
  std::copy_n(bounds_.begin() + 2, n_ - 2, mode_bounds_.begin() + 2);
  std::copy_n(slope_bounds_.begin() + 2, n_ - 2, mode_slope_bounds_.begin() + 2);
  for (int i = 2; i < n_; ++i) {
    inverse_bounds_[i] = 1 / bounds_[i];
    inverse_slope_bounds_[i] = 1 / slope_bounds_[i];
  }
  used_.resize((face + kWide - 1) / kWide);
  all_used_.assign(kWide, n_);
  sums_.assign((5 * n_ + 1) * lanes_, 0);
}

void HexBoxes::set_modes(std::span<const LocalMode> modes) {
  of_modes_ = modes.data();
  num_modes_ = modes.size();
  std::fill(used_.begin(), used_.end(), 0);
  places_.clear();
  for (const LocalMode& mode : modes) {
    places_.push_back(mode.k * row_ + mode.j * n_ + mode.i);
    const int last_i = std::max<int>(mode.i, 1), last_j = std::max<int>(mode.j, 1), last_k = std::max<int>(mode.k, 1);
    for (int j = mode.j; j <= last_j; ++j)  // and where its steps go
      for (int i = mode.i; i <= last_i; ++i) {
        int& used = used_[(j * n_ + i) / kWide];
        used = std::max(used, last_k + 1);
      }
  }
}

void HexBoxes::set_cell(std::span<const LocalMode> modes, std::span<const Vec3> coefficients) {
  if (modes.data() != of_modes_ || modes.size() != num_modes_) set_modes(modes);
  for (int d = 0; d < 3; ++d) std::fill(modes_[d].begin(), modes_[d].end(), 0.0);
  for (std::size_t a = 0; a < modes.size(); ++a)
    for (int d = 0; d < 3; ++d) modes_[d][places_[a]] = coefficients[a][d];
  contracted_ = 0;
  ++cell_;

  Mat3 edges = Mat3::Zero();
  for (int corner = 0; corner < 8; ++corner)
    for (int row = 0; row < 3; ++row)
      for (int d = 0; d < 3; ++d) {
        const double x = modes_[row][(corner >> 2) * row_ + (corner >> 1 & 1) * n_ + (corner & 1)];
        edges(row, d) += corner >> d & 1 ? x : -x;
      }
  mean_edges_ = 0.25 * edges.colwise().norm().transpose();
  inverse_mean_edges_ = mean_edges_.cwiseInverse();
  make_weights();
  take_steps();
  constexpr double kMost = 1e10;
  fits_single_ = total_.maxCoeff() < kMost && total_.maxCoeff() > 1 / kMost;
}

/// By 1, x, N_2, ... in all directions, instead of N_0, N_1, N_2, ...: for 1 nothing must be multiplied.
void HexBoxes::take_steps() {
  for (int d = 0; d < 3; ++d) {
    double* x = modes_[d].data();
    for (int m = 0; m < n_ * n_; ++m) x[row_ + m] -= x[m];
    for (int k = 0; k < n_; ++k, x += row_) {
      for (int i = 0; i < n_; ++i) x[n_ + i] -= x[i];
      for (int j = 0; j < n_; ++j) x[j * n_ + 1] -= x[j * n_];
    }
  }
  for (int d = 0; d < 3; ++d) {
    Wide total{};
    for (int k = 0; k < n_; ++k)
      for (int j = 0; j < n_; ++j) {
        const double* x = modes_[d].data() + k * row_ + j * n_;
        Wide sum{};
        for (int i = 0; i < lanes_; i += kWide) sum += load_wide(lane_bounds_.data() + i) * size(load_wide(x + i));
        total += bounds_[k] * bounds_[j] * sum;
      }
    total_[d] = sum_of_lanes(total);
  }
}

/// |sum_i x_i N_i| <= max(|x_0|, |x_1|) + sum_{i >= 2} |x_i| sup|N_i|, |sum_i x_i N_i'| <= |x_1 - x_0| + ...: that for
/// two directions, one after the other. Numbers i are in lanes.
void HexBoxes::make_weights() {
  const auto larger = [](Wide x, const Wide& y) {
    take_higher(x, y);
    return x;
  };
  // Of the numbers in lanes.
  const auto modes_along = [&](const double* x, const AlignedDoubles& bounds) {
    Wide sum{};
    for (int i = 0; i < lanes_; i += kWide) sum += load_wide(x + i) * load_wide(bounds.data() + i);
    return sum_of_lanes(sum);
  };
  const auto along = [&](const double* x) { return std::max(x[0], x[1]) + modes_along(x, mode_bounds_); };
  const int line = n_ * lanes_;
  double *by_j = sums_.data(), *by_j_slope = by_j + line, *by_k = by_j_slope + line, *by_k_slope = by_k + line,
         *steps = by_k_slope + line, *steps_by_j = steps + line;
  const double *value = bounds_.data(), *slope = slope_bounds_.data();
  for (int row = 0; row < 3; ++row) {
    const double* modes = modes_[row].data();
    for (int first = 0; first < lanes_; first += kWide) {
      const auto at = [&](int j, int k) { return load_wide(modes + k * row_ + j * n_ + first); };
      for (int j = 0; j < n_; ++j) {
        const Wide x0 = at(j, 0), x1 = at(j, 1);
        Wide sum = larger(size(x0), size(x1)), slopes = size(x1 - x0);
        for (int k = 2; k < n_; ++k) {
          const Wide x = size(at(j, k));
          sum += value[k] * x, slopes += slope[k] * x;
        }
        store_wide(sum, by_j + j * lanes_ + first);
        store_wide(slopes, by_j_slope + j * lanes_ + first);
      }
      for (int k = 0; k < n_; ++k) {
        const Wide x0 = at(0, k), x1 = at(1, k);
        Wide sum = larger(size(x0), size(x1)), slopes = size(x1 - x0);
        for (int j = 2; j < n_; ++j) {
          const Wide x = size(at(j, k));
          sum += value[j] * x, slopes += slope[j] * x;
        }
        store_wide(sum, by_k + k * lanes_ + first);
        store_wide(slopes, by_k_slope + k * lanes_ + first);
      }
      const double* const sums[3] = {by_k, by_k_slope, by_j_slope};
      for (int column = 0; column < 3; ++column) {
        const auto of = [&](int m) { return load_wide(sums[column] + m * lanes_ + first); };
        Wide sum = larger(of(0), of(1));
        for (int m = 2; m < n_; ++m) sum += value[m] * of(m);
        for (int i = std::max(first, 2); i < std::min(first + kWide, n_); ++i)
          weight(0, i, row, column) = sum[i - first];
      }
    }

    // |a_1jk - a_0jk|, by k and j, and these numbers' sum over k.
    for (int k = 0; k < n_; ++k)
      for (int j = 0; j < n_; ++j) {
        const double* x = modes + k * row_ + j * n_;
        steps[k * lanes_ + j] = std::abs(x[1] - x[0]);
      }
    for (int first = 0; first < lanes_; first += kWide) {
      const auto of = [&](int k) { return load_wide(steps + k * lanes_ + first); };
      Wide sum = larger(of(0), of(1));
      for (int k = 2; k < n_; ++k) sum += value[k] * of(k);
      store_wide(sum, steps_by_j + first);
    }
    weight(0, 1, row, 0) = along(steps_by_j);
    for (int m = 2; m < n_; ++m) {
      weight(1, m, row, 0) = modes_along(by_j + m * lanes_, mode_slope_bounds_) + steps_by_j[m];
      weight(1, m, row, 1) = along(by_j + m * lanes_);
      weight(1, m, row, 2) = along(by_j_slope + m * lanes_);
      weight(2, m, row, 0) = modes_along(by_k + m * lanes_, mode_slope_bounds_) + along(steps + m * lanes_);
      weight(2, m, row, 1) = along(by_k_slope + m * lanes_);
      weight(2, m, row, 2) = along(by_k + m * lanes_);
    }
  }
  for (int d = 0; d < 3; ++d)
    for (int i = 2; i < n_; ++i)
      is_used_[d][i] = weight(d, i, 0, d) > 0 || weight(d, i, 1, d) > 0 || weight(d, i, 2, d) > 0;
}

const HexBoxes::LineError& HexBoxes::line_error(const Box& box, int direction) {
  const int level = box.modelled_levels[direction], tier = box.tiers[direction];
  const int zone = LineModels::zone(level, box.modelled_index[direction]);
  LineError& result = errors_[direction][level][tier][zone];
  if (result.cell == cell_) return result;
  result.cell = cell_;
  const LineModels::Level& line = tiers_[direction][tier]->level(level);
  const LineModels::Errors& errors = line.errors[zone];
  // Entries, by columns: of the column along the direction, and of the others.
  const Wide is_along = kIsColumn[direction], is_across = 1 - is_along;
  Wide entries{};
  double last = 0;
  for (int i = 2; i < n_; ++i) {
    const double* weights = &weight(direction, i, 0, 0);
    entries += (errors.slope[i] * is_along + errors.value[i] * is_across) * load_wide(weights);
    last += (direction == 2 ? errors.slope[i] : errors.value[i]) * weights[kWide];
  }
  store_wide(entries, result.entries.data());
  result.entries(2, 2) = last;
  Wide growth{}, inflation{};
  for (int i = 0; i < lanes_; i += kWide) {
    const Wide value = load_wide(errors.value.data() + i), slope = load_wide(errors.slope.data() + i);
    const Wide is_used = load_wide(is_used_[direction].data() + i);
    const Wide inverse_bound = is_used * load_wide(inverse_bounds_.data() + i);
    take_higher(growth, value * inverse_bound);
    take_higher(growth, is_used * slope * load_wide(inverse_slope_bounds_.data() + i));
    take_higher(inflation, load_wide(line.largest_coefficient.data() + i) * inverse_bound);
  }
  result.growth = 1 + highest_lane(growth);
  result.inflation = std::max(1.0, highest_lane(inflation));
  result.size = line.exact ? 0 : result.entries.colwise().sum().dot(inverse_mean_edges_);
  return result;
}

bool HexBoxes::is_hopeless(Box& box) { return !has_coefficients(box) && choose_models(box) > kHopelessError; }

double HexBoxes::choose_models(Box& box) {
  const double wanted = box.wanted < 0 ? kSmallError : box.wanted;
  box.modelled_levels = box.levels, box.modelled_index = box.index;
  box.halved = 0;
  double sum = 0;
  for (int d = 0; d < 3; ++d) {
    const int last = static_cast<int>(tiers_[d].size()) - 1;
    int& tier = box.tiers[d];
    for (tier = 0; tier < last && !(error_size(box, d) <= wanted);) ++tier;
    sum += error_size(box, d);
  }
  return sum;
}

void HexBoxes::choose_split(Box& box) {
  // Contractions along u cost least, and boxes next to one another share those along w, and v: what must be halved
  // anyway along w comes first.
  constexpr double kNeeded = 0.6;
  constexpr double kCost[3] = {0.9, 1, 1.1};
  const bool is_looked_at = has_coefficients(box);
  box.split = -1;
  Vec3 variation = Vec3::Zero();
  for (int d = 2; d >= 0; --d) {
    variation[d] = error_size(box, d);
    if (!is_looked_at && box.split < 0 && variation[d] > kNeeded && box.levels[d] < LineModels::kMaxLevel)
      box.split = d;
  }
  if (box.split >= 0) return;
  if (is_looked_at) {
    Mat3 varies;
    with_matrices(box, [&](const auto& matrices) { varies = matrices.variation(); });
    for (int d = 0; d < 3; ++d)
      for (int column = 0; column < 3; ++column)
        variation[d] += varies(d, column) * parts(box.levels[column]) * inverse_mean_edges_[column];
  }
  for (int d = 0; d < 3; ++d)
    if (box.levels[d] < LineModels::kMaxLevel &&
        (box.split < 0 || variation[d] * kCost[box.split] > variation[box.split] * kCost[d]))
      box.split = d;
  if (box.split < 0) box.split = 0;  // the deepest box there is
  if (pool_.num_taken() > kMostKept) box.coefficients.reset();
  if (narrow_pool_.num_taken() > kMostKept) box.narrow.reset();
}

bool HexBoxes::improve(Box& box, double lowest, bool is_last) {
  if (box.is_precise) return false;
  const Mat3 mean = narrow_matrices_.mean();
  const Vec3 lengths = mean.colwise().norm().transpose();
  const bool is_looked_at = lengths.maxCoeff() < kMostScale * lengths.minCoeff();
  const double allowed = kShare * std::min(lowest / mean_edges_.prod(), kGood);
  if (is_looked_at && !is_last && narrow_error_size(box) <= allowed) return false;
  box.is_precise = true;
  box.narrow.reset();
  choose_models(box);  // what comes next is contracted, with models of the box itself
  return true;
}

double HexBoxes::narrow_error_size(const Box& box) const {
  double by_edge = 0;
  for (int d = 0; d < 3; ++d) by_edge = std::max(by_edge, parts(box.levels[d]) * inverse_mean_edges_[d]);
  return NarrowHexMatrices::entry_errors(box.narrow->precision).sum() * by_edge;
}

std::array<HexBoxes::Box, 2> HexBoxes::children(Box box, double lowest) {
  constexpr double kLeast = 1e-9, kNarrowShare = 0.25;
  if (lowest != -std::numeric_limits<double>::infinity())
    box.wanted = std::max(kShare * std::min(lowest / mean_edges_.prod(), kGood), kLeast);
  const bool was_whole = box.level == 0;
  bool keeps = has_coefficients(box) && !was_whole;
  for (int d = 0; d < 3; ++d) keeps = keeps && error_size(box, d) <= box.wanted;
  if (box.narrow) keeps = keeps && narrow_error_size(box) <= kNarrowShare * box.wanted;
  std::array<Box, 2> result;
  for (int half = 0; half < 2; ++half) {
    Box& child = result[half];
    child.levels = box.levels, child.index = box.index, child.tiers = box.tiers;
    child.modelled_levels = box.modelled_levels, child.modelled_index = box.modelled_index;
    child.wanted = box.wanted;
    child.near_l = box.near_l;
    child.halved = box.halved + 1;
    child.level = box.level + 1;
    child.is_precise = !fits_single_ || (box.is_precise && !was_whole);
    ++child.levels[box.split];
    child.index[box.split] = 2 * box.index[box.split] + half;
  }
  const auto halve = [&](auto& pool, auto coefficients) {
    result[1].*coefficients = pool.take();
    (box.*coefficients)->halve(box.split, *(result[1].*coefficients));
    result[0].*coefficients = std::move(box.*coefficients);
  };
  if (keeps && box.coefficients) halve(pool_, &Box::coefficients);
  if (keeps && box.narrow) halve(narrow_pool_, &Box::narrow);
  return result;
}

Vec3 HexBoxes::corner_point(const Box& box, int corner) {
  Vec3 point;
  for (int d = 0; d < 3; ++d) point[d] = std::ldexp(box.index[d] + (corner >> d & 1), -box.levels[d]);
  return point;
}

std::size_t HexBoxes::corner_matrix(const Box& box, int corner) const {
  const int num_w = q1(box, 2);
  const int u = (corner & 1) * (q1(box, 0) - 1), v = (corner >> 1 & 1) * (kWide - 1), w = (corner >> 2) * (num_w - 1);
  return static_cast<std::size_t>((u * num_w + w) * kWide + v);
}

bool HexBoxes::shares(const Box& box, int d) const {
  return contracted_levels_[d] == box.levels[d] && contracted_index_[d] == box.index[d] &&
         contracted_tiers_[d] == box.tiers[d];
}

void HexBoxes::find_coefficients(Box& box) {
  if (contracted_ > 0 && !shares(box, 2)) contracted_ = 0;
  if (contracted_ > 1 && !shares(box, 1)) contracted_ = 1;
  if (contracted_ < 1) contract_w(box);
  if (contracted_ < 2) contract_v(box);
  contracted_ = 2;
  contracted_levels_ = box.levels, contracted_index_ = box.index, contracted_tiers_ = box.tiers;
  if (box.is_precise) {
    box.coefficients = pool_.take();
    contract_u(box, *box.coefficients);
  } else {
    box.narrow = narrow_pool_.take();
    contract_u(box, *box.narrow);
  }
}

void HexBoxes::contract_w(const Box& box) {
  const LineModels& line = models(box, 2);
  const double* table = line.coefficients(line.level(box.levels[2]), box.index[2]);
  const int face = n_ * n_;
  const Contraction contract = contraction(q1(box, 2));
  for (int d = 0; d < 3; ++d)  // runs over the end of face
    contract(table, modes_[d].data(), row_, used_.data(), face, after_w_[d].data(), row_);
}

void HexBoxes::contract_v(const Box& box) {
  is_after_v_narrowed_ = false;
  const LineModels& line = models(box, 1);
  const double* table = line.coefficients(line.level(box.levels[1]), box.index[1]);
  const int num_w = q1(box, 2);
  for (int d = 0; d < 3; ++d)
    for (int w = 0; w < num_w; ++w) {
      const double* in = after_w_[d].data() + w * row_;
      for (int i = 0; i < n_; i += kSome) {  // runs over the end: what comes from there is written over, or not used
        Wide sums[kSome];
        for (int s = 0; s < kSome; ++s) sums[s] = Wide{} + in[i + s];
        for (int j = 1; j < n_; ++j) {
          const Wide x = load_wide(table + j * LineModels::kStride);
          for (int s = 0; s < kSome; ++s) sums[s] += in[j * n_ + i + s] * x;
        }
        for (int s = 0; s < kSome; ++s) after_v_[d][(i + s) * num_w + w] = sums[s];
      }
    }
}

void HexBoxes::contract_u(const Box& box, HexCoefficients& result) {
  const LineModels& line = models(box, 0);
  const double* table = line.coefficients(line.level(box.levels[0]), box.index[0]);
  const int num_w = q1(box, 2), row = num_w * kWide;
  const Contraction contract = contraction(q1(box, 0));
  result.resize(q1(box, 0), num_w);
  for (int d = 0; d < 3; ++d) {
    const double* in = reinterpret_cast<const double*>(after_v_[d].data());
    double* out = reinterpret_cast<double*>(result.coordinate(d));
    contract(table, in, row, all_used_.data(), row, out, row);
  }
}

void HexBoxes::narrow_after_v(int num_w) {
  for (int d = 0; d < 3; ++d)
    for (int m = num_w; m < n_ * num_w; ++m) narrow_after_v_[d][m] = narrow(after_v_[d][m]);  // from i = 1 on
  is_after_v_narrowed_ = true;
}

/// With c_i in the middle between the coefficients b_io of N_i's model, and A_i what is multiplied with them:
///
///   X_o = (A_0 + sum_i c_i A_i) + sum_i (b_io - c_i) A_i,
///
/// the first sum in double precision, and relative to a point of it: so all that is rounded is small beside the box.
void HexBoxes::contract_u(const Box& box, NarrowHexCoefficients& result) {
  const LineModels& line = models(box, 0);
  const LineModels::Level& level = line.level(box.levels[0]);
  const double* middles = line.middles(level, box.index[0]);
  const float* deviations = line.deviations(level, box.index[0]);
  const int num_w = q1(box, 2), num_u = q1(box, 0);
  const NarrowContraction contract = narrow_contraction(num_u);
  if (!is_after_v_narrowed_) narrow_after_v(num_w);
  result.resize(num_u, num_w);
  const double inflation = line_error(box, 1).inflation * line_error(box, 2).inflation;
  for (int d = 0; d < 3; ++d) {
    const Wide* in = after_v_[d].data();
    Wide start[kWide], sizes{};
    constexpr int kTogether = 4;  // runs over the end
    for (int w = 0; w < num_w; w += kTogether) {
      Wide sums[kTogether];
      for (int s = 0; s < kTogether; ++s) sums[s] = in[w + s];
      for (int i = 1; i < n_; ++i)
        for (int s = 0; s < kTogether; ++s) sums[s] += middles[i] * in[i * num_w + w + s];
      for (int s = 0; s < kTogether; ++s) start[w + s] = sums[s];
    }
    const double origin = start[num_w / 2][kWide / 2];
    Narrow narrow_start[kWide];
    for (int w = 0; w < num_w; ++w) {
      start[w] -= origin;
      take_higher_size(sizes, start[w]);
      narrow_start[w] = narrow(start[w]);
    }
    contract(deviations, narrow_start, narrow_after_v_[d].data(), n_, num_w, result.coordinate(d));
    double deviating = 0;
    for (int i = 1; i < n_; ++i) deviating += level.largest_deviation[i] * weight(0, i, d, 0);
    result.precision.sizes[d] = (1 + 1e-5) * (highest_lane(sizes) + inflation * deviating);
  }
  // The start, both factors, their product, and each of n_ - 1 sums are rounded; below 1e-36, errors are not by size.
  result.precision.errors = (n_ + 2) * kNarrowRoundoff * result.precision.sizes + Vec3::Constant(1e-36);
}

/// With P the models: N_i N_j N_k - P_i P_j P_k = (N_i - P_i) N_j N_k + P_i (N_j - P_j) N_k + P_i P_j (N_k - P_k), and
/// so with one of each three differentiated; |P| is at most `growth` times what bounds |N|.
Mat3 HexBoxes::remainder(const Box& box) {
  Mat3 result = Mat3::Zero();
  double growth = 1, inflation = 1;
  for (int d = 0; d < 3; ++d) {
    const LineError& error = line_error(box, d);
    result += growth * error.entries;
    growth *= error.growth;
    inflation *= error.inflation;
  }
  // Three contractions of n_ terms, tables good to 4 roundings each, the shift, the steps, two for coefficients in two
  // parts and the box's point, halvings, L, differences, and the 16 asked for. Steps of steps have the roundings of
  // those that they are made of: all in all kSteps of total_.
  constexpr int kSteps = 13;
  const double roundings = 3 * (n_ + 4) + 1 + kSteps + 2 + kWide * box.halved + 3 + 8 + 16;
  const double rounding = roundings * (std::numeric_limits<double>::epsilon() / 2) * inflation;
  for (int d = 0; d < 3; ++d) {
    result.col(d) *= 1 / parts(box.levels[d]);
    result.col(d) += 2 * (q1(box, d) - 1) * rounding * total_;
  }
  return (1 + 1e-10) * result;
}

}  // namespace subvol
