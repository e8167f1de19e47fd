// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/surface_energy.h"

#include "subvol/error.h"

#include <Eigen/Geometry>

#include <algorithm>

namespace subvol {

namespace {

/// Sum of f(i) over [0, n) in slices of fixed size: the same bits for any number of threads.
template <class Function>
double sliced_sum(std::size_t n, const Function& f) {
  constexpr std::size_t kSlice = 1024;
  std::vector<double> sums((n + kSlice - 1) / kSlice, 0.0);
#pragma omp parallel for schedule(static)
  for (std::size_t s = 0; s < sums.size(); ++s)
    for (std::size_t i = s * kSlice; i < std::min(n, (s + 1) * kSlice); ++i) sums[s] += f(i);
  double sum = 0;
  for (double part : sums) sum += part;
  return sum;
}

std::vector<std::size_t> clique_offsets(std::size_t num_triangles) {
  std::vector<std::size_t> offsets(num_triangles + 1);
  for (std::size_t t = 0; t <= num_triangles; ++t) offsets[t] = 3 * t;
  return offsets;
}

double checked_weight(double tau) {
  if (!(tau >= 0 && tau <= 1)) throw InputError("SurfaceEnergy: tangential_weight must be in [0, 1]");
  return tau;
}

}  // namespace

/// Sums of one sample: its part of the value, its gradient, its row of the Hessian.
struct SurfaceEnergy::Row {
  double target_to_surface, surface_to_target;
  Vec3 gradient;
  std::vector<Mat3> blocks;
  std::size_t diagonal;
  Vec3 position;
};

SurfaceEnergy::SurfaceEnergy(const TargetSurface& target, std::vector<std::array<Index, 3>> sample_triangles,
                             std::size_t num_samples, double tangential_weight)
    : target_(&target),
      triangles_(std::move(sample_triangles)),
      tau_(checked_weight(tangential_weight)),
      scale_(1 / (2 * target.area() * target.length() * target.length())),
      target_sites_(target.samples()) {
  if (num_samples == 0) throw InputError("SurfaceEnergy: num_samples must be positive");
  const std::span<const Index> corners(triangles_.empty() ? nullptr : triangles_[0].data(), 3 * triangles_.size());
  hessian_ = clique_pattern(num_samples, clique_offsets(triangles_.size()), corners);
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

void SurfaceEnergy::index_pieces() {
  const std::size_t n = num_samples();
  site_offsets_.assign(n + 1, 0);
  for (const VoronoiPiece& piece : target_pieces_) ++site_offsets_[piece.site + 1];
  for (std::size_t i = 0; i < n; ++i) site_offsets_[i + 1] += site_offsets_[i];
  site_pieces_.resize(target_pieces_.size());
  for (std::size_t p = target_pieces_.size(); p-- > 0;)
    site_pieces_[--site_offsets_[target_pieces_[p].site + 1]] = static_cast<Index>(p);
  // Filling from behind has moved every end to its beginning.
  site_offsets_.erase(site_offsets_.begin());
  site_offsets_.push_back(target_pieces_.size());

  triangle_offsets_.assign(triangles_.size() + 1, 0);
  for (const VoronoiPiece& piece : sample_pieces_) ++triangle_offsets_[piece.triangle + 1];
  for (std::size_t t = 0; t < triangles_.size(); ++t) triangle_offsets_[t + 1] += triangle_offsets_[t];
}

void SurfaceEnergy::assign(std::span<const Vec3> samples) {
  if (samples.size() != num_samples()) throw InputError("SurfaceEnergy::assign: samples must be num_samples positions");
  assigned_.assign(samples.begin(), samples.end());
  if (sample_sites_)
    sample_sites_->update_sites(samples);
  else
    sample_sites_.emplace(samples);
  sample_sites_->compute(target_->positions(), target_->triangles(), target_pieces_);
  target_sites_.compute(samples, triangles_, sample_pieces_);
  index_pieces();

  triangle_areas_.resize(triangles_.size());
#pragma omp parallel for schedule(static)
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    const Vec3& a = samples[triangles_[t][0]];
    triangle_areas_[t] = 0.5 * (samples[triangles_[t][1]] - a).cross(samples[triangles_[t][2]] - a).norm();
  }
  std::vector<double> to_surface(samples.size()), to_target(samples.size());
#pragma omp parallel
  {
    Row row;
#pragma omp for schedule(dynamic, 256)
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const std::size_t begin = hessian_.offsets[i], size = hessian_.offsets[i + 1] - begin;
      row.target_to_surface = row.surface_to_target = 0;
      row.gradient = Vec3::Zero();
      row.blocks.assign(size, Mat3::Zero());
      row.diagonal = hessian_.find(static_cast<Index>(i), static_cast<Index>(i)) - begin;
      row.position = samples[i];
      add_target_pieces(i, row);
      add_sample_pieces(i, row);
      to_surface[i] = row.target_to_surface;
      to_target[i] = row.surface_to_target;
      gradient_[i] = scale_ * row.gradient;
      for (std::size_t k = 0; k < size; ++k)
        for (int e = 0; e < 9; ++e)
          hessian_.block(begin + k)[e] = static_cast<float>(scale_ * row.blocks[k](e / 3, e % 3));
    }
  }
  target_to_surface_ = scale_ * sliced_sum(samples.size(), [&](std::size_t i) { return to_surface[i]; });
  surface_to_target_ = scale_ * sliced_sum(samples.size(), [&](std::size_t i) { return to_target[i]; });
}

