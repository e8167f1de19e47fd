// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/fit/energies/surface_term.h"
#include "subvol/fit/geometry/restricted_voronoi.h"
#include "subvol/fit/target/target_surface.h"

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace subvol::internal {

/// Squared distance between the fitted surface S, given by samples z, and the target T, both ways, with frozen cells.
///
///   E_S = 1/(2 A L^2) (F_TS + F_ST),  L = V/A                                        Paper: Eq. 9
///   F_TS = sum_i integral over Vor(z_i) cut with T   of (y - z_i)^T M(y) (y - z_i) dy
///   F_ST = sum_j integral over Vor(y_j) cut with S~  of (x - y_j)^T M(y_j) (x - y_j) dx
///   M = n n^T + tau (I - n n^T),  n: unit normal of T's triangle at y, or of the one that y_j was sampled from
///
/// A, V, y_j   area, enclosed volume and samples of the target.
/// S~          triangles between samples; x moves linearly with their corners.
/// tau         tangential weight in [0, 1]: small if the surfaces are close, so that samples slide along T.
///
/// `assign` finds the cells and freezes them: the site that every point belongs to, given by its barycentric
/// coordinates in its triangle, and dx. E_S is then quadratic in z. Its gradient is exact for moving cells only for
/// F_TS with tau = 1; otherwise it neglects the motion of the cells and of dx, which is considerable for small tau.
/// E_S is dimensionless, >= 0, and invariant if both surfaces undergo the same similarity. Results have the same bits
/// for any number of threads.
class SurfaceEnergy final : public SurfaceTerm {
 public:
  /// target must outlive the energy. InputError: no samples, a corner outside [0, num_samples), tau outside [0, 1], or
  /// a target that is a point cloud.
  SurfaceEnergy(const TargetSurface& target, std::vector<std::array<Index, 3>> sample_triangles,
                std::size_t num_samples, double tangential_weight);

  /// Cost: nearly all of the time that a fit spends on its surface term; see `RestrictedVoronoi::compute`.
  void assign(std::span<const Vec3> samples) override;

  double tangential_weight() const { return tau_; }

 private:
  void index_pieces();
  void add_target_pieces(std::size_t sample, Row& row) const;
  void add_sample_pieces(std::size_t sample, Row& row) const;

  const TargetSurface* target_;
  double tau_, scale_;
  RestrictedVoronoi target_sites_;
  std::optional<RestrictedVoronoi> sample_sites_;
  std::vector<VoronoiPiece> target_pieces_, sample_pieces_;  ///< pieces of T's triangles; of S~'s
  std::vector<std::size_t> site_offsets_, triangle_offsets_;
  std::vector<Index> site_pieces_;  ///< indices into `target_pieces_`, ordered by site
};

}  // namespace subvol::internal
