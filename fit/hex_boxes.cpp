// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/hex_boxes.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace subvol {

namespace {

/// Share of the mean edges up to which errors of models are small as long as nothing is known of det J.
constexpr double kSmallError = 0.15;
/// Beyond this sum it does not pay to look: the shifts of `determinant_bound` sum up to about that much, if the mean
/// edges tell the mean matrix, and what they leave must be more than the variation of J (measured).
constexpr double kHopelessError = 0.5;

/// Columns of a contraction that are worked on at a time.
constexpr int kSome = 5;

/// Of the functions along u and w, ascending. Fewer than 5 gain nothing (measured).
std::vector<int> model_degrees(Basis basis, int order) {
  if (order == 1 || (basis == Basis::legendre && order < kWide)) return {order};
  return {5, kWide - 1};
}

/// Lanes one place up (down); what comes into the first (last) one is of no use.
Wide shifted_up(const Wide& x) { return __builtin_shufflevector(x, x, 0, 0, 1, 2, 3, 4, 5, 6); }
Wide shifted_down(const Wide& x) { return __builtin_shufflevector(x, x, 1, 2, 3, 4, 5, 6, 7, 7); }

/// out[o out_stride + m] = sum_k table[k kStride + o] in[k in_stride + m], o < num_out, for `length` numbers m, rounded
/// up to whole vectors; k < n[m / kWide].
template <int num_out>
void contract_to(const double* table, const double* in, int in_stride, const int* n, int length, double* out,
                 int out_stride) {
  for (int m = 0; m < length; m += kWide) {
    Wide sums[num_out] = {};
    const int end = n[m / kWide];
    for (int k = 0; k < end; ++k) {
      const Wide x = load_wide(in + k * in_stride + m);
      for (int o = 0; o < num_out; ++o) sums[o] += table[k * LineModels::kStride + o] * x;
    }
    for (int o = 0; o < num_out; ++o) store_wide(sums[o], out + o * out_stride + m);
  }
}

using Contraction = void (*)(const double*, const double*, int, const int*, int, double*, int);
/// The one for so many outputs.
Contraction contraction(int num_out) {
  static constexpr Contraction all[] = {nullptr,        contract_to<1>, contract_to<2>, contract_to<3>, contract_to<4>,
                                        contract_to<5>, contract_to<6>, contract_to<7>, contract_to<8>};
  return all[num_out];
}

}  // namespace

HexBoxes::HexBoxes(Basis basis, int order)
    : n_(order + 1), lanes_((n_ + kWide - 1) / kWide * kWide), row_((n_ * n_ + kWide - 1) / kWide * kWide) {
  for (const int degree : model_degrees(basis, order)) tiers_[0].push_back(&LineModels::get(basis, order, degree));
  tiers_[1] = {&LineModels::get(basis, order, kWide - 1)};
  tiers_[2] = tiers_[0];
  const int most = tiers_[0].back()->degree() + 1, face = n_ * n_;
  for (int d = 0; d < 3; ++d) {
    modes_[d].assign(face * n_ + kWide, 0);
    after_w_[d].assign(most * row_ + kWide, 0);
    after_v_[d].assign((n_ + kSome) * most, Wide{});
    control_[d].assign((most + 2) * most, Wide{});
    for (auto& weights : weights_[d]) weights.resize(n_);
  }
  bounds_.assign(lanes_, 0);
  slope_bounds_.assign(lanes_, 0);
  std::copy_n(tiers_[1][0]->bounds().begin(), n_, bounds_.begin());
  std::copy_n(tiers_[1][0]->slope_bounds().begin(), n_, slope_bounds_.begin());
  used_.resize((face + kWide - 1) / kWide);
  all_used_.assign(kWide, n_);
  sums_.resize(4 * n_ * lanes_);
}

