// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/cell_envelope.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace subvol {

namespace {

constexpr double kNever = 1e300;          // of the lanes that hold no function
constexpr double kAreaTolerance = 1e-14;  // of the triangle's area

}  // namespace

void CellEnvelope::clear() {
  size_ = 0;
  blocks_.clear();
  ranks_.clear();
}

void CellEnvelope::add(const Barycentric& values, std::int32_t rank) {
  const int lane = size_ % kWide;
  if (lane == 0) {
    blocks_.emplace_back();
    for (Wide& value : blocks_.back().value) value = Wide{} + kNever;
  }
  for (int k = 0; k < 3; ++k) blocks_.back().value[k][lane] = values[k];
  ranks_.push_back(rank);
  ++size_;
}

Barycentric CellEnvelope::values(int function) const {
  const double* first = reinterpret_cast<const double*>(&blocks_[function / kWide]) + function % kWide;
  return {first[0], first[kWide], first[2 * kWide]};
}

double CellEnvelope::lowest(const Barycentric& at) const {
  Wide low = Wide{} + kNever;
  for (const Block& block : blocks_)
    take_lower(low, at[0] * block.value[0] + at[1] * block.value[1] + at[2] * block.value[2]);
  return lowest_lane(low);
}

int CellEnvelope::lowest_function(const Barycentric& at, double value) const {
  int best = -1;
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const Block& block = blocks_[b];
    const Wide v = at[0] * block.value[0] + at[1] * block.value[1] + at[2] * block.value[2];
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
  rest_->size = 0;
  rest_->checked = 0;
  for (int i = 0; i < n; ++i) {
    const int j = i + 1 < n ? i + 1 : 0;
    if (!(out >> i & 1)) {
      rest_->checked |= (polygon_->checked >> i & 1) << rest_->size;
      rest_->at[rest_->size++] = polygon_->at[i];
    }
    if ((in >> i & out >> j & 1) || (out >> i & in >> j & 1))
      rest_->at[rest_->size++] = between(polygon_->at[i], polygon_->at[j], height[i] / (height[i] - height[j]));
  }
  std::swap(polygon_, rest_);
  return Cut::cut;
}

CellEnvelope::Cut CellEnvelope::find_cell(int function, std::span<const Barycentric> whole) {
  polygon_->size = static_cast<int>(whole.size());
  polygon_->checked = 0;
  std::copy(whole.begin(), whole.end(), polygon_->at.begin());
  const Barycentric own = values(function);
  for (int k = 0; k < known_[function].count; ++k) {
    const Cut result = cut(function, known_[function].neighbours[k]);
    if (result == Cut::empty || result == Cut::tie) return result;
  }
  for (std::uint32_t open; (open = ~polygon_->checked & ((1u << polygon_->size) - 1)) != 0;) {
    const int i = std::countr_zero(open);
    const Barycentric& at = polygon_->at[i];
    const double low = lowest(at);
    if (low >= dot(at, own) - 2 * noise_) {
      polygon_->checked |= 1u << i;
      continue;
    }
    const int other = lowest_function(at, low);
    note_neighbours(function, other);
    const Cut result = cut(function, other);
    if (result == Cut::empty || result == Cut::tie) return result;
  }
  return Cut::cut;
}

void CellEnvelope::note_neighbours(int cell, int found) {
  Known& known = known_[found];
  if (known.count < kMaxKnown) known.neighbours[known.count++] = cell;
  if (std::find(queue_.begin(), queue_.end(), found) == queue_.end()) queue_.push_back(found);
}

bool CellEnvelope::compute(std::span<const Barycentric> polygon, int first, double noise) {
  if (polygon.size() > kMaxCorners) return false;
  noise_ = noise;
  known_.assign(static_cast<std::size_t>(size_), Known{});
  cells_.clear();
  queue_.assign(1, first);
  double area = 0;
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i) area += share(polygon[0], polygon[i], polygon[i + 1]);
  for (std::size_t q = 0; q < queue_.size(); ++q) {
    const Cut result = find_cell(queue_[q], polygon);
    if (result == Cut::tie) return false;
    if (result == Cut::empty) continue;
    Cell cell{queue_[q], {}};
    add_moments(
        static_cast<std::size_t>(polygon_->size),
        [this](std::size_t i) -> const Barycentric& { return polygon_->at[i]; }, cell.moments);
    area -= total(cell.moments);
    cells_.push_back(cell);
  }
  return std::abs(area) <= kAreaTolerance;
}

}  // namespace subvol
