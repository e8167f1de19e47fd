// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/energies/surface_energy.h"

#include "subvol/base/error.h"

#include <Eigen/Geometry>

#include <algorithm>

namespace subvol::internal {

namespace {

const TargetSurface& with_triangles(const TargetSurface& target) {
  if (target.is_cloud()) throw InputError("SurfaceEnergy: Voronoi cells need a target of triangles, not of points");
  return target;
}

double checked_weight(double tau) {
  if (!(tau >= 0 && tau <= 1)) throw InputError("SurfaceEnergy: tangential_weight must be in [0, 1]");
  return tau;
}

}  // namespace

SurfaceEnergy::SurfaceEnergy(const TargetSurface& target, std::vector<std::array<Index, 3>> sample_triangles,
                             std::size_t num_samples, double tangential_weight)
    : SurfaceTerm(std::move(sample_triangles), num_samples),
      target_(&with_triangles(target)),
      tau_(checked_weight(tangential_weight)),
      scale_(1 / (2 * target.area() * target.length() * target.length())),
      target_sites_(target.samples()) {}

void SurfaceEnergy::index_pieces() {
  const std::size_t n = num_samples();
  site_offsets_.assign(n + 1, 0);
  for (const VoronoiPiece& piece : target_pieces_) ++site_offsets_[piece.site + 1];
  for (std::size_t i = 0; i < n; ++i) site_offsets_[i + 1] += site_offsets_[i];
  site_pieces_.resize(target_pieces_.size());
  for (std::size_t p = target_pieces_.size(); p-- > 0;)
    site_pieces_[--site_offsets_[target_pieces_[p].site + 1]] = static_cast<Index>(p);
  // Filling from behind has moved the end of every range to its beginning.
  site_offsets_.erase(site_offsets_.begin());
  site_offsets_.push_back(target_pieces_.size());

  triangle_offsets_.assign(triangles().size() + 1, 0);
  for (const VoronoiPiece& piece : sample_pieces_) ++triangle_offsets_[piece.triangle + 1];
  for (std::size_t t = 0; t < triangles().size(); ++t) triangle_offsets_[t + 1] += triangle_offsets_[t];
}

void SurfaceEnergy::assign(std::span<const Vec3> samples) {
  begin_assign(samples);
  if (sample_sites_)
    sample_sites_->update_sites(samples);
  else
    sample_sites_.emplace(samples);
  sample_sites_->compute(target_->positions(), target_->triangles(), target_pieces_);
  target_sites_.compute(samples, triangles(), sample_pieces_);
  index_pieces();
  assemble(scale_, [this](std::size_t i, Row& row) {
    add_target_pieces(i, row);
    add_sample_pieces(i, row);
  });
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
    // All points of the triangle have the same distance along its normal.
    const double height = n.dot(d[0]);
    row.target_to_surface += area * (tau_ * squares + (1 - tau_) * share * height * height);
    row.gradient -= 2 * area * (tau_ * mean + ((1 - tau_) * share * height) * n);
    block += (2 * area * share * (1 - tau_)) * n * n.transpose();
    block.diagonal().array() += 2 * area * share * tau_;
  }
}

void SurfaceEnergy::add_sample_pieces(std::size_t sample, Row& row) const {
  for (const Incidence& incidence : incidences(sample)) {
    const auto& corners = triangles()[incidence.triangle];
    const double area = triangle_area(incidence.triangle);
    for (std::size_t p = triangle_offsets_[incidence.triangle]; p < triangle_offsets_[incidence.triangle + 1]; ++p) {
      const VoronoiPiece& piece = sample_pieces_[p];
      const Vec3& y = target_->samples()[piece.site];
      const Vec3& n = target_->sample_normals()[piece.site];
      const Mat3 metric = (1 - tau_) * n * n.transpose() + Mat3(Vec3::Constant(tau_).asDiagonal());
      Vec3 weighted = Vec3::Zero();
      for (int l = 0; l < 3; ++l) {
        const double moment = piece.moment(incidence.corner, l);
        weighted += moment * (assigned()[corners[l]] - y);
        row.blocks[incidence.entries[l]] += (2 * area * moment) * metric;
      }
      const Vec3 pull = metric * weighted;
      row.surface_to_target += area * pull.dot(row.position - y);
      row.gradient += 2 * area * pull;
    }
  }
}

}  // namespace subvol::internal