void HexBoxes::set_cell(std::span<const LocalMode> modes, std::span<const Vec3> coefficients) {
  const int face = n_ * n_;
  for (int d = 0; d < 3; ++d) std::fill(modes_[d].begin(), modes_[d].end(), 0.0);
  std::fill(used_.begin(), used_.end(), 0);
  for (std::size_t a = 0; a < modes.size(); ++a) {
    const int at = (modes[a].k * n_ + modes[a].j) * n_ + modes[a].i;
    for (int d = 0; d < 3; ++d) modes_[d][at] = coefficients[a][d];
    int& used = used_[at % face / kWide];
    if (coefficients[a] != Vec3::Zero()) used = std::max(used, modes[a].k + 1);
  }
  contracted_ = 0;
  ++cell_;

  Mat3 edges = Mat3::Zero();
  for (int corner = 0; corner < 8; ++corner)
    for (int row = 0; row < 3; ++row)
      for (int d = 0; d < 3; ++d) {
        const double x = modes_[row][((corner >> 2) * n_ + (corner >> 1 & 1)) * n_ + (corner & 1)];
        edges(row, d) += corner >> d & 1 ? x : -x;
      }
  mean_edges_ = 0.25 * edges.colwise().norm().transpose();
  make_weights();
}

void HexBoxes::make_weights() {
  const int face = n_ * lanes_;
  for (int row = 0; row < 3; ++row) {
    std::fill(sums_.begin(), sums_.end(), 0.0);
    double *by_j = sums_.data(), *by_j_slope = by_j + face, *by_k = by_j_slope + face, *by_k_slope = by_k + face;
    for (int k = 0; k < n_; ++k)
      for (int j = 0; j < n_; ++j)
        for (int i = 0; i < n_; i += kWide) {
          Wide a = load_wide(modes_[row].data() + (k * n_ + j) * n_ + i);
          a = a < 0 ? -a : a;
          const auto add = [&](double* sums, int m, double factor) {
            double* at = sums + m * lanes_ + i;
            store_wide(load_wide(at) + factor * a, at);
          };
          add(by_j, j, bounds_[k]);
          add(by_j_slope, j, slope_bounds_[k]);
          add(by_k, k, bounds_[j]);
          add(by_k_slope, k, slope_bounds_[j]);
        }
    const auto dot = [&](const double* sums, int m, const std::vector<double>& bounds) {
      Wide sum{};
      for (int i = 0; i < n_; i += kWide) sum += load_wide(sums + m * lanes_ + i) * load_wide(bounds.data() + i);
      return sum_of_lanes(sum);
    };
    auto &of_u = weights_[0], &of_v = weights_[1], &of_w = weights_[2];
    total_[row] = 0;
    for (int m = 0; m < n_; ++m) {
      of_v[0][m][row] = dot(by_j, m, slope_bounds_);
      of_v[1][m][row] = dot(by_j, m, bounds_);
      of_v[2][m][row] = dot(by_j_slope, m, bounds_);
      of_w[0][m][row] = dot(by_k, m, slope_bounds_);
      of_w[1][m][row] = dot(by_k_slope, m, bounds_);
      of_w[2][m][row] = dot(by_k, m, bounds_);
      total_[row] += bounds_[m] * of_w[2][m][row];
    }
    for (int i = 0; i < n_; i += kWide) {
      Wide sums[3] = {};
      for (int k = 0; k < n_; ++k) {
        const Wide value = load_wide(by_k + k * lanes_ + i);
        sums[0] += bounds_[k] * value;
        sums[1] += bounds_[k] * load_wide(by_k_slope + k * lanes_ + i);
        sums[2] += slope_bounds_[k] * value;
      }
      for (int column = 0; column < 3; ++column)
        for (int m = i; m < std::min(n_, i + kWide); ++m) of_u[column][m][row] = sums[column][m - i];
    }
  }
}

const HexBoxes::LineError& HexBoxes::line_error(const Box& box, int direction) {
  const int level = box.levels[direction], tier = box.tiers[direction];
  const int zone = LineModels::zone(level, box.index[direction]);
  LineError& result = errors_[direction][level][tier][zone];
  if (result.cell == cell_) return result;
  result.cell = cell_;
  const LineModels::Level& line = tiers_[direction][tier]->level(level);
  const LineModels::Errors& errors = line.errors[zone];
  result.entries.setZero();
  result.growth = result.inflation = 1;
  for (int i = 0; i < n_; ++i) {
    if (weights_[direction][direction][i] == Vec3::Zero()) continue;
    for (int column = 0; column < 3; ++column)
      result.entries.col(column) +=
          (column == direction ? errors.slope[i] : errors.value[i]) * weights_[direction][column][i];
    result.growth =
        std::max({result.growth, 1 + errors.value[i] / bounds_[i], 1 + errors.slope[i] / slope_bounds_[i]});
    result.inflation = std::max(result.inflation, line.largest_coefficient[i] / bounds_[i]);
  }
  result.size = line.exact ? 0 : result.entries.colwise().sum().cwiseQuotient(mean_edges_.transpose()).sum();
  return result;
}

