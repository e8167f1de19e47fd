// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/energies/surface_term.h"
#include "subvol/fit/geometry/closest_point.h"
#include "subvol/fit/geometry/grouped_closest_point.h"
#include "subvol/fit/target/target_surface.h"

#include <memory>
#include <optional>

namespace subvol::internal {

/// Direction n in which the surfaces are drawn to each other; the first two differ in the second sum below only.
///
///   along_normals  the normal of the triangle that t(x_q) lies on. If t(x_q) is on an edge or a corner, x_q - t(x_q)
///                  may be perpendicular to it: then only tau pulls, and what sticks out there stays out.
///   straight       (x_q - t(x_q)) / |x_q - t(x_q)|, which is the normal up to sign if t(x_q) lies inside a smooth
///                  face. Curved cells get closer with it: the largest distance of a bust of 7 cells fell from 1.1 to
///                  0.7 % of the diagonal; that of a tangled mesh of 2,832 straight hexes rose from 0.49 to 0.50 %.
///   straight_both_ways  as `straight`, and (y_j - s(y_j)) / |y_j - s(y_j)| in the first sum: a tip of the target that
///                  the fitted surface falls short of draws it outward, however steep its flanks are.
enum class SurfacePull { along_normals, straight, straight_both_ways };

/// The surface energy of Eq. 9 with exact closest points in place of Voronoi cells.
///
///   E_S = 1/(2 A L^2) (sum_j a_j (y_j - s(y_j))^T M (y_j - s(y_j)) + sum_q b_q (x_q - t(x_q))^T M (x_q - t(x_q)))
///   M = n n^T + tau (I - n n^T),  n: unit normal of the target at y_j or t(x_q) (`SurfacePull`)
///
/// y_j, a_j   samples of the target and the area of each;  s(y): closest point of the triangulated surface S~
/// x_q, b_q   quadrature points of S~'s triangles with their areas;  t(x): closest point of the target
///
/// Nothing is known about a point cloud between its points, so the second sum is left out: the points attract S~, and
/// parts of S~ that are closest to no point are held by the cells alone. If t(x_q) lies on the boundary of the target,
/// x_q may be over a hole: it is not drawn to the boundary, but only to the plane that continues the target there, with
/// M = n n^T times
///
///   max(0, 1 - (d / 2L)^2)^2 (n . n_S)^2,   d = |x_q - t(x_q)|,  n_S: unit normal of S~
///
/// so that points of S~ are free if they are far from the boundary or S~ is perpendicular to the target there.
///
/// Voronoi cells assign every point of the target to one *sample*. Here it pulls at the closest point of S~, between
/// the samples: the pull is spread over the corners, and cells keep better shapes at the same distance. Frozen are the
/// barycentric coordinates of s(y_j), the points t(x_q), the normals and the areas. Results have the same bits for any
/// number of threads.
class ClosestPointEnergy final : public SurfaceTerm {
 public:
  /// target must outlive the energy. points_per_triangle: 1 or 3. InputError: as for `SurfaceEnergy`.
  ClosestPointEnergy(const TargetSurface& target, std::vector<std::array<Index, 3>> sample_triangles,
                     std::size_t num_samples, double tangential_weight, int points_per_triangle,
                     SurfacePull pull = SurfacePull::along_normals);

  /// Makes the part of an energy that belongs to some of its sample triangles; all others stay where they are. The
  /// whole must be assigned (`assign_target` suffices): a point of the target belongs to the part if it corresponds to
  /// one of these triangles there.
  ///
  /// triangles    of the whole, ascending.
  /// numbers      number in the part of each sample of the whole; kNoIndex for those outside. Corners of `triangles`
  ///              and the samples that `CreaseEnergy::mark_moving_curves` marks must be inside.
  /// is_free      one entry per sample of the part: 1 if it moves; all its triangles must belong to the part.
  ClosestPointEnergy(const ClosestPointEnergy& whole, std::span<const Index> triangles, std::span<const Index> numbers,
                     const std::vector<std::uint8_t>& is_free);

  /// From the next `assign` on, a correspondence of length d counts 1 + (d / length)^2 times: distant points are drawn
  /// more strongly than the mean requires, which keeps the largest distance down. length > 0 in the target's unit, else
  /// InputError.
  void emphasize_far(double length);

  /// From the next `assign` on, a point of S~ whose triangle's normal has a product below 0.2 with that of the target
  /// where it is closest counts only 0.02 times: next to a sharp edge, the closest point may lie on the wrong side.
  void discount_disagreeing() { discounts_ = true; }

  /// From the next `assign` on, correspondences at each sample triangle count so many times. One positive factor per
  /// sample triangle, else InputError.
  void weigh(std::vector<double> factors);

