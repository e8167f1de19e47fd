// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/target/fit_target.h"

#include "subvol/base/error.h"
#include "subvol/base/format.h"
#include "subvol/fit/target/enclosed_volume.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace subvol {

namespace {

TriangleMesh normalised(TriangleMesh mesh, const Normalisation& normalisation) {
  mesh.positions = normalisation.to_unit(std::move(mesh.positions));
  return mesh;
}

PointCloud normalised(const PointCloud& cloud, const Normalisation& normalisation) {
  return {normalisation.to_unit(cloud.points)};
}

}  // namespace

Normalisation::Normalisation(const TriangleMesh& target) {
  centre = TargetSurface(target).centre();
  diagonal = bounding_box_diagonal(target);
  if (!(diagonal > 0) || !std::isfinite(diagonal))
    throw InputError("target: its triangles' bounding box has no extent, or coordinates are not finite");
}

Normalisation::Normalisation(const PointCloud& target) {
  const TargetSurface surface(target);
  centre = surface.centre();
  diagonal = surface.diagonal();
}

std::vector<Vec3> Normalisation::to_unit(std::vector<Vec3> points) const {
  for (Vec3& p : points) p = (p - centre) / diagonal;
  return points;
}

void Normalisation::take_in(VolumeMesh& mesh) const {
  // Below this range, cells vanish in the rounding of the target's coordinates; above it, the target in that of cells.
  constexpr double kLeastSize = 1e-6, kMostSize = 1e6;
  mesh.positions = to_unit(std::move(mesh.positions));
  Eigen::AlignedBox3d box;
  for (const Index v : mesh.cell_vertices) box.extend(mesh.positions[v]);
  if (box.isEmpty()) return;
  const double size = box.diagonal().stableNorm();
  if (!(size >= kLeastSize && size <= kMostSize))
    throw InputError(formatted("the mesh is %.2g times as large as the target; expected one roughly in place", size));
  const double distance = box.center().stableNorm();
  if (!(distance <= kMostSize))
    throw InputError(formatted(
        "the mesh is %.2g times the target's diagonal away from it; expected one roughly in place", distance));
}

std::vector<Vec3> Normalisation::from_unit(std::vector<Vec3> points) const {
  for (Vec3& p : points) p = centre + diagonal * p;
  return points;
}

FitTarget::FitTarget(const TriangleMesh& target)
    : normalisation(target), mesh(normalised(target, normalisation)), tree(mesh), surface(mesh) {}

FitTarget::FitTarget(const PointCloud& target, PointWeights weights)
    : normalisation(target), surface(normalised(target, normalisation), weights) {}

void FitTarget::sample(std::size_t num_samples, std::size_t least) {
  const double count = static_cast<double>(std::max(num_samples, least));
  // The second bound keeps a needle of almost no area from being cut along its length endlessly.
  surface.resample(std::max(1.8 * std::sqrt(surface.area() / count), 0.1 / std::sqrt(count)));
}

SurfaceDistance FitTarget::measure(const TriangleMesh& fitted, bool extremes) const {
  const ClosestPoint fitted_tree(fitted);
  return tree ? surface_distance(fitted, fitted_tree, mesh, *tree, {.extremes = extremes})
              : surface_distance(fitted_tree, surface.samples());
}

StartComparison FitTarget::compare_start(const TriangleMesh& boundary) {
  const SurfaceDistance start = distance(boundary);
  if (surface.volume_source() == VolumeSource::isoperimetric)
    if (const double volume = signed_volume(boundary.positions, boundary.triangles); volume > 0)
      surface.set_volume(volume);
  StartComparison result{start.mean(), start.max(), describe_target(surface, boundary)};
  const double unit = std::pow(normalisation.diagonal, 2);
  result.target.area *= unit;
  result.target.volume *= unit * normalisation.diagonal;
  return result;
}

}  // namespace subvol
