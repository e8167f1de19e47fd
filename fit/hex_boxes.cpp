// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/hex_boxes.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace subvol {

namespace {

/// out[o][m] = sum_k table[k][o] in[k][m], m < row. Runs over the end of rows by up to kWide - 1 entries.
void contract_rows(const double* in, int n, int row, const double* table, int num_out, double* out) {
  for (int o = 0; o < num_out; ++o)
    for (int m = 0; m < row; m += kWide) {
      Wide sum{};
      for (int k = 0; k < n; ++k) sum += table[k * LineModels::kStride + o] * load_wide(in + k * row + m);
      store_wide(sum, out + o * row + m);
    }
}

int power(int base, int exponent) {
  int result = 1;
  while (exponent-- > 0) result *= base;
  return result;
}

}  // namespace

HexBoxes::HexBoxes(Basis basis, int order)
    : models_(LineModels::get(basis, order)), n_(order + 1), q1_(models_.degree() + 1) {
  const int q = q1_ - 1, controls = power(q1_, 3);
  for (int d = 0; d < 3; ++d) {
    modes_[d].assign(power(n_, 3) + kWide, 0);
    absolute_[d] = modes_[d];
    after_w_[d].assign(q1_ * n_ * n_ + kWide, 0);
    after_v_[d].assign(n_ * q1_ * q1_ + kWide, 0);
    control_[d].assign(controls + 2 * q1_ * q1_ + kWide, 0);
    below_[d].assign(controls + kWide, 0);
    above_[d] = below_[d];
  }
  const int strides[3] = {q1_ * q1_, 1, q1_};
  for (int d = 0; d < 3; ++d)
    for (int b = 0; b < controls; ++b) {
      below_[d][b] = b / strides[d] % q1_;
      above_[d][b] = q - below_[d][b];
    }
  matrices_.resize(controls);
}

void HexBoxes::set_cell(std::span<const LocalMode> modes, std::span<const Vec3> coefficients) {
  for (int d = 0; d < 3; ++d) std::fill_n(modes_[d].begin(), power(n_, 3), 0.0);
  for (std::size_t a = 0; a < modes.size(); ++a) {
    const int at = (modes[a].k * n_ + modes[a].j) * n_ + modes[a].i;
    for (int d = 0; d < 3; ++d) modes_[d][at] = coefficients[a][d];
  }
  for (int d = 0; d < 3; ++d)
    std::transform(modes_[d].begin(), modes_[d].end(), absolute_[d].begin(), [](double x) { return std::abs(x); });
  contracted_ = 0;
  has_remainder_.fill(false);

  Mat3 edges = Mat3::Zero();
  for (int corner = 0; corner < 8; ++corner)
    for (int row = 0; row < 3; ++row)
      for (int d = 0; d < 3; ++d) {
        const double x = modes_[row][((corner >> 2) * n_ + (corner >> 1 & 1)) * n_ + (corner & 1)];
        edges(row, d) += corner >> d & 1 ? x : -x;
      }
  mean_edges_ = 0.25 * edges.colwise().norm().transpose();
}

bool HexBoxes::is_hopeless(const Box& box) {
  // The shifts of `determinant_bound` sum up to at least this, if the mean edges tell the mean matrix; each must be
  // < 1.
  return !models_.level(box.level).exact &&
         remainder(box).colwise().sum().cwiseQuotient(mean_edges_.transpose()).sum() > 2;
}

std::array<HexBoxes::Box, HexBoxes::kNumChildren> HexBoxes::children(const Box& box, double) {
  std::array<Box, kNumChildren> result;
  for (int c = 0; c < kNumChildren; ++c)
    result[c] = {box.level + 1, {2 * box.index[0] + c % 2, 2 * box.index[1] + c / 2 % 2, 2 * box.index[2] + c / 4}};
  return result;
}

Vec3 HexBoxes::corner_point(const Box& box, int corner) {
  const double size = std::ldexp(1.0, -box.level);
  return size * Vec3(box.index[0] + corner % 2, box.index[1] + corner / 2 % 2, box.index[2] + corner / 4);
}

std::size_t HexBoxes::corner_matrix(const Box&, int corner) const {
  return static_cast<std::size_t>((q1_ - 1) * ((corner % 2 * q1_ + corner / 4) * q1_ + corner / 2 % 2));
}

const ControlMatrices& HexBoxes::matrices(const Box& box) {
  if (contracted_ == 0 || current_.level != box.level || current_.index[2] != box.index[2]) {
    contract_w(box.level, box.index[2]);
    contracted_ = 1;
  }
  if (contracted_ == 1 || current_.index[1] != box.index[1]) {
    contract_v(box.level, box.index[1]);
    contracted_ = 2;
  }
  if (contracted_ == 2 || current_.index[0] != box.index[0]) {
    contract_u(box.level, box.index[0]);
    contracted_ = 3;
    differences(box.level);
  }
  current_ = box;
  return matrices_;
}

void HexBoxes::contract_w(int level, int index) {
  const double* table = models_.coefficients(models_.level(level), index);
  for (int d = 0; d < 3; ++d) contract_rows(modes_[d].data(), n_, n_ * n_, table, q1_, after_w_[d].data());
}

