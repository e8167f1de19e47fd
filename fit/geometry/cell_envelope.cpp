// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/geometry/cell_envelope.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace subvol::internal {

namespace {

constexpr double kAreaTolerance = 1e-14;  // share of the triangle's area

}  // namespace

void CellEnvelope::clear() {
  blocks_.clear();
  ranks_.clear();
}

void CellEnvelope::add(const std::array<Wide, 3>& values, const std::array<std::int32_t, kWide>& ranks) {
  blocks_.push_back(values);
  ranks_.insert(ranks_.end(), ranks.begin(), ranks.end());
}

Barycentric CellEnvelope::values(int function) const {
  const double* first = reinterpret_cast<const double*>(&blocks_[function / kWide]) + function % kWide;
  return {first[0], first[kWide], first[2 * kWide]};
}

Wide CellEnvelope::lowest(const Barycentric& at) const {
  Wide low = Wide{} + kNever;
  for (const Block& block : blocks_) take_lower(low, at[0] * block[0] + at[1] * block[1] + at[2] * block[2]);
  return low;
}

int CellEnvelope::lowest_function(const Barycentric& at, double value) const {
  int best = -1;
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const Block& block = blocks_[b];
    const Wide v = at[0] * block[0] + at[1] * block[1] + at[2] * block[2];
    for (unsigned lanes = lanes_within(v, value); lanes != 0; lanes &= lanes - 1) {
      const int function = static_cast<int>(b) * kWide + std::countr_zero(lanes);
      if (best < 0 || ranks_[function] < ranks_[best]) best = function;
    }
  }
  return best;
}

CellEnvelope::Cut CellEnvelope::cut(int inside, int outside) {
  const Barycentric line = values(inside) - values(outside);
  const int n = polygon_->size;
  double height[kMaxCorners];
  std::uint32_t in = 0, out = 0;
  for (int i = 0; i < n; ++i) {
    height[i] = dot(polygon_->at[i], line);
    in |= static_cast<std::uint32_t>(height[i] < -noise_) << i;
    out |= static_cast<std::uint32_t>(height[i] > noise_) << i;
  }
  if (out == 0) return in == 0 ? Cut::tie : Cut::untouched;
  if (in == 0) return Cut::empty;
  if (n == kMaxCorners) return Cut::tie;
  // The part outside lies between two corners: one run of corners is replaced by the two ends of the bisector.
  const std::uint32_t out_before = out << 1 | out >> (n - 1), all = (1u << n) - 1;
  const std::uint32_t run_begins = out & ~out_before, run_ends = ~out & out_before & all;
  if (!std::has_single_bit(run_begins)) return Cut::tie;
  const int begin = std::countr_zero(run_begins), end = std::countr_zero(run_ends);
  const int before_begin = begin > 0 ? begin - 1 : n - 1, before_end = end > 0 ? end - 1 : n - 1;
  const auto crossing = [&](int i, int j) {
    return between(polygon_->at[i], polygon_->at[j], height[i] / (height[i] - height[j]));
  };
  int size = 0;
  std::uint32_t checked = 0;
  for (int i = end; i != begin; i = i + 1 < n ? i + 1 : 0) {
    checked |= (polygon_->checked >> i & 1) << size;
    rest_->at[size++] = polygon_->at[i];
  }
  if (in >> before_begin & 1) rest_->at[size++] = crossing(before_begin, begin);
  if (in >> end & 1) rest_->at[size++] = crossing(before_end, end);
  rest_->size = size;
  rest_->checked = checked;
  std::swap(polygon_, rest_);
  return Cut::cut;
}

CellEnvelope::Cut CellEnvelope::find_cell(int function, std::span<const Barycentric> whole) {
  polygon_->size = static_cast<int>(whole.size());
  polygon_->checked = 0;
  std::copy(whole.begin(), whole.end(), polygon_->at.begin());
  const Barycentric own = values(function);
  for (int k = 0; k < known_[function].count; ++k) {
    const Cut result = cut(function, known_[function].neighbors[k]);
    if (result == Cut::empty || result == Cut::tie) return result;
  }
  for (std::uint32_t open; (open = ~polygon_->checked & ((1u << polygon_->size) - 1)) != 0;) {
    const int i = std::countr_zero(open);
    const Barycentric& at = polygon_->at[i];
    const Wide low = lowest(at);
    if (lanes_within(low, dot(at, own) - 2 * noise_) == 0) {
      polygon_->checked |= 1u << i;
      continue;
    }
    const int other = lowest_function(at, lowest_lane(low));
    note_neighbors(function, other);
    const Cut result = cut(function, other);
    if (result == Cut::empty || result == Cut::tie) return result;
  }
  return Cut::cut;
}

void CellEnvelope::note_neighbors(int cell, int found) {
  Known& known = known_[found];
  if (known.count < kMaxKnown) known.neighbors[known.count++] = cell;
  if (known.queued) return;
  known.queued = true;
  queue_.push_back(found);
}

bool CellEnvelope::compute(std::span<const Barycentric> polygon, int first, double noise) {
  if (polygon.size() > kMaxCorners) return false;
  noise_ = noise;
  known_.assign(ranks_.size(), Known{});
  cells_.clear();
  queue_.assign(1, first);
  known_[first].queued = true;
  double area = 0;
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i) area += share(polygon[0], polygon[i], polygon[i + 1]);
  for (std::size_t q = 0; q < queue_.size(); ++q) {
    const Cut result = find_cell(queue_[q], polygon);
    if (result == Cut::tie) return false;
    if (result == Cut::empty) continue;
    Cell& cell = cells_.emplace_back(Cell{queue_[q], {}});
    add_moments(
        static_cast<std::size_t>(polygon_->size),
        [this](std::size_t i) -> const Barycentric& { return polygon_->at[i]; }, cell.moments);
    area -= total(cell.moments);
  }
  return std::abs(area) <= kAreaTolerance;
}

}  // namespace subvol::internal
