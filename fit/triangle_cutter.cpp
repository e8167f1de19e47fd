// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/triangle_cutter.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>

namespace subvol {

namespace {

constexpr std::array<double, 6> kWholeTriangle = {1. / 6, 1. / 12, 1. / 12, 1. / 6, 1. / 12, 1. / 6};
// Six products and sums with relative errors of 1.1e-16 each, and as much again for interpolated corners.
constexpr double kRounding = 4e-15;

double dot(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

}  // namespace

TriangleCutter::TriangleCutter(std::span<const Vec3> sites, const SiteTree& tree)
    : sites_(sites), tree_(tree), slot_of_site_(sites.size(), -1) {}

void TriangleCutter::cut(Index triangle, const std::array<Vec3, 3>& positions, const std::array<Index, 3>& nearest,
                         std::vector<VoronoiPiece>& pieces) {
  const Vec3 normal = (positions[1] - positions[0]).cross(positions[2] - positions[0]);
  if (normal == Vec3::Zero()) return;
  if (nearest[0] == nearest[1] && nearest[0] == nearest[2]) {
    pieces.push_back({triangle, nearest[0], kWholeTriangle});
    return;
  }
  positions_ = positions;
  parts_.assign(1, 0);
  corners_.clear();
  for (int k = 0; k < 3; ++k) {
    Corner corner{{0, 0, 0}, slot_of(nearest[k])};
    corner.at[k] = 1;
    corners_.push_back(corner);
  }
  while (!parts_.empty()) {
    int c, b;
    if (inside_one_cell(c, b))
      integrate(c);
    else
      split(c, b);
  }
  emit(triangle, pieces);
}

int TriangleCutter::slot_of(Index site) {
  int& slot = slot_of_site_[site];
  if (slot >= 0) return slot;
  slot = static_cast<int>(slots_.size());
  Slot s{site, {0, 0, 0}, 0, {}};
  if (slot > 0) {
    const Vec3 &a = sites_[site], &r = sites_[slots_[0].site], difference = a - r;
    double reach = 0;
    for (int k = 0; k < 3; ++k) {
      const Vec3 sum = (a - positions_[k]) + (r - positions_[k]);
      s.value[k] = difference.dot(sum);
      reach = std::max(reach, (a - positions_[k]).squaredNorm() + (r - positions_[k]).squaredNorm());
    }
    s.noise = kRounding * std::sqrt(difference.squaredNorm() * 2 * reach);
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
    // Neighbours along the border are most likely neighbours in the diagram: their bisector cuts few other cells.
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
  const Vec3 point = at[0] * positions_[0] + at[1] * positions_[1] + at[2] * positions_[2];
  const double bound =
      std::min((sites_[slots_[c].site] - point).squaredNorm(), (sites_[slots_[b].site] - point).squaredNorm());
  const Index site = tree_.nearest(point, bound).site;
  if (site == kNoIndex || site == slots_[c].site || site == slots_[b].site) return -1;
  const int slot = slot_of(site);
  const double noise = slots_[slot].noise + slots_[c].noise + slots_[b].noise;
  return value(slot, at) + noise < std::min(value(c, at), value(b, at)) ? slot : -1;
}

TriangleCutter::Corner TriangleCutter::crossing(std::size_t i, std::size_t j, int c, int b) {
  const double t = height_[i] / (height_[i] - height_[j]);
  Corner corner = polygon_[i];
  for (int k = 0; k < 3; ++k) corner.at[k] += t * (polygon_[j].at[k] - polygon_[i].at[k]);
  corner.slot = nearest_slot(corner.at, c, b);
  return corner;
}

void TriangleCutter::split(int c, int b) {
  polygon_.assign(top().begin(), top().end());
  corners_.resize(parts_.back());
  parts_.pop_back();
  Barycentric line;
  for (int k = 0; k < 3; ++k) line[k] = slots_[c].value[k] - slots_[b].value[k];
  const double noise = slots_[c].noise + slots_[b].noise;
  const auto height = [&](const Corner& corner) { return dot(corner.at, line); };
  std::rotate(polygon_.begin(), std::max_element(polygon_.begin(), polygon_.end(), [&](const auto& p, const auto& q) {
                return height(p) < height(q);
              }), polygon_.end());
  const std::size_t n = polygon_.size();
  height_.resize(n);
  for (std::size_t i = 0; i < n; ++i) height_[i] = height(polygon_[i]);
  const auto in_b = [&](Corner corner) { return corner.slot == c || corner.slot < 0 ? (corner.slot = b, corner) : corner; };
  const auto in_c = [&](Corner corner) { return corner.slot == b || corner.slot < 0 ? (corner.slot = c, corner) : corner; };

  parts_.push_back(corners_.size());
  if (*std::min_element(height_.begin(), height_.end()) >= -noise) {
    for (const Corner& corner : polygon_) corners_.push_back(in_b(corner));
    return;
  }
  // One chord parts the polygon, whatever rounding has done to its shape, so the parts' areas add up to its own. Its ends
  // are where the corners cease to be b's, seen both ways from the one that is most so; near the bisector they are corners.
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

void TriangleCutter::integrate(int slot) {
  const auto part = top();
  auto& m = slots_[slot].moments;
  const Barycentric& a = part[0].at;
  for (std::size_t i = 1; i + 1 < part.size(); ++i) {
    const Barycentric &b = part[i].at, &c = part[i + 1].at;
    const double area = (b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1]);
    const Barycentric s = {a[0] + b[0] + c[0], a[1] + b[1] + c[1], a[2] + b[2] + c[2]};
    int k = 0;
    for (int p = 0; p < 3; ++p)
      for (int q = p; q < 3; ++q) m[k++] += area / 12 * (a[p] * a[q] + b[p] * b[q] + c[p] * c[q] + s[p] * s[q]);
  }
  corners_.resize(parts_.back());
  parts_.pop_back();
}

void TriangleCutter::emit(Index triangle, std::vector<VoronoiPiece>& pieces) {
  slot_order_.resize(slots_.size());
  for (std::size_t k = 0; k < slots_.size(); ++k) slot_order_[k] = static_cast<int>(k);
  std::sort(slot_order_.begin(), slot_order_.end(), [&](int a, int b) { return slots_[a].site < slots_[b].site; });
  for (int k : slot_order_) {
    const VoronoiPiece piece{triangle, slots_[k].site, slots_[k].moments};
    if (piece.share() > 0) pieces.push_back(piece);
  }
  for (const Slot& slot : slots_) slot_of_site_[slot.site] = -1;
  slots_.clear();
}

}  // namespace subvol
