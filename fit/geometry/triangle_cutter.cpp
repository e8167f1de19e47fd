// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/geometry/triangle_cutter.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>

namespace subvol::internal {

namespace {

constexpr std::array<double, 6> kWholeTriangle = {1. / 6, 1. / 12, 1. / 12, 1. / 6, 1. / 12, 1. / 6};
// Six products and sums with relative errors of 1.1e-16 each, and as much again for interpolated corners.
constexpr double kSquaredDifferenceRounding = 4e-15;

// Largest number of sites for which the cells of a part are found at once, and of failures of that in a row, after
// which it is no longer tried.
constexpr std::size_t kMaxCandidates = 160;
constexpr int kMaxFailures = 16;
// Rounding must not lose the site on the sphere of a ball.
constexpr double kBallSlack = 1 + 1e-12;

}  // namespace

TriangleCutter::TriangleCutter(const SiteTree& tree) : tree_(tree), slot_of_place_(tree.num_sites(), -1) {}

void TriangleCutter::cut(Index triangle, const std::array<Vec3, 3>& positions, const std::array<Index, 3>& nearest,
                         std::vector<VoronoiPiece>& pieces) {
  const Vec3 normal = (positions[1] - positions[0]).cross(positions[2] - positions[0]);
  if (normal == Vec3::Zero()) return;
  if (nearest[0] == nearest[1] && nearest[0] == nearest[2]) {
    pieces.push_back({triangle, tree_.site(nearest[0]), kWholeTriangle});
    return;
  }
  positions_ = positions;
  parts_.assign(1, 0);
  corners_.clear();
  constexpr Barycentric kCornerBarycentrics[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int k = 0; k < 3; ++k) corners_.push_back({kCornerBarycentrics[k], slot_of(nearest[k])});
  num_failures_ = 0;
  while (!parts_.empty()) {
    int c, b;
    if (inside_one_cell(c, b))
      integrate(c);
    else if (!part_at_once())
      split(c, b);
  }
  emit(triangle, pieces);
}

int TriangleCutter::slot_of(Index place) {
  int& slot = slot_of_place_[place];
  if (slot >= 0) return slot;
  slot = static_cast<int>(slots_.size());
  Slot s{place, {0, 0, 0}, 0, {}};
  if (slot > 0) {
    const Vec3 &a = tree_.position(place), &r = position(0), difference = a - r;
    double reach = 0;
    for (int k = 0; k < 3; ++k) {
      const Vec3 sum = (a - positions_[k]) + (r - positions_[k]);
      s.value[k] = difference.dot(sum);
      reach = std::max(reach, (a - positions_[k]).squaredNorm() + (r - positions_[k]).squaredNorm());
    }
    s.noise = kSquaredDifferenceRounding * std::sqrt(difference.squaredNorm() * 2 * reach);
  }
  slots_.push_back(s);
  return slot;
}

double TriangleCutter::value(int slot, const Barycentric& at) const { return dot(at, slots_[slot].value); }

double TriangleCutter::violation(int c, const Corner& corner) const {
  if (corner.slot == c) return 0;
  return value(c, corner.at) - value(corner.slot, corner.at) - 2 * (slots_[c].noise + slots_[corner.slot].noise);
}

bool TriangleCutter::inside_one_cell(int& c, int& b) const {
  const auto part = top();
  double least = std::numeric_limits<double>::infinity();
  int fallback = -1;
  for (std::size_t i = 0; i < part.size(); ++i) {
    const int candidate = part[i].slot;
    int lower = -1;
    for (const Corner& corner : part)
      if (violation(candidate, corner) > 0) lower = corner.slot;
    if (lower < 0) {
      c = candidate;
      return true;
    }
    if (i == 0) fallback = lower;
    // Neighbors along the part's outline are most likely neighbors in the diagram: their bisector cuts few other cells.
    const Corner& next = part[i + 1 < part.size() ? i + 1 : 0];
    const double here = violation(next.slot, part[i]), there = violation(candidate, next);
    const double worst = std::max(here, there);
    if (!(worst > 0) || !(worst < least)) continue;
    least = worst;
    c = there > 0 ? candidate : next.slot;
    b = there > 0 ? next.slot : candidate;
  }
  if (least < std::numeric_limits<double>::infinity()) return false;
  c = part[0].slot;
  b = fallback;
  return false;
}

int TriangleCutter::nearest_slot(const Barycentric& at, int c, int b) {
  const Vec3 p = point(at);
  const double bound = std::min((position(c) - p).squaredNorm(), (position(b) - p).squaredNorm());
  const Index place = tree_.nearest(p, bound).place;
  if (place == kNoIndex || place == slots_[c].place || place == slots_[b].place) return -1;
  const int slot = slot_of(place);
  const double noise = slots_[slot].noise + slots_[c].noise + slots_[b].noise;
  return value(slot, at) + noise < std::min(value(c, at), value(b, at)) ? slot : -1;
}

TriangleCutter::Corner TriangleCutter::crossing(std::size_t i, std::size_t j, int c, int b) {
  const double t = height_[i] / (height_[i] - height_[j]);
  const Barycentric at = between(polygon_[i].at, polygon_[j].at, t);
  return {at, nearest_slot(at, c, b)};
}

void TriangleCutter::split(int c, int b) {
  polygon_.assign(top().begin(), top().end());
  pop();
  Barycentric line;
  for (int k = 0; k < 3; ++k) line[k] = slots_[c].value[k] - slots_[b].value[k];
  const double noise = slots_[c].noise + slots_[b].noise;
  const auto height = [&](const Corner& corner) { return dot(corner.at, line); };
  std::rotate(polygon_.begin(),
              std::max_element(polygon_.begin(), polygon_.end(),
                               [&](const auto& p, const auto& q) { return height(p) < height(q); }),
              polygon_.end());
  const std::size_t n = polygon_.size();
  height_.resize(n);
  for (std::size_t i = 0; i < n; ++i) height_[i] = height(polygon_[i]);
  // In each half, corners labeled with the other half's site are at least as near to this half's own and get its label.
  const auto relabeled = [](Corner corner, int other, int own) {
    if (corner.slot == other || corner.slot < 0) corner.slot = own;
    return corner;
  };
  const auto in_b = [&](const Corner& corner) { return relabeled(corner, c, b); };
  const auto in_c = [&](const Corner& corner) { return relabeled(corner, b, c); };

  parts_.push_back(corners_.size());
  if (*std::min_element(height_.begin(), height_.end()) >= -noise) {
    for (const Corner& corner : polygon_) corners_.push_back(in_b(corner));
    return;
  }
  // One chord divides the polygon, whatever rounding has done to its shape, so the areas of the parts add up to its
  // own. Start from the corner that is deepest in b's part and walk both ways: the chord ends where the corners cease
  // to be b's, at a corner if that is near the bisector.
  std::size_t first = 1, last = n - 1;
  while (height_[first] > noise) ++first;
  while (height_[last] > noise) --last;
  const bool first_on = height_[first] >= -noise, last_on = height_[last] >= -noise;
  const Corner from = first_on ? polygon_[first] : crossing(first - 1, first, c, b);
  const Corner to = last_on ? polygon_[last] : crossing((last + 1) % n, last, c, b);
  for (std::size_t i = 0; i < first; ++i) corners_.push_back(in_b(polygon_[i]));
  corners_.push_back(in_b(from));
  corners_.push_back(in_b(to));
  for (std::size_t i = last + 1; i < n; ++i) corners_.push_back(in_b(polygon_[i]));
  parts_.push_back(corners_.size());
  corners_.push_back(in_c(from));
  for (std::size_t i = first_on ? first + 1 : first; i < (last_on ? last : last + 1); ++i)
    corners_.push_back(in_c(polygon_[i]));
  corners_.push_back(in_c(to));
}

bool TriangleCutter::gather(std::span<const Corner> part) {
  // A site that is farther than c from all corners is farther everywhere between them: only sites in the balls through
  // c around the corners matter. The smaller the balls, the better.
  Barycentric sum{};
  for (const Corner& corner : part)
    for (int k = 0; k < 3; ++k) sum[k] += corner.at[k];
  int central = part[0].slot;
  for (const Corner& corner : part)
    if (value(corner.slot, sum) < value(central, sum)) central = corner.slot;
  const Vec3& c = position(central);
  balls_.clear();
  for (const Corner& corner : part) {
    const Vec3 p = point(corner.at);
    balls_.push_back({p, kBallSlack * (c - p).squaredNorm()});
  }
  candidates_.clear();
  return tree_.gather(balls_, kMaxCandidates, candidates_);
}

double TriangleCutter::add_candidates() {
  const Vec3& r = position(0);
  Wide worst{};
  envelope_.clear();
  for (std::size_t begin = 0; begin < candidates_.size(); begin += kWide) {
    const int count = static_cast<int>(std::min<std::size_t>(kWide, candidates_.size() - begin));
    Wide at[3] = {Wide{} + r[0], Wide{} + r[1], Wide{} + r[2]};
    std::array<std::int32_t, kWide> ranks{};
    for (int lane = 0; lane < count; ++lane) {
      const Index place = candidates_[begin + static_cast<std::size_t>(lane)];
      for (int axis = 0; axis < 3; ++axis) at[axis][lane] = tree_.position(place)[axis];
      ranks[lane] = tree_.site(place);
    }
    std::array<Wide, 3> values;
    const Wide dx = at[0] - r[0], dy = at[1] - r[1], dz = at[2] - r[2];
    Wide reach{};
    for (int k = 0; k < 3; ++k) {
      Wide terms{};
      values[k] = Wide{};
      for (int axis = 0; axis < 3; ++axis) {
        const Wide a = at[axis] - positions_[k][axis];
        const double b = r[axis] - positions_[k][axis];
        values[k] += (at[axis] - r[axis]) * (a + b);
        terms += a * a + b * b;
      }
      take_higher(reach, terms);
    }
    take_higher(worst, (dx * dx + dy * dy + dz * dz) * reach);
    for (int lane = count; lane < kWide; ++lane)
      for (Wide& value : values) value[lane] = CellEnvelope::kNever;
    envelope_.add(values, ranks);
  }
  return kSquaredDifferenceRounding * std::sqrt(2 * highest_lane(worst));
}

bool TriangleCutter::part_at_once() {
  if (num_failures_ >= kMaxFailures) return false;
  const auto part = top();
  ++num_failures_;
  if (!gather(part)) return false;
  const auto first = std::find(candidates_.begin(), candidates_.end(), slots_[part[0].slot].place);
  if (first == candidates_.end()) return false;
  const double noise = add_candidates();
  outline_.clear();
  for (const Corner& corner : part) outline_.push_back(corner.at);
  if (!envelope_.compute(outline_, static_cast<int>(first - candidates_.begin()), 2 * noise)) return false;
  for (const CellEnvelope::Cell& cell : envelope_.cells()) {
    auto& moments = slots_[slot_of(candidates_[cell.function])].moments;
    for (int k = 0; k < 6; ++k) moments[k] += cell.moments[k];
  }
  num_failures_ = 0;
  pop();
  return true;
}

Vec3 TriangleCutter::point(const Barycentric& at) const {
  return at[0] * positions_[0] + at[1] * positions_[1] + at[2] * positions_[2];
}

void TriangleCutter::pop() {
  corners_.resize(parts_.back());
  parts_.pop_back();
}

void TriangleCutter::integrate(int slot) {
  const auto part = top();
  add_moments(
      part.size(), [&](std::size_t i) -> const Barycentric& { return part[i].at; }, slots_[slot].moments);
  pop();
}

void TriangleCutter::emit(Index triangle, std::vector<VoronoiPiece>& pieces) {
  const std::size_t begin = pieces.size();
  for (const Slot& slot : slots_) {
    slot_of_place_[slot.place] = -1;
    if (total(slot.moments) > 0) pieces.push_back({triangle, tree_.site(slot.place), slot.moments});
  }
  slots_.clear();
  std::sort(pieces.begin() + static_cast<std::ptrdiff_t>(begin), pieces.end(),
            [](const VoronoiPiece& a, const VoronoiPiece& b) { return a.site < b.site; });
}

}  // namespace subvol::internal
