// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/cell_envelope.h"

#include <algorithm>
#include <cmath>

namespace subvol {

namespace {

constexpr double kNever = 1e300;        // of the lanes that hold no function
constexpr double kAreaTolerance = 1e-13;  // of the triangle's area

}  // namespace

void CellEnvelope::clear() {
  size_ = 0;
  blocks_.clear();
  ranks_.clear();
}

void CellEnvelope::add(const Barycentric& values, std::int32_t rank) {
  const int lane = size_ % kWidth;
  if (lane == 0) {
    blocks_.emplace_back();
    for (auto& lanes : blocks_.back().value) lanes.fill(kNever);
  }
  for (int k = 0; k < 3; ++k) blocks_.back().value[k][lane] = values[k];
  ranks_.push_back(rank);
  ++size_;
}

Barycentric CellEnvelope::values(int function) const {
  const Block& block = blocks_[function / kWidth];
  const int lane = function % kWidth;
  return {block.value[0][lane], block.value[1][lane], block.value[2][lane]};
}

double CellEnvelope::lowest(const Barycentric& at) const {
  alignas(64) double low[kWidth];
  for (double& v : low) v = kNever;
  for (const Block& block : blocks_)
    for (int k = 0; k < kWidth; ++k) {
      const double v = at[0] * block.value[0][k] + at[1] * block.value[1][k] + at[2] * block.value[2][k];
      low[k] = v < low[k] ? v : low[k];
    }
  return *std::min_element(low, low + kWidth);
}

int CellEnvelope::lowest_function(const Barycentric& at) const {
  double least = kNever;
  int best = 0;
  for (int f = 0; f < size_; ++f) {
    const double v = dot(at, values(f));
    if (v > least || (v == least && ranks_[f] > ranks_[best])) continue;
    least = v;
    best = f;
  }
  return best;
}

CellEnvelope::Cut CellEnvelope::cut(int inside, int outside, double noise) {
  const Barycentric line = values(inside) - values(outside);
  height_.resize(polygon_.size());
  double low = 0, high = 0;
  for (std::size_t i = 0; i < polygon_.size(); ++i) {
    const double h = dot(polygon_[i].at, line);
    height_[i] = std::abs(h) <= noise ? 0 : h;
    low = std::min(low, height_[i]);
    high = std::max(high, height_[i]);
  }
  if (high == 0) return low == 0 ? Cut::tie : Cut::untouched;
  if (low == 0) return Cut::empty;
  rest_.clear();
  for (std::size_t i = 0; i < polygon_.size(); ++i) {
    const std::size_t j = i + 1 < polygon_.size() ? i + 1 : 0;
    if (height_[i] <= 0) rest_.push_back(polygon_[i]);
    if ((height_[i] < 0 && height_[j] > 0) || (height_[i] > 0 && height_[j] < 0))
      rest_.push_back({between(polygon_[i].at, polygon_[j].at, height_[i] / (height_[i] - height_[j])), false});
  }
  polygon_.swap(rest_);
  return Cut::cut;
}

CellEnvelope::Cut CellEnvelope::find_cell(int function, double noise) {
  polygon_ = start_;
  for (int k = 0; k < known_[function].count; ++k) {
    const Cut result = cut(function, known_[function].neighbours[k], noise);
    if (result == Cut::empty || result == Cut::tie) return result;
  }
  for (std::size_t i = 0; i < polygon_.size();) {
    if (polygon_[i].checked) {
      ++i;
      continue;
    }
    if (lowest(polygon_[i].at) >= dot(polygon_[i].at, values(function)) - 2 * noise) {
      polygon_[i++].checked = true;
      continue;
    }
    const int other = lowest_function(polygon_[i].at);
    Known& known = known_[other];
    if (!known.queued) queue_.push_back(other);
    known.queued = true;
    if (known.count < kMaxKnown) known.neighbours[known.count++] = function;
    const Cut result = cut(function, other, noise);
    if (result == Cut::empty || result == Cut::tie) return result;
    i = 0;
  }
  return Cut::cut;
}

bool CellEnvelope::compute(std::span<const Barycentric> polygon, int first, double noise) {
  start_.clear();
  for (const Barycentric& at : polygon) start_.push_back({at, false});
  known_.assign(static_cast<std::size_t>(size_), Known{});
  cells_.clear();
  queue_.assign(1, first);
  known_[first].queued = true;
  double area = 0;
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i) area += share(polygon[0], polygon[i], polygon[i + 1]);
  for (std::size_t q = 0; q < queue_.size(); ++q) {
    const Cut result = find_cell(queue_[q], noise);
    if (result == Cut::tie) return false;
    if (result == Cut::empty) continue;
    Cell cell{queue_[q], {}};
    add_moments(polygon_.size(), [this](std::size_t i) -> const Barycentric& { return polygon_[i].at; }, cell.moments);
    area -= total(cell.moments);
    cells_.push_back(cell);
  }
  return std::abs(area) <= kAreaTolerance;
}

}  // namespace subvol
