// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/energies/surface_term.h"
#include "fit/geometry/closest_point.h"
#include "fit/target/target_surface.h"

#include <optional>

namespace subvol {

/// How places of the fitted surface are drawn to the target: n of the second sum below.
///
///   along_normals  the normal of the triangle that t(x_q) lies on. Where t(x_q) is on an edge or a corner, the way
///                  back may be square to it: only tau pulls, and what sticks out there stays out.
///   straight       (x_q - t(x_q)) / |x_q - t(x_q)|, which is the normal where t(x_q) lies within a smooth face. Curved
///                  cells get nearer with it: the largest distance of a bust of 7 cells fell from 1.1 to 0.7 % of the
///                  diagonal, while that of a tangled mesh of 2,832 straight hexes rose from 0.49 to 0.50 %.
enum class SurfacePull { along_normals, straight };

/// The surface energy of Eq. 9 with exact closest points in place of Voronoi cells.
///
///   E_S = 1/(2 A L^2) (sum_j a_j (y_j - s(y_j))^T M (y_j - s(y_j)) + sum_q b_q (x_q - t(x_q))^T M (x_q - t(x_q)))
///   M = n n^T + tau (I - n n^T),  n: unit normal of the target at y_j or t(x_q) (`SurfacePull`)
///
/// y_j, a_j   samples of the target and the area each stands for;  s(y): closest point of the triangulated surface S~
/// x_q, b_q   quadrature points of S~'s triangles with their areas;  t(x): closest point of the target
///
/// Of a point cloud nothing is known between its points, so the second sum is left out: they pull at S~, and what no
/// point is nearest to is held by the cells alone. Where t(x_q) lies on an open edge of the target, x_q may be over a
/// hole: it is not drawn to the rim, but only to the plane that continues the target there, with M = n n^T times
///
///   max(0, 1 - (d / 2L)^2)^2 (n . n_S)^2,   d = |x_q - t(x_q)|,  n_S: unit normal of S~
///
/// so that places that are far from the rim, or where S~ runs another way, are free.
///
/// Where Voronoi cells hand every point of the target to one *sample*, here it pulls at the place of S~ that is
/// closest, between the samples: the pull is spread over the corners, and cells are left better shaped at the same
/// distance. Frozen: the barycentric coordinates of s(y_j), the points t(x_q), normals and areas. Same bits for any
/// thread count.
class ClosestPointEnergy final : public SurfaceTerm {
 public:
  /// target must outlive the energy. points_per_triangle: 1 or 3. InputError: as `SurfaceEnergy`.
  ClosestPointEnergy(const TargetSurface& target, std::vector<std::array<Index, 3>> sample_triangles,
                     std::size_t num_samples, double tangential_weight, int points_per_triangle,
                     SurfacePull pull = SurfacePull::along_normals);

  /// From the next `assign` on a tie of length d counts 1 + (d / length)^2 times: places that are far off are drawn
  /// more than the mean asks for, which keeps the largest distance down. length > 0 in the target's unit, else
  /// InputError.
  void emphasize_far(double length);

  /// Six points, the corners among them, on each sample triangle with a 1, whatever `points_per_triangle` says: where
  /// S~ is farthest off is on edges. One entry per sample triangle, else InputError; to be called before `assign`.
  void refine(std::span<const std::uint8_t> triangles);

  /// Cost: one closest-point query per target sample and per quadrature point. The answers of the call before are where
  /// the search starts, and the tree over S~ moves along.
  void assign(std::span<const Vec3> samples) override;
  void forget() override;

  /// Distances between the surfaces as the last `assign` saw them: the larger of both ways, each over its points by
  /// area; what lies over a rim of the target does not count.
  struct Distance {
    double mean, max;
  };
  Distance assigned_distance() const;
  /// The largest of them at each sample triangle.
  std::vector<double> triangle_distances() const;

 private:
  /// A point of the target tied to a point of one sample triangle.
  struct Link {
    Index triangle;
    std::array<double, 3> barycentric;
    Vec3 point, normal;
    double weight;      ///< area, and emphasis
    double tangential;  ///< tau, or less
  };

  void link_target(std::span<const Vec3> samples);
  void link_surface(std::span<const Vec3> samples);
  bool over_rim(const ClosestPoint::Hit& hit) const;
  double share_over_rim(const Link& link, const ClosestPoint::Hit& hit, std::span<const Vec3> samples) const;
  void add_link(const Link& link, const Incidence& incidence, Row& row, double& value) const;

  const TargetSurface* target_;
  std::optional<ClosestPoint> target_tree_;        ///< none for a cloud
  std::optional<ClosestPoint> surface_tree_;       ///< of S~
  std::vector<ClosestPoint::Hit> target_hits_;     ///< s(y_j)
  double emphasis(double distance) const { return 1 + distance * distance * inverse_far_ * inverse_far_; }

  double tau_, scale_, inverse_far_ = 0;
  SurfacePull pull_;
  std::vector<Link> target_links_;           ///< by sample triangle
  std::vector<std::size_t> target_offsets_;  ///< of each sample triangle in target_links_
  std::vector<Link> surface_links_;          ///< by sample triangle
  std::vector<std::size_t> surface_offsets_; ///< of each sample triangle in surface_links_
  std::vector<Index> surface_hints_;         ///< target triangles of t(x_q)
  std::vector<double> surface_distances_;    ///< |x_q - t(x_q)|
};

}  // namespace subvol
