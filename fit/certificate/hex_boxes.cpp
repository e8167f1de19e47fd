// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/certificate/hex_boxes.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace subvol::internal {

namespace {

/// Model errors up to this share of the mean edges count as small as long as nothing is known about det J.
constexpr double kSmallError = 0.15;
/// Sum of relative model errors above which examining a box does not pay: the shifts of `determinant_bound` add up to
/// about that much if the mean edges represent the mean matrix, and the rest must exceed the variation of J (measured).
constexpr double kHopelessError = 0.55;

/// Largest number of boxes, per precision, that keep their coefficients (15 KB, 8 KB) until they are bisected.
constexpr int kMostKept = 64;

// Model errors may be at most kModelErrorShare * min(lowest det J, kGoodHexDeterminant), with det J relative to the
// cell's mean determinant.
constexpr double kGoodHexDeterminant = 0.5;

/// 1 for those of the first kWide entries of a matrix, stored by columns, that belong to the column.
constexpr Wide kIsColumn[] = {{1, 1, 1, 0, 0, 0, 0, 0}, {0, 0, 0, 1, 1, 1, 0, 0}, {0, 0, 0, 0, 0, 0, 1, 1}};

Wide higher_of(Wide x, const Wide& y) {
  take_higher(x, y);
  return x;
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
    : n_(order + 1), lanes_((n_ + kWide - 1) / kWide * kWide), contraction_(basis, order) {
  for (AlignedDoubles& used : is_used_) used.assign(lanes_, 0);
  bounds_ = contraction_.models(1, 0).bounds();
  slope_bounds_ = contraction_.models(1, 0).slope_bounds();
  mode_bounds_.assign(lanes_, 0);
  inverse_bounds_ = inverse_slope_bounds_ = mode_slope_bounds_ = mode_bounds_;
  weights_.assign(3 * n_ * kWeights, 0);
  std::copy_n(bounds_.begin() + 2, n_ - 2, mode_bounds_.begin() + 2);
  std::copy_n(slope_bounds_.begin() + 2, n_ - 2, mode_slope_bounds_.begin() + 2);
  for (int i = 2; i < n_; ++i) {
    inverse_bounds_[i] = 1 / bounds_[i];
    inverse_slope_bounds_[i] = 1 / slope_bounds_[i];
  }
  sums_.assign((5 * n_ + 1) * lanes_, 0);
}

void HexBoxes::set_cell(std::span<const LocalMode> modes, std::span<const Vec3> coefficients) {
  contraction_.set_cell(modes, coefficients);
  ++cell_;

  Mat3 edges = Mat3::Zero();
  for (int corner = 0; corner < 8; ++corner)
    for (int row = 0; row < 3; ++row)
      for (int d = 0; d < 3; ++d) {
        const int k = corner >> 2, j = corner >> 1 & 1, i = corner & 1;
        const double x = contraction_.modes(row)[k * contraction_.row() + j * n_ + i];
        edges(row, d) += corner >> d & 1 ? x : -x;
      }
  mean_edges_ = 0.25 * edges.colwise().norm().transpose();
  inverse_mean_edges_ = mean_edges_.cwiseInverse();
  make_weights();
  contraction_.take_steps();
  // Products of three such numbers are still within single precision, which ends at 1e-38 and 1e38.
  constexpr double kMostSinglePrecisionTotal = 1e10;
  const double total = contraction_.total().maxCoeff();
  fits_single_ = total < kMostSinglePrecisionTotal && total > 1 / kMostSinglePrecisionTotal;
}

/// Bounds of sums over the modes a_ijk of one row of J, in `sums_`; see `make_weights`. A line is `lanes_` numbers.
struct HexBoxes::RowSums {
  double *by_j, *by_j_slope;  ///< of the sums over k of a_ijk N_k and a_ijk N_k': a line of all i for each j
  double *by_k, *by_k_slope;  ///< of the sums over j of a_ijk N_j and a_ijk N_j': a line of all i for each k
  double* steps;              ///< |a_1jk - a_0jk|: a line of all j for each k
  double* steps_by_j;         ///< of the sums over k of (a_1jk - a_0jk) N_k: one line of all j
};

/// Bounds |sum_i x_i N_i| <= max(|x_0|, |x_1|) + sum_{i >= 2} |x_i| sup|N_i| and |sum_i x_i N_i'| <= |x_1 - x_0| + ...
/// for two directions, one after the other. The indices i are in lanes.
void HexBoxes::make_weights() {
  const int size = n_ * lanes_;
  double* all = sums_.data();
  const RowSums sums{all, all + size, all + 2 * size, all + 3 * size, all + 4 * size, all + 5 * size};
  for (int row = 0; row < 3; ++row) {
    for (int first = 0; first < lanes_; first += kWide) {
      sum_modes(row, first, sums);
      make_mode_weights_along_u(row, first, sums);
    }
    sum_steps(row, sums);
    make_other_weights(row, sums);
  }
  for (int d = 0; d < 3; ++d)
    for (int i = 2; i < n_; ++i)
      is_used_[d][i] = weight(d, i, 0, d) > 0 || weight(d, i, 1, d) > 0 || weight(d, i, 2, d) > 0;
}

/// Fills `by_j`, `by_k` and their slopes for the kWide indices i from `first` on.
void HexBoxes::sum_modes(int row, int first, const RowSums& sums) {
  const int layer = contraction_.row();
  const double* modes = contraction_.modes(row) + first;
  const double *value = bounds_.data(), *slope = slope_bounds_.data();
  // Sums over one index, whose neighbors are `step` apart, for every value of another one, whose neighbors are `stride`
  // apart.
  const auto sum_over = [&](int step, int stride, double* by_other, double* by_other_slope) {
    for (int m = 0; m < n_; ++m) {
      const auto at = [&](int i) { return load_wide(modes + m * stride + i * step); };
      const Wide x0 = at(0), x1 = at(1);
      Wide sum = higher_of(size_of(x0), size_of(x1)), slopes = size_of(x1 - x0);
      for (int i = 2; i < n_; ++i) {
        const Wide x = size_of(at(i));
        sum += value[i] * x, slopes += slope[i] * x;
      }
      store_wide(sum, by_other + m * lanes_ + first);
      store_wide(slopes, by_other_slope + m * lanes_ + first);
    }
  };
  sum_over(layer, n_, sums.by_j, sums.by_j_slope);
  sum_over(n_, layer, sums.by_k, sums.by_k_slope);
}

/// Makes the weights along u of the modes among the kWide indices i from `first` on.
void HexBoxes::make_mode_weights_along_u(int row, int first, const RowSums& sums) {
  const double* value = bounds_.data();
  const double* const by_other[3] = {sums.by_k, sums.by_k_slope, sums.by_j_slope};
  for (int column = 0; column < 3; ++column) {
    const auto of = [&](int m) { return load_wide(by_other[column] + m * lanes_ + first); };
    Wide sum = higher_of(of(0), of(1));
    for (int m = 2; m < n_; ++m) sum += value[m] * of(m);
    for (int i = std::max(first, 2); i < std::min(first + kWide, n_); ++i) weight(0, i, row, column) = sum[i - first];
  }
}

/// Fills `steps` and `steps_by_j`.
void HexBoxes::sum_steps(int row, const RowSums& sums) {
  const double *modes = contraction_.modes(row), *value = bounds_.data();
  for (int k = 0; k < n_; ++k)
    for (int j = 0; j < n_; ++j) {
      const double* x = modes + k * contraction_.row() + j * n_;
      sums.steps[k * lanes_ + j] = std::abs(x[1] - x[0]);
    }
  for (int first = 0; first < lanes_; first += kWide) {
    const auto of = [&](int k) { return load_wide(sums.steps + k * lanes_ + first); };
    Wide sum = higher_of(of(0), of(1));
    for (int k = 2; k < n_; ++k) sum += value[k] * of(k);
    store_wide(sum, sums.steps_by_j + first);
  }
}

/// Makes the weight of the steps along u, and the weights along v and w.
void HexBoxes::make_other_weights(int row, const RowSums& sums) {
  // Sum over the indices in lanes.
  const auto modes_along = [&](const double* x, const AlignedDoubles& bounds) {
    Wide sum{};
    for (int i = 0; i < lanes_; i += kWide) sum += load_wide(x + i) * load_wide(bounds.data() + i);
    return sum_of_lanes(sum);
  };
  const auto along = [&](const double* x) { return std::max(x[0], x[1]) + modes_along(x, mode_bounds_); };
  weight(0, 1, row, 0) = along(sums.steps_by_j);
  for (int m = 2; m < n_; ++m) {
    const int line = m * lanes_;
    weight(1, m, row, 0) = modes_along(sums.by_j + line, mode_slope_bounds_) + sums.steps_by_j[m];
    weight(1, m, row, 1) = along(sums.by_j + line);
    weight(1, m, row, 2) = along(sums.by_j_slope + line);
    weight(2, m, row, 0) = modes_along(sums.by_k + line, mode_slope_bounds_) + along(sums.steps + line);
    weight(2, m, row, 1) = along(sums.by_k_slope + line);
    weight(2, m, row, 2) = along(sums.by_k + line);
  }
}

void HexBoxes::find_line_error(const LineModels::Level& line, int zone, int direction, LineError& result) {
  result.cell = cell_;
  const LineModels::Errors& errors = line.errors[zone];
  // Entries, by columns: those of the column along the direction, and those of the others.
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
}

bool HexBoxes::is_hopeless(Box& box) { return !has_coefficients(box) && choose_models(box) > kHopelessError; }

double HexBoxes::choose_models(Box& box) {
  const double wanted = box.wanted < 0 ? kSmallError : box.wanted;
  box.modeled_levels = box.levels, box.modeled_index = box.index;
  box.halved = 0;
  double sum = 0;
  for (int d = 0; d < 3; ++d) {
    const int last = contraction_.num_tiers(d) - 1;
    int& tier = box.tiers[d];
    for (tier = 0; tier < last && !(error_size(box, d) <= wanted);) ++tier;
    sum += error_size(box, d);
  }
  return sum;
}

void HexBoxes::choose_split(Box& box) {
  // Contractions along u cost least, and neighboring boxes share those along w, and along w and v. So a bisection along
  // w that is needed anyway comes first.
  constexpr double kNeededVariation = 0.3;
  constexpr double kSplitCosts[3] = {0.9, 1, 1.1};
  const bool is_looked_at = has_coefficients(box);
  box.split = -1;
  Vec3 variation = Vec3::Zero();
  for (int d = 2; d >= 0; --d) {
    variation[d] = error_size(box, d);
    if (!is_looked_at && box.split < 0 && variation[d] > kNeededVariation && box.levels[d] < LineModels::kMaxLevel)
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
        (box.split < 0 || variation[d] * kSplitCosts[box.split] > variation[box.split] * kSplitCosts[d]))
      box.split = d;
  if (box.split < 0) box.split = 0;  // no direction can be bisected further
  if (pool_.num_taken() > kMostKept) box.coefficients.reset();
  if (narrow_pool_.num_taken() > kMostKept) box.narrow.reset();
}

bool HexBoxes::improve(Box& box, double lowest, bool is_last) {
  if (box.is_precise) return false;
  const Mat3 mean = narrow_matrices_.mean();
  const Vec3 lengths = mean.colwise().norm().transpose();
  const bool is_looked_at = lengths.maxCoeff() < kMostScale * lengths.minCoeff();
  const double allowed = kModelErrorShare * std::min(lowest / mean_edges_.prod(), kGoodHexDeterminant);
  if (is_looked_at && !is_last && narrow_error_size(box) <= allowed) return false;
  box.is_precise = true;
  box.narrow.reset();
  choose_models(box);  // the next coefficients are contracted with models of the box itself
  return true;
}

double HexBoxes::narrow_error_size(const Box& box) const {
  double by_edge = 0;
  for (int d = 0; d < 3; ++d) by_edge = std::max(by_edge, parts(box.levels[d]) * inverse_mean_edges_[d]);
  return NarrowHexMatrices::entry_errors(box.narrow->precision).sum() * by_edge;
}

std::array<HexBoxes::Box, 2> HexBoxes::children(Box box, double lowest) {
  constexpr double kNarrowShare = 0.25;  // of the error allowed, which single precision may use up
  if (lowest != -std::numeric_limits<double>::infinity())
    box.wanted =
        std::max(kModelErrorShare * std::min(lowest / mean_edges_.prod(), kGoodHexDeterminant), kLeastModelError);
  const bool was_whole = box.level == 0;
  bool keeps = has_coefficients(box) && !was_whole;
  for (int d = 0; d < 3; ++d) keeps = keeps && error_size(box, d) <= box.wanted;
  if (box.narrow) keeps = keeps && narrow_error_size(box) <= kNarrowShare * box.wanted;
  std::array<Box, 2> result;
  for (int half = 0; half < 2; ++half) {
    Box& child = result[half];
    child.levels = box.levels, child.index = box.index, child.tiers = box.tiers;
    child.modeled_levels = box.modeled_levels, child.modeled_index = box.modeled_index;
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

void HexBoxes::find_coefficients(Box& box) {
  if (box.is_precise) {
    box.coefficients = pool_.take();
    contraction_.contract(box, *box.coefficients);
  } else {
    box.narrow = narrow_pool_.take();
    contraction_.contract(box, *box.narrow);
  }
}

/// With P the models: N_i N_j N_k - P_i P_j P_k = (N_i - P_i) N_j N_k + P_i (N_j - P_j) N_k + P_i P_j (N_k - P_k), and
/// likewise with one function of each triple differentiated; |P| is at most `growth` times the bound of |N|.
Mat3 HexBoxes::remainder(const Box& box) {
  Mat3 result = Mat3::Zero();
  double growth = 1, inflation = 1;
  for (int d = 0; d < 3; ++d) {
    const LineError& error = line_error(box, d);
    result += growth * error.entries;
    growth *= error.growth;
    inflation *= error.inflation;
  }
  // Roundings: three contractions of n_ terms, tables accurate to 4 roundings each, the shift, the steps, bisections,
  // L, differences, and the 16 that `determinant_bound` requires. Steps of steps inherit the roundings of the steps
  // they are computed from: kStepRoundings of the total in all.
  constexpr int kStepRoundings = 13;
  const double roundings = 3 * (n_ + 4) + 1 + kStepRoundings + kWide * box.halved + 3 + 8 + 16;
  const double rounding = roundings * (std::numeric_limits<double>::epsilon() / 2) * inflation;
  for (int d = 0; d < 3; ++d) {
    result.col(d) *= 1 / parts(box.levels[d]);
    result.col(d) += 2 * (q1(box, d) - 1) * rounding * contraction_.total();
  }
  return (1 + 1e-10) * result;
}

}  // namespace subvol::internal