bool HexBoxes::is_hopeless(Box& box) {
  const double wanted = box.wanted < 0 ? kSmallError : box.wanted;
  double sum = 0;
  for (int d = 0; d < 3; ++d) {
    const int last = static_cast<int>(tiers_[d].size()) - 1;
    int& tier = box.tiers[d];
    for (tier = 0; tier < last && !(error_size(box, d) <= wanted);) ++tier;
    sum += error_size(box, d);
  }
  return sum > kHopelessError;
}

void HexBoxes::choose_split(Box& box) {
  // Contractions along u cost least, and boxes next to one another share those along w, and v: what must be halved
  // anyway along w comes first.
  constexpr double kNeeded = 0.6;
  constexpr double kCost[3] = {0.9, 1, 1.1};
  const bool is_looked_at = contracted_ == 3 && current_.levels == box.levels && current_.index == box.index;
  box.split = -1;
  Vec3 variation = Vec3::Zero();
  for (int d = 2; d >= 0; --d) {
    variation[d] = error_size(box, d);
    if (!is_looked_at && box.split < 0 && variation[d] > kNeeded && box.levels[d] < LineModels::kMaxLevel)
      box.split = d;
  }
  if (box.split >= 0) return;
  if (is_looked_at) {
    const int num_u = q1(box, 0), num_w = q1(box, 2);
    const double samples = kWide * (num_u / 2) * (num_w / 2);
    const auto size = [](const Wide& x) { return x < 0 ? -x : x; };
    for (int column = 0; column < 3; ++column)
      for (int row = 0; row < 3; ++row) {
        const double* entries = matrices_.entries(row, column);
        Wide steps[3] = {};
        for (int u = 0; u + 1 < num_u; u += 2)
          for (int w = 0; w + 1 < num_w; w += 2) {  // a quarter of the lines along v is enough
            const double* x = entries + (u * num_w + w) * kWide;
            const Wide here = load_wide(x);
            steps[0] += size(load_wide(x + num_w * kWide) - here);
            steps[1] += size(shifted_down(here) - here);
            steps[2] += size(load_wide(x + kWide) - here);
          }
        for (int d = 0; d < 3; ++d)
          variation[d] += sum_of_lanes(steps[d]) / samples * (q1(box, d) - 1) / mean_edges_[column];
      }
  }
  for (int d = 0; d < 3; ++d)
    if (box.levels[d] < LineModels::kMaxLevel &&
        (box.split < 0 || variation[d] * kCost[box.split] > variation[box.split] * kCost[d]))
      box.split = d;
  if (box.split < 0) box.split = 0;  // the deepest box there is
}

std::array<HexBoxes::Box, 2> HexBoxes::children(const Box& box, double lowest) const {
  constexpr double kShare = 0.1, kGood = 0.3, kLeast = 1e-9;
  std::array<Box, 2> result;
  for (int half = 0; half < 2; ++half) {
    Box& child = result[half];
    child = box;
    ++child.level;
    ++child.levels[box.split];
    child.index[box.split] = 2 * box.index[box.split] + half;
    if (lowest != -std::numeric_limits<double>::infinity())
      child.wanted = std::max(kShare * std::min(lowest / mean_edges_.prod(), kGood), kLeast);
  }
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
  return current_.levels[d] == box.levels[d] && current_.index[d] == box.index[d] && current_.tiers[d] == box.tiers[d];
}

const ControlMatrices& HexBoxes::matrices(const Box& box) {
  if (contracted_ > 0 && !shares(box, 2)) contracted_ = 0;
  if (contracted_ > 1 && !shares(box, 1)) contracted_ = 1;
  if (contracted_ > 2 && !shares(box, 0)) contracted_ = 2;
  if (contracted_ < 1) contract_w(box);
  if (contracted_ < 2) contract_v(box);
  if (contracted_ < 3) {
    contract_u(box);
    differences(box);
  }
  contracted_ = 3;
  current_ = box;
  return matrices_;
}