void HexBoxes::contract_v(int level, int index) {
  const double* table = models_.coefficients(models_.level(level), index);
  for (int d = 0; d < 3; ++d)
    for (int i = 0; i < n_; ++i)
      for (int w = 0; w < q1_; ++w) {
        const double* in = after_w_[d].data() + w * n_ * n_ + i;
        double* out = after_v_[d].data() + (i * q1_ + w) * q1_;
        for (int v = 0; v < q1_; v += kWide) {
          Wide sum{};
          for (int j = 0; j < n_; ++j) sum += in[j * n_] * load_wide(table + j * LineModels::kStride + v);
          store_wide(sum, out + v);
        }
      }
}

void HexBoxes::contract_u(int level, int index) {
  const double* table = models_.coefficients(models_.level(level), index);
  const int margin = q1_ * q1_;
  for (int d = 0; d < 3; ++d)
    contract_rows(after_v_[d].data(), n_, margin, table, q1_, control_[d].data() + margin);
}

/// J_b = (o (X_b - X_below) + (q - o) (X_above - X_b)) / h per direction: differences, raised to degree q again.
void HexBoxes::differences(int level) {
  const int margin = q1_ * q1_, controls = margin * q1_, strides[3] = {margin, 1, q1_};
  const double per_side = std::ldexp(1.0, level);
  for (int row = 0; row < 3; ++row) {
    const double* x = control_[row].data() + margin;
    for (int d = 0; d < 3; ++d) {
      const int stride = strides[d];
      double* out = matrices_.entries(row, d);
      for (int b = 0; b < controls; b += kWide) {
        const Wide here = load_wide(x + b), before = load_wide(x + b - stride), after = load_wide(x + b + stride);
        const Wide low = load_wide(below_[d].data() + b), high = load_wide(above_[d].data() + b);
        store_wide(per_side * (low * (here - before) + high * (after - here)), out + b);
      }
    }
  }
}

const Mat3& HexBoxes::remainder(const Box& box) {
  if (!has_remainder_[box.level]) {
    remainders_[box.level] = make_remainder(box.level);
    has_remainder_[box.level] = true;
  }
  return remainders_[box.level];
}

/// With P the models: N_i' N_j N_k - P_i' P_j P_k = (N_i' - P_i') N_j N_k + P_i' ((N_j - P_j) N_k + P_j (N_k - P_k)).
Mat3 HexBoxes::make_remainder(int l) const {
  const LineModels::Level& level = models_.level(l);
  const auto &largest = level.largest_coefficient, &bound = models_.bounds(), &error = level.error,
             &slope_error = level.slope_error;
  LineModels::PerFunction model_bound, model_slope;
  for (int i = 0; i < n_; ++i) {
    model_bound[i] = bound[i] + error[i];
    model_slope[i] = models_.slope_bounds()[i] + slope_error[i];
  }
  Mat3 result = Mat3::Zero();
  std::array<std::vector<double>, 4> sums;  // over k of |a_ijk| times bound, error, slope error, model slope
  for (int row = 0; row < 3; ++row) {
    const double* a = absolute_[row].data();
    double size = 0;  // bounds the model's coefficients, before and after all roundings
    for (int k = 0; k < n_; ++k)
      for (int j = 0; j < n_; ++j) {
        double sum = 0;
        for (int i = 0; i < n_; ++i) sum += *a++ * largest[i];
        size += sum * largest[j] * largest[k];
      }
    // Three contractions of n_ terms, tables good to 4 roundings each, the shift, differences, and the 16 asked for.
    const double roundings = 3 * (n_ + 4) + 1 + 8 + 16;
    const double rounding =
        2 * (q1_ - 1) * std::ldexp(1.0, l) * roundings * (std::numeric_limits<double>::epsilon() / 2) * size;
    result.row(row).setConstant(rounding);
    if (level.exact) continue;

    const int face = n_ * n_;
    const LineModels::PerFunction* weights[4] = {&bound, &error, &slope_error, &model_slope};
    for (int s = 0; s < 4; ++s) {
      sums[s].assign(face, 0);
      for (int k = 0; k < n_; ++k)
        for (int m = 0; m < face; ++m) sums[s][m] += absolute_[row][k * face + m] * (*weights[s])[k];
    }
    for (int j = 0; j < n_; ++j)
      for (int i = 0; i < n_; ++i) {
        const double by_bound = sums[0][j * n_ + i], by_error = sums[1][j * n_ + i];
        const double by_slope_error = sums[2][j * n_ + i], by_slope = sums[3][j * n_ + i];
        result(row, 0) += slope_error[i] * bound[j] * by_bound +
                          model_slope[i] * (error[j] * by_bound + model_bound[j] * by_error);
        result(row, 1) += slope_error[j] * bound[i] * by_bound +
                          model_slope[j] * (error[i] * by_bound + model_bound[i] * by_error);
        result(row, 2) += by_slope_error * bound[i] * bound[j] +
                          by_slope * (error[i] * bound[j] + model_bound[i] * error[j]);
      }
  }
  return (1 + 1e-10) * result;
}

}  // namespace subvol
