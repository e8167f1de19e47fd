// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/certificate/hex_contraction.h"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <limits>
#include <type_traits>

namespace subvol::internal {

namespace {

/// Number of columns contracted at a time if lanes run along the result's direction.
constexpr int kColumnsAtOnce = 5;

/// Degrees of the models along u and w, ascending: those that take the least time (measured).
std::vector<int> model_degrees(Basis basis, int order) {
  if (order == 1 || (basis == Basis::legendre && order < kWide)) return {order};
  return {5, basis == Basis::legendre ? 6 : kWide - 1};
}

/// Content of the tables, for each function of a direction, kStride apart: either the coefficients of all outputs, with
/// a weight of 1 for the function 1, which has no coefficients of its own; or the deviations, with a weight of 0 for
/// it, and the middles as the last output, with a weight of 1 for it.
enum class Of { values, deviations };

/// Lines of numbers, each `stride` after the one before. In every group of kRow numbers, lines from `used` on are 0.
template <class Number>
struct Lines {
  const Number* begin;
  int stride, length;
  const int* used;
};

/// out[o out_stride + m] = more[o] + c in[0][m] + sum_{k > 0} table[k][o] in[k][m], o < num_out, for all m < length,
/// and for some beyond it, up to whole vectors; c is the weight of the function 1 (`Of`). by_size: uses |in|.
template <int num_out, Of of, bool by_size, class Number>
void contract_to(const Number* table, const Lines<Number>& in, const Number* more, Number* out, int out_stride) {
  const auto contract = [&]<class Vector>(int m, const Vector&) {
    const auto line = [&](int k) {
      const Vector x = load<Vector>(in.begin + k * in.stride + m);
      return by_size ? size_of(x) : x;
    };
    Vector sums[num_out] = {};
    const Vector first = line(0);
    std::fill(of == Of::values ? sums : sums + num_out - 1, sums + num_out, first);
    const int end = in.used[m / HexContraction::kRow];
    for (int k = 1; k < end; ++k) {
      const Vector x = line(k);
      for (int o = 0; o < num_out; ++o) sums[o] += table[k * LineModels::kStride + o] * x;
    }
    for (int o = 0; o < num_out; ++o) {
      sums[o] += more[o];
      std::memcpy(out + o * out_stride + m, &sums[o], sizeof(Vector));
    }
  };
  int m = 0;
  if constexpr (std::is_same_v<Number, float>) {
    for (; m + kWideFloats <= in.length; m += kWideFloats) contract(m, WideFloats{});
    for (; m < in.length; m += kWide) contract(m, Narrow{});
  } else {
    for (; m < in.length; m += kWide) contract(m, Wide{});
  }
}

/// Calls `contract_to` for a number of outputs known at run time, the deviations' middle included.
template <Of of, class Number>
void contract(int num_out, const Number* table, const Lines<Number>& in, const Number* more, Number* out,
              int out_stride) {
  using Contract = void (*)(const Number*, const Lines<Number>&, const Number*, Number*, int);
  static constexpr Contract kContractionsByCount[] = {nullptr,
                                                      contract_to<1, of, false, Number>,
                                                      contract_to<2, of, false, Number>,
                                                      contract_to<3, of, false, Number>,
                                                      contract_to<4, of, false, Number>,
                                                      contract_to<5, of, false, Number>,
                                                      contract_to<6, of, false, Number>,
                                                      contract_to<7, of, false, Number>,
                                                      contract_to<8, of, false, Number>,
                                                      contract_to<9, of, false, Number>};
  kContractionsByCount[num_out](table, in, more, out, out_stride);
}

/// out[i out_stride], lane p, = more[i] + c in[0][i] + sum_{0 < j < n} table[j][p] in[j][i], for i < n; c is the weight
/// of the function 1 (`Of`). Reads up to kColumnsAtOnce numbers, and writes as many vectors, beyond the end.
template <Of of, class Vector>
void contract_to_lanes(const NumberOf<Vector>* table, const NumberOf<Vector>* in, int n, const Vector* more,
                       Vector* out, int out_stride) {
  for (int i = 0; i < n; i += kColumnsAtOnce) {
    Vector sums[kColumnsAtOnce] = {};
    if (of == Of::values)
      for (int s = 0; s < kColumnsAtOnce; ++s) sums[s] += in[i + s];
    for (int j = 1; j < n; ++j) {
      const Vector x = load<Vector>(table + j * LineModels::kStride);
      for (int s = 0; s < kColumnsAtOnce; ++s) sums[s] += in[j * n + i + s] * x;
    }
    for (int s = 0; s < kColumnsAtOnce; ++s) out[(i + s) * out_stride] = sums[s] + more[i + s];
  }
}

constexpr double kNoMore[LineModels::kMostModelDegree + 2] = {};
constexpr float kNoNarrowMore[LineModels::kMostModelDegree + 2] = {};

}  // namespace

void HexContraction::Contracted::keep(const HexPart& wanted) {
  const auto is_same = [&](int d) {
    return part.levels[d] == wanted.levels[d] && part.index[d] == wanted.index[d] && part.tiers[d] == wanted.tiers[d];
  };
  directions = directions > 0 && is_same(2) ? (directions > 1 && is_same(1) ? 2 : 1) : 0;
  part = wanted;
}

HexContraction::HexContraction(Basis basis, int order)
    : n_(order + 1),
      face_(n_ * n_),
      lanes_((n_ + kWide - 1) / kWide * kWide),
      row_((3 * face_ + kRow - 1) / kRow * kRow) {
  for (const int degree : model_degrees(basis, order)) tiers_[0].push_back(&LineModels::get(basis, order, degree));
  tiers_[1] = {&LineModels::get(basis, order, kWide - 1)};
  tiers_[2] = tiers_[0];
  bounds_ = tiers_[1][0]->bounds();
  lane_bounds_.assign(lanes_, 0);
  std::copy_n(bounds_.begin(), n_, lane_bounds_.begin());

  // With room for what is read or written beyond the end.
  const std::size_t most = tiers_[0].back()->degree() + 1, row = row_ + kRow, lines = n_ + kColumnsAtOnce;
  modes_.assign(n_ * row, 0);
  after_w_.assign(most * row, 0);
  narrow_modes_.assign(n_ * row, 0);
  narrow_w_.assign((most + 1) * row, 0);
  sizes_w_.assign(2 * row, 0);
  for (AlignedFloats* numbers : {&middles_v_, &middle_sizes_v_, &sizes_v_}) numbers->assign(3 * lanes_, 0);
  for (int d = 0; d < 3; ++d) {
    after_v_[d].assign(lines * most, Wide{});
    narrow_v_[d].assign(lines * most, Narrow{});
  }
  no_more_.assign(lines, Wide{});
  no_narrow_more_.assign(lines, Narrow{});
  more_.assign(lines, Narrow{});
  used_.resize(row_ / kRow);
  all_used_.assign(kWide, n_);
}

void HexContraction::set_modes(std::span<const LocalMode> modes) {
  of_modes_ = modes.data();
  num_modes_ = modes.size();
  std::fill(used_.begin(), used_.end(), 0);
  places_.clear();
  for (const LocalMode& mode : modes) {
    places_.push_back(mode.k * row_ + mode.j * n_ + mode.i);
    const int last_i = std::max<int>(mode.i, 1), last_j = std::max<int>(mode.j, 1), last_k = std::max<int>(mode.k, 1);
    for (int d = 0; d < 3; ++d)
      for (int j = mode.j; j <= last_j; ++j)  // also where take_steps writes
        for (int i = mode.i; i <= last_i; ++i) {
          int& used = used_[(d * face_ + j * n_ + i) / kRow];
          used = std::max(used, last_k + 1);
        }
  }
}

void HexContraction::set_cell(std::span<const LocalMode> modes, std::span<const Vec3> coefficients) {
  if (modes.data() != of_modes_ || modes.size() != num_modes_) set_modes(modes);
  std::fill(modes_.begin(), modes_.end(), 0.0);
  for (std::size_t a = 0; a < modes.size(); ++a)
    for (int d = 0; d < 3; ++d) modes_[d * face_ + places_[a]] = coefficients[a][d];
  contracted_.directions = narrow_contracted_.directions = 0;
  has_narrow_modes_ = has_steps_ = false;
}

void HexContraction::take_steps() {
  assert(!has_steps_);
  has_steps_ = true;
  double* x = modes_.data();
  for (int m = 0; m < 3 * face_; ++m) x[row_ + m] -= x[m];
  for (int k = 0; k < n_; ++k)
    for (int d = 0; d < 3; ++d) {
      x = modes_.data() + k * row_ + d * face_;
      for (int i = 0; i < n_; ++i) x[n_ + i] -= x[i];
      for (int j = 0; j < n_; ++j) x[j * n_ + 1] -= x[j * n_];
    }
  for (int d = 0; d < 3; ++d) {
    Wide total{};
    for (int k = 0; k < n_; ++k)
      for (int j = 0; j < n_; ++j) {
        const double* line = modes(d) + k * row_ + j * n_;
        Wide sum{};
        for (int i = 0; i < lanes_; i += kWide)
          sum += load_wide(lane_bounds_.data() + i) * size_of(load_wide(line + i));
        total += bounds_[k] * bounds_[j] * sum;
      }
    total_[d] = sum_of_lanes(total);
  }
}

void HexContraction::contract(const HexPart& part, HexCoefficients& result) {
  assert(has_steps_);
  contracted_.keep(part);
  if (contracted_.directions < 1) contract_w(part);
  if (contracted_.directions < 2) contract_v(part);
  contracted_.directions = 2;

  const LineModels& line = models(part, 0);
  const double* table = line.coefficients(line.level(part.levels[0]), part.index[0]);
  const int num_u = line.degree() + 1, num_w = models(part, 2).degree() + 1, row = num_w * kWide;
  result.resize(num_u, num_w);
  for (int d = 0; d < 3; ++d) {
    const Lines<double> in{reinterpret_cast<const double*>(after_v_[d].data()), row, row, all_used_.data()};
    internal::contract<Of::values>(num_u, table, in, kNoMore, reinterpret_cast<double*>(result.coordinate(d)), row);
  }
}

void HexContraction::contract_w(const HexPart& part) {
  const LineModels& line = models(part, 2);
  const Lines<double> in{modes_.data(), row_, 3 * face_, used_.data()};
  internal::contract<Of::values>(line.degree() + 1, line.coefficients(line.level(part.levels[2]), part.index[2]), in,
                                 kNoMore, after_w_.data(), row_);
}

void HexContraction::contract_v(const HexPart& part) {
  const LineModels& line = models(part, 1);
  const double* table = line.coefficients(line.level(part.levels[1]), part.index[1]);
  const int num_w = models(part, 2).degree() + 1;
  for (int d = 0; d < 3; ++d)
    for (int w = 0; w < num_w; ++w)
      contract_to_lanes<Of::values>(table, after_w_.data() + w * row_ + d * face_, n_, no_more_.data(),
                                    after_v_[d].data() + w, num_w);
}

void HexContraction::contract(const HexPart& part, NarrowHexCoefficients& result) {
  assert(has_steps_);
  if (!has_narrow_modes_) narrow_modes();
  narrow_contracted_.keep(part);
  if (narrow_contracted_.directions < 1) contract_narrow_w(part);
  if (narrow_contracted_.directions < 2) contract_narrow_v(part);
  narrow_contracted_.directions = 2;

  const LineModels& line = models(part, 0);
  const LineModels::Level& level = line.level(part.levels[0]);
  const float *deviations = line.deviations(level, part.index[0]),
              *coefficients = line.narrow_coefficients(level, part.index[0]), *others = deviations + line.degree() + 1;
  const int num_u = line.degree() + 1, num_w = models(part, 2).degree() + 1, row = num_w * kWide;
  result.resize(num_u, num_w);
  for (int d = 0; d < 3; ++d) {
    Narrow more{};  // lane o: sum_i d_io M'_i
    const float *middles = middles_v_.data() + d * lanes_, *middle_sizes = middle_sizes_v_.data() + d * lanes_,
                *sizes = sizes_v_.data() + d * lanes_;
    double size = sizes[0];
    for (int i = 1; i < n_; ++i) {
      const int at = i * LineModels::kStride;
      more += middles[i] * load<Narrow>(deviations + at);
      size +=
          others[at + LineModels::kLargestDeviation] * middle_sizes[i] + others[at + LineModels::kLargest] * sizes[i];
    }
    const Lines<float> in{numbers(narrow_v_[d].data()), row, row, all_used_.data()};
    internal::contract<Of::values>(num_u, coefficients, in, numbers(&more), numbers(result.coordinate(d)), row);

    // The two factors of each product, the product and the sums are rounded: n + 2 roundings per direction. 1e-5 covers
    // the roundings of these bounds themselves and products of roundings, about 100; 1e-33 covers underflow of up to
    // 17^3 terms with coefficients up to 60.
    result.precision.sizes[d] = (1 + 1e-5) * size;
    result.precision.errors[d] = 3 * (n_ + 2) * kNarrowRoundoff * result.precision.sizes[d] + 1e-33;
  }
}

void HexContraction::narrow_modes() {
  has_narrow_modes_ = true;
  for (int m = 0; m < n_ * row_; m += kWide) store_wide(narrow(load_wide(modes_.data() + m)), narrow_modes_.data() + m);
}

void HexContraction::contract_narrow_w(const HexPart& part) {
  const LineModels& line = models(part, 2);
  const float* deviations = line.deviations(line.level(part.levels[2]), part.index[2]);
  const int num_w = line.degree() + 1;
  const Lines<float> in{narrow_modes_.data(), row_, 3 * face_, used_.data()};
  internal::contract<Of::deviations>(num_w + 1, deviations, in, kNoNarrowMore, narrow_w_.data(), row_);
  contract_to<2, Of::deviations, true>(deviations + num_w + LineModels::kLargestDeviation, in, kNoNarrowMore,
                                       sizes_w_.data(), row_);
}

void HexContraction::contract_narrow_v(const HexPart& part) {
  const LineModels& line = models(part, 1);
  const LineModels::Level& level = line.level(part.levels[1]);
  const float *deviations = line.deviations(level, part.index[1]), *others = deviations + kWide,
              *coefficients = line.narrow_coefficients(level, part.index[1]);
  const int num_w = models(part, 2).degree() + 1;
  for (int d = 0; d < 3; ++d) {
    const float* middles = narrow_w_.data() + num_w * row_ + d * face_;
    contract_to_lanes<Of::deviations>(deviations, middles, n_, no_narrow_more_.data(), more_.data(), 1);
    for (int w = 0; w < num_w; ++w)
      contract_to_lanes<Of::values>(coefficients, narrow_w_.data() + w * row_ + d * face_, n_, more_.data(),
                                    narrow_v_[d].data() + w, num_w);
    for (int i = 0; i < n_; i += kWide) {
      const float *sizes_w = sizes_w_.data() + d * face_ + i, *middle_sizes_w = sizes_w + row_;
      Narrow middle = load<Narrow>(middles + i), middle_size = load<Narrow>(middle_sizes_w),
             sizes = load<Narrow>(sizes_w);
      for (int j = 1; j < n_; ++j) {
        const float* other = others + j * LineModels::kStride;
        const Narrow s = load<Narrow>(middle_sizes_w + j * n_);
        middle += other[LineModels::kMiddle] * load<Narrow>(middles + j * n_ + i);
        middle_size += other[LineModels::kMiddleSize] * s;
        sizes +=
            other[LineModels::kLargestDeviation] * s + other[LineModels::kLargest] * load<Narrow>(sizes_w + j * n_);
      }
      store_wide(middle, middles_v_.data() + d * lanes_ + i);
      store_wide(middle_size, middle_sizes_v_.data() + d * lanes_ + i);
      store_wide(sizes, sizes_v_.data() + d * lanes_ + i);
    }
  }
}

}  // namespace subvol::internal
