// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/energies/closest_point_energy.h"

#include "subvol/base/error.h"
#include "subvol/fit/geometry/closest_point.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <utility>

namespace subvol::internal {

namespace {

/// Barycentric coordinates of a point in a triangle's plane, clamped to the triangle; (1, 0, 0) if it has no area.
std::array<double, 3> barycentric(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 u = b - a, v = c - a, w = p - a, n = u.cross(v);
  const double area = n.squaredNorm();
  if (!(area > 0)) return {1, 0, 0};
  const double second = std::clamp(w.cross(v).dot(n) / area, 0.0, 1.0);
  const double third = std::clamp(u.cross(w).dot(n) / area, 0.0, 1.0 - second);
  return {1 - second - third, second, third};
}

constexpr std::size_t kMostPointsPerTriangle = 6;

/// Distance, as a share of the target's length, below which rounding makes the direction between two points arbitrary.
constexpr double kLeastOffset = 1e-6;

/// Least product of normals that agree, and the weight of points where they do not (`discount_disagreeing`).
constexpr double kLeastAgreeingProduct = 0.2, kDisagreeingWeight = 0.02;

/// The points of a triangle that correspond to the target, by their number: the centroid; three inside; these and the
/// corners, which serve as points of the edges, where the surfaces are farthest apart.
std::span<const std::array<double, 3>> triangle_points(std::size_t number) {
  constexpr double kThird = 1.0 / 3, kSixth = 1.0 / 6, kTwoThirds = 2.0 / 3;
  static constexpr std::array<std::array<double, 3>, 1> kTriangleCentroid = {{{kThird, kThird, kThird}}};
  static constexpr std::array<std::array<double, 3>, kMostPointsPerTriangle> kDenseTrianglePoints = {
      {{kTwoThirds, kSixth, kSixth},
       {kSixth, kTwoThirds, kSixth},
       {kSixth, kSixth, kTwoThirds},
       {1, 0, 0},
       {0, 1, 0},
       {0, 0, 1}}};
  return number == 1 ? std::span<const std::array<double, 3>>(kTriangleCentroid)
                     : std::span(kDenseTrianglePoints).first(number);
}

}  // namespace

ClosestPointEnergy::ClosestPointEnergy(const TargetSurface& target, std::vector<std::array<Index, 3>> sample_triangles,
                                       std::size_t num_samples, double tangential_weight, int points_per_triangle,
                                       SurfacePull pull)
    : SurfaceTerm(std::move(sample_triangles), num_samples),
      target_(&target),
      tau_(tangential_weight),
      scale_(1 / (2 * target.area() * target.length() * target.length())),
      pull_(pull) {
  if (!(tau_ >= 0 && tau_ <= 1)) throw InputError("ClosestPointEnergy: tangential_weight must be in [0, 1]");
  if (points_per_triangle != 1 && points_per_triangle != 3)
    throw InputError("ClosestPointEnergy: points_per_triangle must be 1 or 3");
  for (std::size_t t = 0; t <= triangles().size(); ++t) surface_offsets_.push_back(points_per_triangle * t);
  target_tree_ = target.tree();
}

namespace {

std::vector<std::array<Index, 3>> renumbered(std::span<const std::array<Index, 3>> triangles,
                                             std::span<const Index> which, std::span<const Index> numbers) {
  std::vector<std::array<Index, 3>> result;
  for (const Index t : which) {
    result.push_back(triangles[t]);
    for (Index& corner : result.back()) corner = numbers[corner];
  }
  return result;
}

}  // namespace

ClosestPointEnergy::ClosestPointEnergy(const ClosestPointEnergy& whole, std::span<const Index> triangles,
                                       std::span<const Index> numbers, const std::vector<std::uint8_t>& is_free)
    : SurfaceTerm(renumbered(whole.triangles(), triangles, numbers), is_free.size()),
      target_(whole.target_),
      target_tree_(whole.target_tree_),
      is_part_(true),
      tau_(whole.tau_),
      scale_(whole.scale_),
      inverse_far_(whole.inverse_far_),
      pull_(whole.pull_),
      discounts_(whole.discounts_) {
  std::vector<std::size_t> hits;  // of the whole on these triangles
  surface_offsets_.push_back(0);
  for (const Index t : triangles) {
    if (!whole.target_offsets_.empty())
      for (std::size_t k = whole.target_offsets_[t]; k < whole.target_offsets_[t + 1]; ++k)
        hits.push_back(whole.hit_of_link_[k]);
    surface_offsets_.push_back(surface_offsets_.back() + whole.surface_offsets_[t + 1] - whole.surface_offsets_[t]);
    if (!whole.groups_.empty()) groups_.push_back(whole.groups_[t]);
    if (!whole.factors_.empty()) factors_.push_back(whole.factors_[t]);
  }
  std::sort(hits.begin(), hits.end());
  for (const std::size_t j : hits) {
    used_.push_back(static_cast<Index>(whole.target_point(j)));
    used_points_.push_back(target_->samples()[used_.back()]);
    if (!whole.sample_groups_.empty()) sample_groups_.push_back(whole.sample_groups_[j]);
  }
  if (whole.creases()) add_creases(whole.creases()->part(numbers, is_free));
}

void ClosestPointEnergy::emphasize_far(double length) {
  if (!(length > 0)) throw InputError("ClosestPointEnergy: the length beyond which ties count more must be positive");
  inverse_far_ = 1 / length;
}

void ClosestPointEnergy::set_groups(std::vector<Index> of_triangle, std::span<const Index> of_target) {
  if (target_->is_cloud() || of_triangle.size() != triangles().size() ||
      of_target.size() != target_->triangles().size())
    throw InputError("ClosestPointEnergy: one group is expected for each triangle of both surfaces");
  groups_ = std::move(of_triangle);
  sample_groups_.clear();
  for (const Index t : target_->sample_triangles()) sample_groups_.push_back(of_target[t]);
  target_tree_ = target_->tree(of_target);
  is_found_ = false;
  is_forgotten_ = true;
}

void ClosestPointEnergy::weigh(std::vector<double> factors) {
  if (factors.size() != triangles().size())
    throw InputError("ClosestPointEnergy: one factor is expected for each sample triangle");
  for (const double factor : factors)
    if (!(factor > 0) || !std::isfinite(factor))
      throw InputError("ClosestPointEnergy: factors must be positive and finite");
  factors_ = std::move(factors);
}

void ClosestPointEnergy::refine(std::span<const std::uint8_t> refined) {
  if (refined.size() != triangles().size())
    throw InputError("ClosestPointEnergy: one entry is expected for each sample triangle");
  std::size_t offset = 0;
  for (std::size_t t = 0; t < refined.size(); ++t) {
    const std::size_t points = refined[t] ? kMostPointsPerTriangle : surface_offsets_[t + 1] - surface_offsets_[t];
    surface_offsets_[t] = offset;
    offset += points;
  }
  surface_offsets_.back() = offset;
  surface_hits_.clear();
  is_found_ = false;
}

void ClosestPointEnergy::begin_search() {
  if (is_forgotten_) {
    surface_tree_.reset();
    target_hits_.clear();
    surface_hits_.clear();
  }
  is_fresh_ = std::exchange(is_forgotten_, false);
  is_found_ = false;
}

void ClosestPointEnergy::find_target(std::span<const Vec3> samples) {
  const std::vector<Vec3>& points = is_part_ ? used_points_ : target_->samples();
  if (surface_tree_) {
    surface_tree_->move(samples);
  } else {
    surface_tree_.emplace(TriangleMesh{{samples.begin(), samples.end()}, {triangles().begin(), triangles().end()}},
                          groups_);
    target_hits_.resize(points.size());
  }
  surface_tree_->closest(points, sample_groups_, target_hits_);
}

void ClosestPointEnergy::link_target(std::span<const Vec3> samples) {
  const bool straight = pull_ == SurfacePull::straight_both_ways;
  const std::vector<Vec3>& points = is_part_ ? used_points_ : target_->samples();
  target_offsets_.assign(triangles().size() + 1, 0);
  for (const auto& hit : target_hits_) ++target_offsets_[hit.triangle + 1];
  for (std::size_t t = 0; t < triangles().size(); ++t) target_offsets_[t + 1] += target_offsets_[t];
  std::vector<std::size_t> next(target_offsets_.begin(), target_offsets_.end() - 1);
  target_links_.resize(points.size());
  hit_of_link_.resize(points.size());
  for (std::size_t j = 0; j < points.size(); ++j) hit_of_link_[next[target_hits_[j].triangle]++] = j;
#pragma omp parallel for schedule(static)
  for (std::size_t k = 0; k < points.size(); ++k) {
    const std::size_t j = hit_of_link_[k];
    const Index t = target_hits_[j].triangle;
    const auto& q = triangles()[t];
    const double distance = target_hits_[j].distance;
    const bool has_direction = straight && distance > kLeastOffset * target_->length();
    target_links_[k] = {t,
                        barycentric(target_hits_[j].point, samples[q[0]], samples[q[1]], samples[q[2]]),
                        points[j],
                        has_direction ? Vec3((points[j] - target_hits_[j].point) / distance)
                                      : target_->sample_normals()[target_point(j)],
                        factor(t) * emphasis(distance) * target_->sample_areas()[target_point(j)],
                        tau_};
  }
}

bool ClosestPointEnergy::over_rim(const ClosestPoint::Hit& hit) const {
  const auto& [a, b, c] = target_->triangles()[hit.triangle];
  const std::vector<Vec3>& p = target_->positions();
  return target_->has_rim(hit.triangle) && target_->on_rim(hit.triangle, barycentric(hit.point, p[a], p[b], p[c]));
}

double ClosestPointEnergy::share_over_rim(const Link& link, const ClosestPoint::Hit& hit,
                                          std::span<const Vec3> samples) const {
  const auto& [a, b, c] = triangles()[link.triangle];
  const double far = hit.distance / (2 * target_->length()), near = std::max(0.0, 1 - far * far);
  const double along = link.normal.dot((samples[b] - samples[a]).cross(samples[c] - samples[a]).normalized());
  return near * near * along * along;
}

void ClosestPointEnergy::link_surface(std::span<const Vec3> samples, bool finds) {
  if (!target_tree_) return;
  surface_links_.resize(surface_offsets_.back());
  surface_hits_.resize(surface_links_.size());
  surface_distances_.resize(surface_links_.size());
  const bool straight = pull_ != SurfacePull::along_normals;
#pragma omp parallel for schedule(static)
  for (std::size_t t = 0; t < triangles().size(); ++t) {
    const auto& q = triangles()[t];
    const std::size_t begin = surface_offsets_[t], n = surface_offsets_[t + 1] - begin;
    const auto points = triangle_points(n);
    const Vec3 own_normal =
        discounts_ ? (samples[q[1]] - samples[q[0]]).cross(samples[q[2]] - samples[q[0]]).normalized() : Vec3::Zero();
    Index before = kNoIndex;
    for (std::size_t k = 0; k < n; ++k) {
      const std::array<double, 3>& l = points[k];
      const Vec3 x = l[0] * samples[q[0]] + l[1] * samples[q[1]] + l[2] * samples[q[2]];
      ClosestPoint::Hit& hit = surface_hits_[begin + k];
      if (finds) hit = target_tree_->closest(x, group(t), hit.triangle == kNoIndex ? before : hit.triangle);
      before = hit.triangle;
      Link& link = surface_links_[begin + k];
      link = {static_cast<Index>(t),
              l,
              hit.point,
              target_->normals()[hit.triangle],
              factor(static_cast<Index>(t)) * emphasis(hit.distance) * triangle_area(t) / static_cast<double>(n),
              tau_};
      if (discounts_ && own_normal.dot(link.normal) < kLeastAgreeingProduct) link.weight *= kDisagreeingWeight;
      surface_distances_[begin + k] = hit.distance;
      if (!over_rim(hit)) {
        if (straight && hit.distance > kLeastOffset * target_->length()) link.normal = (x - hit.point) / hit.distance;
        continue;
      }
      link.weight *= share_over_rim(link, hit, samples);
      link.tangential = 0;
      surface_distances_[begin + k] = 0;
    }
  }
}

void ClosestPointEnergy::add_link(const Link& link, const Incidence& incidence, Row& row, double& value) const {
  const double own = link.barycentric[incidence.corner];
  if (own == 0) return;
  const auto& q = triangles()[link.triangle];
  Vec3 d = -link.point;
  for (int l = 0; l < 3; ++l) d += link.barycentric[l] * assigned()[q[l]];
  const double height = link.normal.dot(d), weight = own * link.weight;
  const double tau = link.tangential;
  const Vec3 pull = ((1 - tau) * height) * link.normal + tau * d;
  value += weight * pull.dot(d);
  row.gradient += 2 * weight * pull;
  for (int l = 0; l < 3; ++l) {
    const double w = 2 * weight * link.barycentric[l];
    Mat3& block = row.blocks[incidence.entries[l]];
    block += ((1 - tau) * w) * link.normal * link.normal.transpose();
    block.diagonal().array() += tau * w;
  }
}

void ClosestPointEnergy::assign(std::span<const Vec3> samples) {
  const bool finds = !is_found_ || (is_forgotten_ && !is_fresh_) || !std::ranges::equal(samples, assigned());
  begin_assign(samples);
  if (finds) {
    begin_search();
    find_target(samples);
  }
  link_target(samples);
  link_surface(samples, finds);
  is_found_ = true;
  assemble(scale_, [this](std::size_t i, Row& row) {
    for (const Incidence& incidence : incidences(i)) {
      const auto t = static_cast<std::size_t>(incidence.triangle);
      for (std::size_t k = target_offsets_[t]; k < target_offsets_[t + 1]; ++k)
        add_link(target_links_[k], incidence, row, row.target_to_surface);
      if (!target_tree_) continue;
      for (std::size_t k = surface_offsets_[t]; k < surface_offsets_[t + 1]; ++k)
        add_link(surface_links_[k], incidence, row, row.surface_to_target);
    }
  });
}

void ClosestPointEnergy::assign_target(std::span<const Vec3> samples) {
  begin_search();
  find_target(samples);
  link_target(samples);
}

void ClosestPointEnergy::forget() { is_forgotten_ = true; }

ClosestPointEnergy::Distance ClosestPointEnergy::assigned_distance() const {
  double to_surface = 0, to_target = 0, area = 0, max = 0;
  for (std::size_t j = 0; j < target_hits_.size(); ++j) {
    to_surface += target_->sample_areas()[target_point(j)] * target_hits_[j].distance;
    max = std::max(max, target_hits_[j].distance);
  }
  for (std::size_t q = 0; q < surface_distances_.size(); ++q) {
    const auto t = static_cast<std::size_t>(surface_links_[q].triangle);
    const double part = triangle_area(t) / static_cast<double>(surface_offsets_[t + 1] - surface_offsets_[t]);
    area += part;
    to_target += part * surface_distances_[q];
    max = std::max(max, surface_distances_[q]);
  }
  return {std::max(to_surface / target_->area(), area > 0 ? to_target / area : 0), max};
}

std::vector<double> ClosestPointEnergy::triangle_distances() const {
  std::vector<double> result(triangles().size(), 0.0);
  for (std::size_t q = 0; q < surface_distances_.size(); ++q) {
    double& largest = result[surface_links_[q].triangle];
    largest = std::max(largest, surface_distances_[q]);
  }
  for (const ClosestPoint::Hit& hit : target_hits_) result[hit.triangle] = std::max(result[hit.triangle], hit.distance);
  return result;
}

std::vector<double> ClosestPointEnergy::triangle_distances_with_corners() const {
  std::vector<double> result = triangle_distances();
  if (!target_tree_) return result;
  std::vector<double> of_sample(num_samples());
#pragma omp parallel for schedule(static)
  for (std::size_t i = 0; i < of_sample.size(); ++i) {
    const ClosestPoint::Hit hit = target_tree_->closest(assigned()[i], kNoIndex);
    of_sample[i] = over_rim(hit) ? 0 : hit.distance;
  }
  for (std::size_t t = 0; t < result.size(); ++t)
    for (const Index corner : triangles()[t]) result[t] = std::max(result[t], of_sample[corner]);
  return result;
}

}  // namespace subvol::internal
