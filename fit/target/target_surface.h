// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/fit/target/soup_topology.h"
#include "subvol/surface/point_cloud.h"
#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace subvol {

namespace internal {
class GroupedClosestPoint;
}

struct TargetSurfaceOptions {
  /// Triangles with longer edges are sampled more than once; > 0, in the mesh's unit. 0: one sample per triangle.
  double sample_spacing = 0;
  /// Enclosed volume, > 0, if it is known: of the boundary alone, if the triangles of interfaces are among them. 0: it
  /// is found.
  double volume = 0;
};

/// The weight of each point of a cloud.
enum class PointWeights {
  equal,   ///< the same for all: dense parts count more (default)
  by_area  ///< the area that it represents (`cloud_geometry.h`): scans of uneven density count evenly
};
/// Returns the word for weights in options.
const char* to_string(PointWeights weights);

/// How the enclosed volume was found.
enum class VolumeSource {
  signed_sum,  ///< sum of the triangles' signed tetrahedra: the surface is closed, up to small gaps, and oriented, all
               ///< of its parts as their nesting asks for
  mended,      ///< that sum after orienting triangles and closing holes (`solid_boundary`)
  flood,       ///< grid cells that cannot be reached from outside: any orientation, holes smaller than a cell
  isoperimetric,  ///< half the volume of the sphere of equal area: the surface encloses nothing
  given           ///< set by the caller
};
/// Returns the source in words, as it stands in reports.
const char* to_string(VolumeSource source);

/// The target as the energies need it: triangles with normals, area A, enclosed volume V and samples; or points.
///
/// A soup is allowed: connectivity, orientation and closedness do not matter, except for V (see `VolumeSource`). A
/// point cloud has only samples, which are its points; their normals and the area are estimated (`cloud_geometry.h`).
class TargetSurface {
 public:
  /// mesh   must have finite positions of its triangles' corners, corner numbers in range, at least one triangle with
  ///        an area, and an extent between 1e-40 and 1e40, else InputError. Triangles without area are dropped;
  ///        the others keep their order.
  explicit TargetSurface(const TriangleMesh& mesh, const TargetSurfaceOptions& options = {});
  /// InputError: fewer than two points, a position that is not finite, an extent as above, or points that lie on each
  /// other in groups, so that they have no area.
  explicit TargetSurface(const PointCloud& cloud, PointWeights weights = PointWeights::equal);

  /// Returns the center of the bounding box that the target made of a surface has. InputError: as the constructor.
  static Vec3 center_of(const TriangleMesh& mesh);

  /// True if there are only points: no triangles, nothing to integrate over.
  bool is_cloud() const { return triangles_.empty(); }
  const std::vector<Vec3>& positions() const { return positions_; }
  const std::vector<std::array<Index, 3>>& triangles() const { return triangles_; }
  /// Unit normal of each triangle, oriented by the order of its corners, and its area.
  const std::vector<Vec3>& normals() const { return normals_; }
  const std::vector<double>& areas() const { return areas_; }
  /// Topology of the triangles; empty for a cloud.
  const SoupTopology& edges() const { return edges_; }
  /// True if a triangle has a boundary edge, or a corner on one.
  bool has_rim(Index triangle) const { return rim_parts_[triangle] != 0; }
  /// True if a point of a triangle, given by its barycentric coordinates, lies on a boundary edge. A place whose
  /// closest point is on the boundary may belong to a part that the surface lacks.
  bool on_rim(Index triangle, const std::array<double, 3>& barycentric) const;
  /// Approximate number of vertices of the surface, or number of points of a cloud.
  std::size_t num_details() const { return is_cloud() ? samples_.size() : triangles_.size() / 2; }

  double area() const { return area_; }      ///< A > 0
  double volume() const { return volume_; }  ///< V > 0
  VolumeSource volume_source() const { return volume_source_; }
  /// Sets V, for a surface that encloses nothing. InputError: not positive and finite.
  void set_volume(double volume);
  /// L = V / A, the length that makes the surface energy dimensionless.           Paper: Eq. 9
  double length() const { return volume_ / area_; }
  double diagonal() const { return diagonal_; }  ///< diagonal of the bounding box
  Vec3 center() const { return center_; }        ///< center of the bounding box

  /// Points on the surface: the barycenters of the triangles or, if an edge is longer than the spacing, those of the
  /// parts that result from repeatedly halving the longest edge. If that would make millions, triangles far thinner
  /// than the spacing have fewer, by their areas. For a cloud, its points.
  const std::vector<Vec3>& samples() const { return samples_; }
  /// The triangle that each sample lies in; empty for a cloud.
  const std::vector<Index>& sample_triangles() const { return sample_triangles_; }
  /// The unit normal at each sample, and the area that it represents; the areas add up to A.
  const std::vector<Vec3>& sample_normals() const { return sample_normals_; }
  const std::vector<double>& sample_areas() const { return sample_areas_; }
  /// Tree over the triangles, which all energies share; null for a cloud. Built by the first call, which must not run
  /// beside another one.
  std::shared_ptr<const internal::GroupedClosestPoint> tree() const;
  /// Returns a tree over the triangles by group; the same one as long as it is asked for with the same groups. Not for
  /// a cloud. Not to be called in parallel. groups  of each triangle, as for `GroupedClosestPoint`.
  std::shared_ptr<const internal::GroupedClosestPoint> tree(std::span<const Index> groups) const;
  /// Samples the surface anew with another spacing. A cloud keeps its points. InputError: the spacing is negative, not
  /// finite, or far too small.
  void resample(double spacing);
  /// Keeps at most so many samples, which then stand for all: of the samples in the order of the tree's triangles,
  /// where neighbors in space are mostly neighbors, those in the middle of equal parts of the area. A cloud keeps its
  /// points.
  /// InputError: most = 0.
  void thin(std::size_t most);

 private:
  TargetSurface() = default;
  /// Takes the triangles that have an area.
  void take_triangles(const TriangleMesh& mesh);
  /// Samples all triangles. Returns false, and leaves samples of some, if there would be more than `most`.
  /// thins_needles  if triangles are far thinner than the spacing, the number of their samples depends on their areas.
  bool take_samples(double spacing, std::size_t most, bool thins_needles);
  /// Adds samples of a triangle; ends early if there are more than `most` in all.
  void add_samples(const std::array<Vec3, 3>& corners, double spacing, std::size_t most);
  /// Adds samples in equal parts of the area of a thin triangle.
  void add_along_needle(const std::array<Vec3, 3>& corners, std::size_t triangle, std::size_t count);
  void set_box(const Vec3& low, const Vec3& high);

  mutable std::shared_ptr<const internal::GroupedClosestPoint> tree_, tree_by_group_;
  mutable std::vector<Index> groups_of_tree_;  ///< of tree_by_group_
  std::vector<Vec3> positions_, normals_, samples_, sample_normals_;
  std::vector<std::array<Index, 3>> triangles_;
  std::vector<double> areas_, sample_areas_;
  SoupTopology edges_;
  std::vector<std::uint8_t> rim_parts_;
  std::vector<Index> sample_triangles_;
  double area_ = 0, volume_ = 0, diagonal_ = 0;
  VolumeSource volume_source_ = VolumeSource::signed_sum;
  Vec3 center_ = Vec3::Zero();
};

}  // namespace subvol