void SurfaceEnergy::add_target_pieces(std::size_t sample, Row& row) const {
  Mat3& block = row.blocks[row.diagonal];
  for (std::size_t k = site_offsets_[sample]; k < site_offsets_[sample + 1]; ++k) {
    const VoronoiPiece& piece = target_pieces_[site_pieces_[k]];
    const auto& corners = target_->triangles()[piece.triangle];
    const Vec3& n = target_->normals()[piece.triangle];
    const double area = target_->areas()[piece.triangle], share = piece.share();
    Vec3 d[3], mean = Vec3::Zero();
    double squares = 0;
    for (int p = 0; p < 3; ++p) d[p] = target_->positions()[corners[p]] - row.position;
    for (int p = 0; p < 3; ++p) {
      const Vec3 weighted = piece.moment(p, 0) * d[0] + piece.moment(p, 1) * d[1] + piece.moment(p, 2) * d[2];
      squares += d[p].dot(weighted);
      mean += weighted;
    }
    // The whole triangle is equally far along its normal.
    const double height = n.dot(d[0]);
    row.target_to_surface += area * (tau_ * squares + (1 - tau_) * share * height * height);
    row.gradient -= 2 * area * (tau_ * mean + ((1 - tau_) * share * height) * n);
    block += (2 * area * share * (1 - tau_)) * n * n.transpose();
    block.diagonal().array() += 2 * area * share * tau_;
  }
}

void SurfaceEnergy::add_sample_pieces(std::size_t sample, Row& row) const {
  for (std::size_t k = incidence_offsets_[sample]; k < incidence_offsets_[sample + 1]; ++k) {
    const Incidence& incidence = incidences_[k];
    const auto& corners = triangles_[incidence.triangle];
    const double area = triangle_areas_[incidence.triangle];
    for (std::size_t p = triangle_offsets_[incidence.triangle]; p < triangle_offsets_[incidence.triangle + 1]; ++p) {
      const VoronoiPiece& piece = sample_pieces_[p];
      const Vec3& y = target_->samples()[piece.site];
      const Vec3& n = target_->normals()[target_->sample_triangles()[piece.site]];
      const Mat3 metric = (1 - tau_) * n * n.transpose() + Mat3(Vec3::Constant(tau_).asDiagonal());
      Vec3 weighted = Vec3::Zero();
      for (int l = 0; l < 3; ++l) {
        const double moment = piece.moment(incidence.corner, l);
        weighted += moment * (assigned_[corners[l]] - y);
        row.blocks[incidence.entries[l]] += (2 * area * moment) * metric;
      }
      const Vec3 pull = metric * weighted;
      row.surface_to_target += area * pull.dot(row.position - y);
      row.gradient += 2 * area * pull;
    }
  }
}

Vec3 SurfaceEnergy::hessian_times_step(std::span<const Vec3> z, std::size_t i) const {
  Vec3 product = Vec3::Zero();
  for (std::size_t k = hessian_.offsets[i]; k < hessian_.offsets[i + 1]; ++k) {
    const float* b = hessian_.block(k);
    const Vec3 d = z[hessian_.columns[k]] - assigned_[hessian_.columns[k]];
    for (int r = 0; r < 3; ++r) product[r] += b[3 * r] * d[0] + b[3 * r + 1] * d[1] + b[3 * r + 2] * d[2];
  }
  return product;
}

double SurfaceEnergy::value(std::span<const Vec3> z) const {
  if (z.size() != num_samples() || assigned_.empty())
    throw InputError("SurfaceEnergy::value: z must be num_samples positions, after assign");
  const double change = sliced_sum(z.size(), [&](std::size_t i) {
    return (z[i] - assigned_[i]).dot(gradient_[i] + 0.5 * hessian_times_step(z, i));
  });
  return target_to_surface_ + surface_to_target_ + change;
}

void SurfaceEnergy::add_gradient(std::span<const Vec3> z, std::span<Vec3> g) const {
  if (z.size() != num_samples() || g.size() != num_samples() || assigned_.empty())
    throw InputError("SurfaceEnergy::add_gradient: z and g must have num_samples entries, after assign");
#pragma omp parallel for schedule(static)
  for (std::size_t i = 0; i < z.size(); ++i) g[i] += gradient_[i] + hessian_times_step(z, i);
}

}  // namespace subvol