void HexBoxes::contract_w(const Box& box) {
  const LineModels& line = models(box, 2);
  const double* table = line.coefficients(line.level(box.levels[2]), box.index[2]);
  const int face = n_ * n_;
  const Contraction contract = contraction(q1(box, 2));
  for (int d = 0; d < 3; ++d)  // runs over the end of face
    contract(table, modes_[d].data(), face, used_.data(), face, after_w_[d].data(), row_);
}

void HexBoxes::contract_v(const Box& box) {
  const LineModels& line = models(box, 1);
  const double* table = line.coefficients(line.level(box.levels[1]), box.index[1]);
  const int num_w = q1(box, 2);
  for (int d = 0; d < 3; ++d)
    for (int w = 0; w < num_w; ++w) {
      const double* in = after_w_[d].data() + w * row_;
      for (int i = 0; i < n_; i += kSome) {  // runs over the end: what comes from there is written over, or not used
        Wide sums[kSome] = {};
        for (int j = 0; j < n_; ++j) {
          const Wide x = load_wide(table + j * LineModels::kStride);
          for (int s = 0; s < kSome; ++s) sums[s] += in[j * n_ + i + s] * x;
        }
        for (int s = 0; s < kSome; ++s) after_v_[d][(i + s) * num_w + w] = sums[s];
      }
    }
}

void HexBoxes::contract_u(const Box& box) {
  const LineModels& line = models(box, 0);
  const double* table = line.coefficients(line.level(box.levels[0]), box.index[0]);
  const int num_w = q1(box, 2), row = num_w * kWide;
  const Contraction contract = contraction(q1(box, 0));
  for (int d = 0; d < 3; ++d) {
    const double* in = reinterpret_cast<const double*>(after_v_[d].data());
    double* out = reinterpret_cast<double*>(control_[d].data() + num_w);
    contract(table, in, row, all_used_.data(), row, out, row);
  }
}

/// J_b = (o (X_b - X_below) + (q - o) (X_above - X_b)) / h per direction: differences, raised to degree q again.
void HexBoxes::differences(const Box& box) {
  constexpr Wide kPlace{0, 1, 2, 3, 4, 5, 6, 7};
  const int num_w = q1(box, 2), num_u = q1(box, 0);
  Vec3 per_side;
  for (int d = 0; d < 3; ++d) per_side[d] = std::ldexp(1.0, box.levels[d]);
  const Wide low_v = per_side[1] * kPlace, high_v = per_side[1] * (kWide - 1 - kPlace), own_v = low_v - high_v;
  matrices_.resize(num_controls(box));
  for (int row = 0; row < 3; ++row) {
    const Wide* x = control_[row].data() + num_w;
    double *by_u = matrices_.entries(row, 0), *by_v = matrices_.entries(row, 1), *by_w = matrices_.entries(row, 2);
    for (int u = 0; u < num_u; ++u) {
      const double low_u = per_side[0] * u, high_u = per_side[0] * (num_u - 1 - u), own_u = low_u - high_u;
      for (int w = 0; w < num_w; ++w) {
        const int at = u * num_w + w;
        const double low_w = per_side[2] * w, high_w = per_side[2] * (num_w - 1 - w), own_w = low_w - high_w;
        const Wide here = x[at];
        store_wide(own_u * here - low_u * x[at - num_w] + high_u * x[at + num_w], by_u + at * kWide);
        store_wide(own_v * here - low_v * shifted_up(here) + high_v * shifted_down(here), by_v + at * kWide);
        store_wide(own_w * here - low_w * x[at - 1] + high_w * x[at + 1], by_w + at * kWide);
      }
    }
  }
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
  // Three contractions of n_ terms, tables good to 4 roundings each, the shift, differences, and the 16 asked for.
  const double roundings = 3 * (n_ + 4) + 1 + 8 + 16;
  for (int d = 0; d < 3; ++d)
    result.col(d) += 2 * (q1(box, d) - 1) * std::ldexp(1.0, box.levels[d]) * roundings *
                     (std::numeric_limits<double>::epsilon() / 2) * inflation * total_;
  return (1 + 1e-10) * result;
}

}  // namespace subvol