  /// Lets only parts of the same group correspond: patches of the fitted surface, and the regions of the target between
  /// sharp edges that they are to reproduce.
  /// of_triangle, of_target  group of each sample triangle and of each of the target's triangles, >= 0; parts of a
  ///                         group that the other surface lacks correspond to all of it. InputError: other numbers of
  ///                         them, or a cloud.
  void set_groups(std::vector<Index> of_triangle, std::span<const Index> of_target);

  /// Uses six points, including the corners, on each sample triangle with a nonzero entry, instead of
  /// `points_per_triangle`: S~ is farthest from the target on its edges. One entry per sample triangle, else
  /// InputError; must be called before `assign`.
  void refine(std::span<const std::uint8_t> triangles);

  /// Cost: one closest-point query per target sample and per quadrature point; none if the samples are those of the
  /// last call. Each search starts from the answer of the previous call, and the tree over S~ is refitted.
  void assign(std::span<const Vec3> samples) override;
  void forget() override;
  /// Finds the correspondences of the target's points only: all that the energies of parts take from this one. `assign`
  /// must follow before anything else is asked for.
  void assign_target(std::span<const Vec3> samples);

  /// Distances between the surfaces at the last `assign`, each the larger of both directions; means are weighted by
  /// area. Points over a boundary of the target count as distance 0.
  struct Distance {
    double mean, max;
  };
  Distance assigned_distance() const;
  /// Returns the largest of these distances at each sample triangle.
  std::vector<double> triangle_distances() const;
  /// The same, but the distances of the triangles' corners from the target count, too. Cost: a query per sample.
  std::vector<double> triangle_distances_with_corners() const;

 private:
  /// A correspondence between a point of the target and a point of one sample triangle.
  struct Link {
    Index triangle;
    std::array<double, 3> barycentric;
    Vec3 point, normal;
    double weight;      ///< area times emphasis
    double tangential;  ///< tau; 0 over a boundary
  };

  /// Returns the place of a used point of the target in its samples.
  std::size_t target_point(std::size_t j) const { return is_part_ ? static_cast<std::size_t>(used_[j]) : j; }

  /// Prepares a search for closest points, without memory of earlier ones if they are to be forgotten.
  void begin_search();
  /// Finds s(y_j) for all samples of the target.
  void find_target(std::span<const Vec3> samples);
  void link_target(std::span<const Vec3> samples);
  /// finds  false: t(x_q) is known for these samples.
  void link_surface(std::span<const Vec3> samples, bool finds);
  bool over_rim(const ClosestPoint::Hit& hit) const;
  double share_over_rim(const Link& link, const ClosestPoint::Hit& hit, std::span<const Vec3> samples) const;
  void add_link(const Link& link, const Incidence& incidence, Row& row, double& value) const;

  const TargetSurface* target_;
  std::shared_ptr<const GroupedClosestPoint> target_tree_;  ///< null for a cloud
  std::optional<GroupedClosestPoint> surface_tree_;         ///< tree over S~
  std::vector<Index> groups_, sample_groups_;  ///< of each sample triangle and target sample; empty: no groups
  Index group(std::size_t triangle) const { return groups_.empty() ? 0 : groups_[triangle]; }
  bool is_part_ = false;  ///< only the target's samples in used_ count
  std::vector<Index> used_;
  std::vector<Vec3> used_points_;               ///< their positions
  std::vector<ClosestPoint::Hit> target_hits_;  ///< s(y_j)
  double emphasis(double distance) const { return 1 + distance * distance * inverse_far_ * inverse_far_; }

  double tau_, scale_, inverse_far_ = 0;
  SurfacePull pull_;
  bool discounts_ = false;
  std::vector<double> factors_;  ///< per sample triangle; empty: all 1
  double factor(Index triangle) const { return factors_.empty() ? 1 : factors_[triangle]; }
  std::vector<Link> target_links_;               ///< ordered by sample triangle
  std::vector<std::size_t> target_offsets_;      ///< where each sample triangle begins in target_links_
  std::vector<std::size_t> hit_of_link_;         ///< place in target_hits_ of each of target_links_
  std::vector<Link> surface_links_;              ///< ordered by sample triangle
  std::vector<std::size_t> surface_offsets_;     ///< where each sample triangle begins in surface_links_
  std::vector<ClosestPoint::Hit> surface_hits_;  ///< t(x_q)
  std::vector<double> surface_distances_;        ///< |x_q - t(x_q)|; 0 over a boundary
  bool is_found_ = false;                        ///< the closest points are those of the assigned samples
  bool is_fresh_ = false;                        ///< they were found without memory of earlier ones
  bool is_forgotten_ = true;                     ///< the next search must not remember earlier ones
};

}  // namespace subvol::internal
