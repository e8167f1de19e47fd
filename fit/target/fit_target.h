// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/geometry/closest_point.h"
#include "subvol/fit/geometry/surface_distance.h"
#include "subvol/fit/target/normalization.h"
#include "subvol/fit/target/target_report.h"
#include "subvol/fit/target/target_surface.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/region_surface.h"

#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <vector>

namespace subvol::internal {

/// The surface that a fit approximates, in normalized coordinates: lengths are shares of the target's diagonal.
struct FitTarget {
  Normalization normalization;
  TriangleMesh mesh;                 ///< without triangles: the target is a cloud
  std::optional<ClosestPoint> tree;  ///< tree over the triangles; none for a cloud
  TargetSurface surface;             ///< with the samples of the last `sample`
  /// The interfaces between the regions of a mesh, as they are to stay: fans of their faces (`interface_surface`).
  TriangleMesh interfaces;
  std::vector<Index> group_of_interface_triangle;  ///< as in group_of_triangle
  /// Group of each triangle of `surface`, which consists of the target's triangles and those of the interfaces: 0 for
  /// the target, 1 + the place of its pair of regions in `Interfaces::pairs` for an interface. Empty without
  /// interfaces.
  std::vector<Index> group_of_triangle;
  /// Number of each triangle of `surface` in the `RegionSurface`; empty if the target has no regions.
  std::vector<Index> region_triangle;
  std::vector<double> region_volumes;  ///< `RegionSurface::volumes` in normalized coordinates

  /// InputError: as for `normalization_of`.
  /// Vertices of the target's open edges in the same place count as one (`joined_at_open_edges`).
  explicit FitTarget(const TriangleMesh& target);
  explicit FitTarget(const PointCloud& target, PointWeights weights = PointWeights::equal);
  /// Makes the outer surface of regions and their interfaces the target. A mesh that is to reproduce it must have
  /// interfaces between the same pairs of regions.
  explicit FitTarget(const RegionSurface& target);

  /// Makes the interfaces of a mesh, in normalized coordinates, part of the target; does nothing if there are none, or
  /// if the target is a cloud. `mesh`, `tree` and distances remain those of the target alone.
  void keep_interfaces(const VolumeMesh& start);
  /// Likewise for triangles that stand for curved interfaces; groups: of each, as in `group_of_triangle`. Normals point
  /// from the smaller to the larger reference.
  void keep_interfaces(TriangleMesh triangles, std::vector<Index> groups);
  bool has_interfaces() const { return !interfaces.triangles.empty(); }

  /// Samples the surface about as densely as the fitted one: sparse sites on large facets would claim points of the
  /// surface that belong to a neighboring facet. A cloud keeps its points.
  /// least  approximate least number of samples; every triangle has at least one, unless that makes more than `most`.
  void sample(std::size_t num_samples, std::size_t least, std::size_t most = std::numeric_limits<std::size_t>::max());

  /// Returns the symmetric distances to another surface; for a cloud, those of its points to the surface.
  /// extremes  as in `SurfaceDistanceOptions`.
  SurfaceDistance distance(const TriangleMesh& fitted, bool extremes = true) const;
  /// Returns the same with the other surface's tree.
  SurfaceDistance distance(const TriangleMesh& fitted, const ClosestPoint& fitted_tree, bool extremes = true) const;
  double mean_distance(const TriangleMesh& fitted) const { return distance(fitted, false).mean(); }

  /// Returns the symmetric distances between the interfaces and those of a mesh with the same pairs of regions: the
  /// largest of all pairs.
  SurfaceDistance interface_distance(const VolumeMesh& fitted) const;
  /// Returns the same distances for triangles on the interfaces of a mesh, whose groups are as in `group_of_triangle`.
  SurfaceDistance interface_distance(const TriangleMesh& fitted, std::span<const Index> groups) const;

  /// Measures the distance of a template's boundary to the target and describes the state of the target, with area and
  /// volume in the target's unit. If the target encloses nothing, the volume in the template is used as its volume.
  StartComparison compare_start(const TriangleMesh& boundary);

 private:
  void add_interfaces();
};

/// Returns the group of each face of a mesh, as `FitTarget::group_of_triangle` has them, by `MeshTopology`; kNoIndex
/// for faces inside a region. Empty if the mesh has no interfaces.
std::vector<Index> groups_of_sheets(const VolumeMesh& mesh, const MeshTopology& topology);

/// Returns the groups of triangles on these faces; empty if there are no groups.
std::vector<Index> groups_of_triangles(std::span<const Index> faces, std::span<const Index> group_of_face);

}  // namespace subvol::internal
