// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/hex_contraction.h"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <limits>
#include <type_traits>

namespace subvol {

namespace {

constexpr double kNarrowRoundoff = std::numeric_limits<float>::epsilon() / 2;

/// Columns that are contracted at a time where lanes are of the result's direction.
constexpr int kSome = 5;

/// Of the functions along u and w, ascending: those that take the least time (measured).
std::vector<int> model_degrees(Basis basis, int order) {
  if (order == 1 || (basis == Basis::legendre && order < kWide)) return {order};
  return {5, basis == Basis::legendre ? 6 : kWide - 1};
}

/// Of one direction: coefficients of its functions, `stride` apart, and what 1 counts, which has none: 1, or 0 where
/// they are deviations.
template <class Number>
struct Table {
  const Number* coefficients;
  Number one;
  int stride = LineModels::kStride;
};

/// Lines of numbers, each `stride` after the one before; of every kRow numbers, those lines are 0 from `used` on.
template <class Number>
struct Lines {
  const Number* begin;
  int stride, length;
  const int* used;
};

/// out[o out_stride + m] = more[o] + one in[0][m] + sum_{k > 0} table[k][o] in[k][m], o < num_out, for all m < length,
/// and some behind them, to whole vectors.
template <int num_out, class Number>
void contract_to(const Table<Number>& table, const Lines<Number>& in, const Number* more, Number* out,
                 int out_stride) {
  const auto contract = [&]<class Vector>(int m, const Vector&) {
    const Vector first = table.one * load<Vector>(in.begin + m);
    Vector sums[num_out];
    std::fill_n(sums, num_out, first);
    const int end = in.used[m / HexContraction::kRow];
    for (int k = 1; k < end; ++k) {
      const Vector x = load<Vector>(in.begin + k * in.stride + m);
      for (int o = 0; o < num_out; ++o) sums[o] += table.coefficients[k * table.stride + o] * x;
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

template <class Number>
void contract(int num_out, const Table<Number>& table, const Lines<Number>& in, const Number* more, Number* out,
              int out_stride) {
  using Contract = void (*)(const Table<Number>&, const Lines<Number>&, const Number*, Number*, int);
  static constexpr Contract kAll[] = {nullptr,
                                      contract_to<1, Number>,
                                      contract_to<2, Number>,
                                      contract_to<3, Number>,
                                      contract_to<4, Number>,
                                      contract_to<5, Number>,
                                      contract_to<6, Number>,
                                      contract_to<7, Number>,
                                      contract_to<8, Number>};
  kAll[num_out](table, in, more, out, out_stride);
}

/// out[i out_stride], lane p, = more[i] + one in[0][i] + sum_{0 < j < n} table[j][p] in[j][i], for i < n. Runs over
/// the end: reads kSome numbers, and writes as many vectors, behind it.
template <class Vector>
void contract_to_lanes(const Table<NumberOf<Vector>>& table, const NumberOf<Vector>* in, int n, const Vector* more,
                       Vector* out, int out_stride) {
  for (int i = 0; i < n; i += kSome) {
    Vector sums[kSome];
    for (int s = 0; s < kSome; ++s) sums[s] = Vector{} + table.one * in[i + s];
    for (int j = 1; j < n; ++j) {
      const Vector x = load<Vector>(table.coefficients + j * table.stride);
      for (int s = 0; s < kSome; ++s) sums[s] += in[j * n + i + s] * x;
    }
    for (int s = 0; s < kSome; ++s) out[(i + s) * out_stride] = sums[s] + more[i + s];
  }
}

constexpr double kNoMore[LineModels::kMaxDegree + 1] = {};
constexpr float kNoNarrowMore[LineModels::kMaxDegree + 1] = {};

}  // namespace

void HexContraction::Contracted::keep(const HexPart& wanted) {
  const auto is_same = [&](int d) {
    return part.levels[d] == wanted.levels[d] && part.index[d] == wanted.index[d] && part.tiers[d] == wanted.tiers[d];
  };
  directions = directions > 0 && is_same(2) ? (directions > 1 && is_same(1) ? 2 : 1) : 0;
  part = wanted;
}

HexContraction::HexContraction(Basis basis, int order)
    : n_(order + 1), face_(n_ * n_), lanes_((n_ + kWide - 1) / kWide * kWide),
      row_((3 * face_ + kRow - 1) / kRow * kRow) {
  for (const int degree : model_degrees(basis, order)) tiers_[0].push_back(&LineModels::get(basis, order, degree));
  tiers_[1] = {&LineModels::get(basis, order, kWide - 1)};
  tiers_[2] = tiers_[0];
  bounds_ = tiers_[1][0]->bounds();
  lane_bounds_.assign(lanes_, 0);
  std::copy_n(bounds_.begin(), n_, lane_bounds_.begin());

  // With room for what is read, or written, behind the end.
  const std::size_t most = tiers_[0].back()->degree() + 1, rows = row_ + kRow, lines = n_ + kSome;
  for (AlignedDoubles* numbers : {&modes_, &after_w_}) numbers->assign((std::max<std::size_t>(n_, most) + 1) * rows, 0);
  for (AlignedFloats* numbers : {&narrow_modes_, &mode_sizes_, &narrow_w_})
    numbers->assign((std::max<std::size_t>(n_, most) + 1) * rows, 0);
  middles_w_.assign(rows, 0);
  narrow_middles_w_.assign(rows, 0);
  sizes_w_.assign(rows, 0);
  for (AlignedFloats* numbers : {&narrow_middles_v_, &sizes_v_, &sizes_of_w_}) numbers->assign(3 * lanes_, 0);
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
      for (int j = mode.j; j <= last_j; ++j)  // and where its steps go
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
  const int num_u = line.degree() + 1, num_w = models(part, 2).degree() + 1, row = num_w * kWide;
  result.resize(num_u, num_w);
  for (int d = 0; d < 3; ++d) {
    const double* in = reinterpret_cast<const double*>(after_v_[d].data());
    double* out = reinterpret_cast<double*>(result.coordinate(d));
    subvol::contract<double>(num_u, {line.coefficients(line.level(part.levels[0]), part.index[0]), 1},
                             {in, row, row, all_used_.data()}, kNoMore, out, row);
  }
}

void HexContraction::contract_w(const HexPart& part) {
  const LineModels& line = models(part, 2);
  subvol::contract<double>(line.degree() + 1, {line.coefficients(line.level(part.levels[2]), part.index[2]), 1},
                           {modes_.data(), row_, 3 * face_, used_.data()}, kNoMore, after_w_.data(), row_);
}

void HexContraction::contract_v(const HexPart& part) {
  const LineModels& line = models(part, 1);
  const Table<double> table{line.coefficients(line.level(part.levels[1]), part.index[1]), 1};
  const int num_w = models(part, 2).degree() + 1;
  for (int d = 0; d < 3; ++d)
    for (int w = 0; w < num_w; ++w)
      contract_to_lanes<Wide>(table, after_w_.data() + w * row_ + d * face_, n_, no_more_.data(),
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
  const float* deviations = line.deviations(level, part.index[0]);
  const int num_u = line.degree() + 1, num_w = models(part, 2).degree() + 1, row = num_w * kWide;
  result.resize(num_u, num_w);
  for (int d = 0; d < 3; ++d) {
    Narrow more{};  // lane o: sum_i d_io M'_i
    for (int i = 1; i < n_; ++i)
      more += narrow_middles_v_[d * lanes_ + i] * load<Narrow>(deviations + i * LineModels::kStride);
    subvol::contract<float>(num_u, {line.narrow_coefficients(level, part.index[0]), 1},
                            {numbers(narrow_v_[d].data()), row, row, all_used_.data()},
                            numbers(&more), numbers(result.coordinate(d)), row);
  }
  result.precision = precision(level);
}

/// By the direction whose deviations terms have: what they sum up to at the most. Rounded are their factors, products
/// and sums: n + 2 times along each direction from that one on. In 1e-5 are the roundings of these bounds themselves,
/// and products of roundings: about 100; in 1e-33 is underflow, of up to 17^3 terms with coefficients up to 60.
NarrowHexCoefficients::Precision HexContraction::precision(const LineModels::Level& along_u) const {
  constexpr double kUp = 1 + 1e-5;
  NarrowHexCoefficients::Precision result;
  for (int d = 0; d < 3; ++d) {
    Narrow all{}, rounded{};
    for (int i = 0; i < lanes_; i += kWide) {
      const auto at = [&](const AlignedFloats& numbers) { return load<Narrow>(numbers.data() + d * lanes_ + i); };
      const Narrow largest = load<Narrow>(along_u.largest_narrow.data() + i);
      const Narrow by_u = load<Narrow>(along_u.largest_deviation.data() + i) * size_of(at(narrow_middles_v_)),
                   by_v = largest * at(sizes_v_), by_w = largest * at(sizes_of_w_);
      all += by_u + by_v + by_w;
      rounded += by_u + 2 * by_v + 3 * by_w;
    }
    result.sizes[d] = kUp * sum_of_lanes(widen(all));
    result.errors[d] = kUp * (n_ + 2) * kNarrowRoundoff * sum_of_lanes(widen(rounded)) + 1e-33;
  }
  return result;
}

void HexContraction::narrow_modes() {
  has_narrow_modes_ = true;
  for (int m = 0; m < n_ * row_; m += kWide) {
    const Narrow here = narrow(load_wide(modes_.data() + m));
    store_wide(here, narrow_modes_.data() + m);
    store_wide(size_of(here), mode_sizes_.data() + m);
  }
}

void HexContraction::contract_narrow_w(const HexPart& part) {
  const LineModels& line = models(part, 2);
  const LineModels::Level& level = line.level(part.levels[2]);
  const auto lines = [&](const auto& numbers) {
    return Lines<std::remove_cvref_t<decltype(numbers[0])>>{numbers.data(), row_, 3 * face_, used_.data()};
  };
  subvol::contract<double>(1, {line.middles(level, part.index[2]), 1, 1}, lines(modes_), kNoMore, middles_w_.data(), 0);
  for (int m = 0; m < 3 * face_; m += kWide)
    store_wide(narrow(load_wide(middles_w_.data() + m)), narrow_middles_w_.data() + m);
  subvol::contract<float>(line.degree() + 1, {line.deviations(level, part.index[2]), 0}, lines(narrow_modes_),
                          kNoNarrowMore, narrow_w_.data(), row_);
  subvol::contract<float>(1, {level.largest_deviation.data(), 0, 1}, lines(mode_sizes_), kNoNarrowMore,
                          sizes_w_.data(), 0);
}

void HexContraction::contract_narrow_v(const HexPart& part) {
  const LineModels& line = models(part, 1);
  const LineModels::Level& level = line.level(part.levels[1]);
  const Table<float> deviations{line.deviations(level, part.index[1]), 0},
      table{line.narrow_coefficients(level, part.index[1]), 1};
  const double* middles = line.middles(level, part.index[1]);
  const float *largest = level.largest_narrow.data(), *largest_deviation = level.largest_deviation.data();
  const int num_w = models(part, 2).degree() + 1;
  for (int d = 0; d < 3; ++d) {
    contract_to_lanes<Narrow>(deviations, narrow_middles_w_.data() + d * face_, n_, no_narrow_more_.data(),
                              more_.data(), 1);
    for (int w = 0; w < num_w; ++w)
      contract_to_lanes<Narrow>(table, narrow_w_.data() + w * row_ + d * face_, n_, more_.data(),
                                narrow_v_[d].data() + w, num_w);
    for (int i = 0; i < n_; i += kWide) {
      const double* middle = middles_w_.data() + d * face_ + i;
      const float* size_w = sizes_w_.data() + d * face_ + i;
      Wide sum = load_wide(middle);
      Narrow sizes{}, of_w = load<Narrow>(size_w);
      for (int j = 1; j < n_; ++j) {
        const Wide x = load_wide(middle + j * n_);
        sum += middles[j] * x;
        sizes += largest_deviation[j] * size_of(load<Narrow>(narrow_middles_w_.data() + d * face_ + i + j * n_));
        of_w += largest[j] * load<Narrow>(size_w + j * n_);
      }
      store_wide(narrow(sum), narrow_middles_v_.data() + d * lanes_ + i);
      store_wide(sizes, sizes_v_.data() + d * lanes_ + i);
      store_wide(of_w, sizes_of_w_.data() + d * lanes_ + i);
    }
  }
}

}  // namespace subvol
