// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/fit_target.h"

#include "fit/soup_topology.h"
#include "fit/surface_distance.h"
#include "subvol/error.h"

#include <algorithm>
#include <cmath>

namespace subvol {

namespace {

TriangleMesh normalised(TriangleMesh mesh, const Normalisation& normalisation) {
  mesh.positions = normalisation.to_unit(std::move(mesh.positions));
  return mesh;
}

}  // namespace

Normalisation::Normalisation(const TriangleMesh& target) {
  diagonal = bounding_box_diagonal(target);
  if (!(diagonal > 0) || !std::isfinite(diagonal))
    throw InputError("target: its triangles' bounding box has no extent, or coordinates are not finite");
  centre = TargetSurface(target).centre();
}

std::vector<Vec3> Normalisation::to_unit(std::vector<Vec3> points) const {
  for (Vec3& p : points) p = (p - centre) / diagonal;
  return points;
}

std::vector<Vec3> Normalisation::from_unit(std::vector<Vec3> points) const {
  for (Vec3& p : points) p = centre + diagonal * p;
  return points;
}

FitTarget::FitTarget(const TriangleMesh& target)
    : normalisation(target), mesh(normalised(target, normalisation)), tree(mesh), surface(mesh) {}

void FitTarget::sample(std::size_t num_samples, std::size_t least) {
  const double count = static_cast<double>(std::max(num_samples, least));
  surface = TargetSurface(mesh, {.sample_spacing = 1.8 * std::sqrt(surface.area() / count)});
}

double FitTarget::mean_distance(const TriangleMesh& fitted) const {
  return surface_distance(fitted, ClosestPoint(fitted), mesh, tree, {.extremes = false}).mean();
}

double FitTarget::compare_start(const TriangleMesh& boundary, FitReport& report) const {
  const SurfaceDistance distance = surface_distance(boundary, ClosestPoint(boundary), mesh, tree);
  report.initial_distance_mean_percent = 100 * distance.mean();
  report.initial_distance_max_percent = 100 * distance.max();
  const SoupTopology wanted = soup_topology(mesh.positions, mesh.triangles);
  const long euler_number = soup_topology(boundary.positions, boundary.triangles).euler_number;
  if (wanted.closed_share == 1 && wanted.euler_number != euler_number)
    report.warnings.push_back("Euler numbers differ (target " + std::to_string(wanted.euler_number) +
                              ", template's boundary " + std::to_string(euler_number) +
                              "): their handles or components do, and the fit cannot change those");
  if (surface.volume_source() != VolumeSource::signed_sum)
    report.warnings.push_back("the target is not closed or not consistently oriented; its volume is an estimate");
  return distance.mean();
}

}  // namespace subvol
