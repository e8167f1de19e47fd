// SPDX-License-Identifier: GPL-3.0-or-later
// Fits a ring of 60 hexes to noisy points on a bumpy torus: a subdivision volume and curved elements, seen beside the
// surface that the points were taken from.

#include <subvol/export/export.h>
#include <subvol/export/gltf_writer.h>
#include <subvol/fit/elements/boundary_samples.h>
#include <subvol/fit/high_order_fit.h>
#include <subvol/fit/mesh_check.h>
#include "samples/shapes.h"
#include "subvol/base/atomic_file.h"

#include <cstdio>
#include <exception>
#include <filesystem>

int main(int argc, char** argv) try {
  const std::filesystem::path folder = argc > 1 ? argv[1] : ".";
  const subvol::samples::Sample sample = subvol::samples::torus_sample();
  const subvol::PointCloud cloud = subvol::samples::scattered_points(sample.target, 5000, 0.005);
  const double percent = 100 / subvol::bounding_box_diagonal(sample.target);

  const subvol::FitResult fit = subvol::fit_subdivision_volume(cloud, sample.template_mesh, {.levels = 2});
  const subvol::MeshCheck to_points = subvol::check_mesh(fit.mesh, &cloud);
  const subvol::MeshCheck to_surface = subvol::check_mesh(fit.mesh, &sample.target);
  std::printf("subdivision, level 2: points to mesh %.4f %%, mesh to the surface itself %.4f %%, %s\n",
              to_points.mean_distance_percent(), to_surface.mean_distance_percent(),
              to_surface.valid() ? "valid" : "NOT VALID");

  const subvol::HighOrderFitResult curved = subvol::fit_high_order(cloud, sample.template_mesh, {.order = 3});
  const subvol::BoundarySamples samples = subvol::make_boundary_samples(curved.mesh.space, 12);
  const subvol::TriangleMesh boundary{samples.positions.apply(curved.mesh.coefficients), samples.triangles};
  std::printf("curved, order 3: points to mesh %.4f %%, mesh to the surface itself %.4f %%\n",
              subvol::surface_distance(boundary, cloud).mean() * percent,
              subvol::surface_distance(boundary, sample.target).mean() * percent);

  subvol::write_file_atomically(folder / "torus_points.xyz", subvol::samples::xyz_text(cloud));
  subvol::write_gltf(folder / "torus_from_points.glb", subvol::surface_scene(fit.cage, &fit.mesh));
  return to_surface.valid() ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "fit_points: %s\n", error.what());
  return 1;
}
