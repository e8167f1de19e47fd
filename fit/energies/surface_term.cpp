// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/energies/surface_term.h"

#include "subvol/base/error.h"

#include <Eigen/Geometry>

#include <algorithm>

namespace subvol::internal {

namespace {

std::vector<std::size_t> clique_offsets(std::size_t num_triangles) {
  std::vector<std::size_t> offsets(num_triangles + 1);
  for (std::size_t t = 0; t <= num_triangles; ++t) offsets[t] = 3 * t;
  return offsets;
}

}  // namespace

SurfaceTerm::SurfaceTerm(std::vector<std::array<Index, 3>> sample_triangles, std::size_t num_samples)
    : triangles_(std::move(sample_triangles)) {
  if (num_samples == 0) throw InputError("SurfaceTerm: num_samples must be positive");
  const std::span<const Index> corners(triangles_.empty() ? nullptr : triangles_[0].data(), 3 * triangles_.size());
  hessian_ = clique_pattern(num_samples, clique_offsets(triangles_.size()), corners);
  hessian_.set_zero();
  gradient_.resize(num_samples);

  incidence_offsets_.assign(num_samples + 1, 0);
  for (Index v : corners) ++incidence_offsets_[v + 1];
  for (std::size_t i = 0; i < num_samples; ++i) incidence_offsets_[i + 1] += incidence_offsets_[i];
  incidences_.resize(corners.size());
  std::vector<std::size_t> next(incidence_offsets_.begin(), incidence_offsets_.end() - 1);
  for (std::size_t t = 0; t < triangles_.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const Index v = triangles_[t][k];
      Incidence& incidence = incidences_[next[v]++];
      incidence = {static_cast<Index>(t), k, {}};
      for (int l = 0; l < 3; ++l)
        incidence.entries[l] = static_cast<Index>(hessian_.find(v, triangles_[t][l]) - hessian_.offsets[v]);
    }
}

void SurfaceTerm::begin_assign(std::span<const Vec3> samples) {
  if (samples.size() != num_samples()) throw InputError("SurfaceTerm::assign: samples must be num_samples positions");
  assigned_.assign(samples.begin(), samples.end());
  if (creases_) creases_->assign(samples);
  triangle_areas_.resize(triangles_.size());
#pragma omp parallel for schedule(static)
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    const Vec3& a = samples[triangles_[t][0]];
    triangle_areas_[t] = 0.5 * (samples[triangles_[t][1]] - a).cross(samples[triangles_[t][2]] - a).norm();
  }
}

void SurfaceTerm::add_creases(CreaseEnergy creases) {
  for (const CreaseSegment& segment : creases.segments()) {
    if (!creases.moves(segment.ends)) continue;
    const auto [a, b] = segment.ends;
    const bool known = static_cast<std::size_t>(std::max(a, b)) < num_samples();
    if (!known || hessian_.find(a, b) == hessian_.num_entries())
      throw InputError("SurfaceTerm::add_creases: a segment must be an edge of a sample triangle");
  }
  creases_ = std::move(creases);
}

void SurfaceTerm::add_crease_links(std::size_t sample, Row& row) const {
  const auto i = static_cast<Index>(sample);
  for (Index number : creases_->links_at(sample)) {
    const CreaseEnergy::Link& link = creases_->link(number);
    const std::array<double, 2> shares = {1 - link.at, link.at};
    const double own = link.ends[0] == i ? shares[0] : shares[1];
    const Vec3 d = shares[0] * assigned_[link.ends[0]] + shares[1] * assigned_[link.ends[1]] - link.point;
    const double weight = own * link.weight;
    row.surface_to_target += weight * d.dot(link.metric * d);
    row.gradient += 2 * weight * link.metric * d;
    for (int k = 0; k < 2; ++k)
      row.blocks[hessian_.find(i, link.ends[k]) - hessian_.offsets[i]] += 2 * weight * shares[k] * link.metric;
  }
}

Vec3 SurfaceTerm::hessian_times_step(std::span<const Vec3> z, std::size_t i) const {
  Vec3 product = Vec3::Zero();
  for (std::size_t k = hessian_.offsets[i]; k < hessian_.offsets[i + 1]; ++k) {
    const float* b = hessian_.block(k);
    const Vec3 d = z[hessian_.columns[k]] - assigned_[hessian_.columns[k]];
    for (int r = 0; r < 3; ++r) product[r] += b[3 * r] * d[0] + b[3 * r + 1] * d[1] + b[3 * r + 2] * d[2];
  }
  return product;
}

double SurfaceTerm::value(std::span<const Vec3> z) const {
  if (z.size() != num_samples() || assigned_.empty())
    throw InputError("SurfaceTerm::value: z must be num_samples positions, after assign");
  const double change = sliced_sum(z.size(), [&](std::size_t i) {
    return (z[i] - assigned_[i]).dot(gradient_[i] + 0.5 * hessian_times_step(z, i));
  });
  return target_to_surface_ + surface_to_target_ + change;
}

void SurfaceTerm::add_gradient(std::span<const Vec3> z, std::span<Vec3> g) const {
  if (z.size() != num_samples() || g.size() != num_samples() || assigned_.empty())
    throw InputError("SurfaceTerm::add_gradient: z and g must have num_samples entries, after assign");
#pragma omp parallel for schedule(static)
  for (std::size_t i = 0; i < z.size(); ++i) g[i] += gradient_[i] + hessian_times_step(z, i);
}

}  // namespace subvol::internal
