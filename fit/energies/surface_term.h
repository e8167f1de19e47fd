// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/energies/block_sparse.h"
#include "subvol/fit/features/crease_energy.h"

#include <omp.h>

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace subvol::internal {

/// A surface energy with frozen correspondences. Once assigned, it is an exact quadratic in the samples z,
///
///   E(z) = E(z0) + g . (z - z0) + 1/2 (z - z0) . H (z - z0)
///
/// that couples the corners of each sample triangle. The derived class determines the correspondences.
class SurfaceTerm {
 public:
  virtual ~SurfaceTerm() = default;

  /// Takes the samples' positions (num_samples, finite, else InputError), finds their correspondences and freezes them.
  /// Must be called before the functions below.
  virtual void assign(std::span<const Vec3> samples) = 0;

  /// Drops the state of earlier assignments that speeds up the next one, if the choice between equally close points may
  /// depend on it. The next assignment is then a function of the samples alone.
  virtual void forget() {}

  /// Adds creases whose segments that move are edges of sample triangles (else InputError); to be called before
  /// `assign`.
  void add_creases(CreaseEnergy creases);

  /// E(z) with frozen correspondences. It is computed relative to the assigned samples, so that differences of nearby
  /// values are accurate.
  double value(std::span<const Vec3> z) const;
  /// g += dE/dz with frozen correspondences: one entry per sample, in 1/length. Cost: one product with the Hessian.
  void add_gradient(std::span<const Vec3> z, std::span<Vec3> g) const;
  /// d2E/dz2, constant between assignments; positive semidefinite up to single precision. Every row has its diagonal
  /// block.
  const BlockSparse& hessian() const { return hessian_; }

  /// The two parts of E at the assigned samples.
  double target_to_surface() const { return target_to_surface_; }
  double surface_to_target() const { return surface_to_target_; }
  std::size_t num_samples() const { return incidence_offsets_.size() - 1; }
  std::span<const std::array<Index, 3>> triangles() const { return triangles_; }
  const std::optional<CreaseEnergy>& creases() const { return creases_; }

 protected:
  /// One corner of a sample triangle, as seen from its sample: `entries` are the places of its blocks in that sample's
  /// row.
  struct Incidence {
    Index triangle;
    int corner;
    std::array<Index, 3> entries;
  };
  /// Sums of one sample: its part of the value, its gradient, and its row of the Hessian.
  struct Row {
    double target_to_surface, surface_to_target;
    Vec3 gradient;
    std::vector<Mat3> blocks;
    std::size_t diagonal;
    Vec3 position;
  };

  /// InputError: no samples, or a corner outside [0, num_samples).
  SurfaceTerm(std::vector<std::array<Index, 3>> sample_triangles, std::size_t num_samples);

  std::span<const Incidence> incidences(std::size_t sample) const {
    return {incidences_.data() + incidence_offsets_[sample],
            incidence_offsets_[sample + 1] - incidence_offsets_[sample]};
  }
  const std::vector<Vec3>& assigned() const { return assigned_; }
  double triangle_area(std::size_t t) const { return triangle_areas_[t]; }

  /// Remembers the samples and the areas of their triangles. Must be called first in `assign`.
  void begin_assign(std::span<const Vec3> samples);
  /// Sums every sample's row with add_row(sample, row) and multiplies all by `scale`. Must be called last in `assign`.
  template <class AddRow>
  void assemble(double scale, const AddRow& add_row);

 private:
  void add_crease_links(std::size_t sample, Row& row) const;
  /// Row i of H (z - assigned samples).
  Vec3 hessian_times_step(std::span<const Vec3> z, std::size_t i) const;

  std::vector<std::array<Index, 3>> triangles_;
  std::vector<std::size_t> incidence_offsets_;
  std::vector<Incidence> incidences_;
  std::vector<double> triangle_areas_;
  std::vector<Vec3> assigned_, gradient_;
  BlockSparse hessian_;
  double target_to_surface_ = 0, surface_to_target_ = 0;
  std::optional<CreaseEnergy> creases_;
};

/// Returns the sum of f(i) over [0, n), in slices of fixed size: the same bits for any number of threads.
template <class Function>
double sliced_sum(std::size_t n, const Function& f) {
  constexpr std::size_t kSlice = 1024;  // large enough that starting a thread's slice costs nothing
  std::vector<double> sums((n + kSlice - 1) / kSlice, 0.0);
#pragma omp parallel for schedule(static)
  for (std::size_t s = 0; s < sums.size(); ++s)
    for (std::size_t i = s * kSlice; i < std::min(n, (s + 1) * kSlice); ++i) sums[s] += f(i);
  double sum = 0;
  for (double part : sums) sum += part;
  return sum;
}

template <class AddRow>
void SurfaceTerm::assemble(double scale, const AddRow& add_row) {
  const std::size_t n = num_samples();
  std::vector<double> to_surface(n), to_target(n);
  std::size_t longest = 0;
  for (std::size_t i = 0; i < n; ++i) longest = std::max(longest, hessian_.offsets[i + 1] - hessian_.offsets[i]);
  std::vector<Row> rows(omp_get_max_threads());  // allocated here, so that a failure can be reported
  for (Row& row : rows) row.blocks.reserve(longest);
#pragma omp parallel
  {
    Row row = std::move(rows[omp_get_thread_num()]);
#pragma omp for schedule(dynamic, 256)
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t begin = hessian_.offsets[i], size = hessian_.offsets[i + 1] - begin;
      row.target_to_surface = row.surface_to_target = 0;
      row.gradient = Vec3::Zero();
      row.blocks.assign(size, Mat3::Zero());
      row.diagonal = hessian_.find(static_cast<Index>(i), static_cast<Index>(i)) - begin;
      row.position = assigned_[i];
      add_row(i, row);
      if (creases_) add_crease_links(i, row);
      to_surface[i] = row.target_to_surface;
      to_target[i] = row.surface_to_target;
      gradient_[i] = scale * row.gradient;
      for (std::size_t k = 0; k < size; ++k)
        for (int e = 0; e < 9; ++e)
          hessian_.block(begin + k)[e] = static_cast<float>(scale * row.blocks[k](e / 3, e % 3));
    }
  }
  target_to_surface_ = scale * sliced_sum(n, [&](std::size_t i) { return to_surface[i]; });
  surface_to_target_ = scale * sliced_sum(n, [&](std::size_t i) { return to_target[i]; });
}

}  // namespace subvol::internal
