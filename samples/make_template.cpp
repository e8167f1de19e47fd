// SPDX-License-Identifier: GPL-3.0-or-later
// Makes a template by hand, step by step (grid, carve, pillow), fits it, and lets one be made automatically.

#include <subvol/fit/quality/quality.h>
#include <subvol/fit/subdivision_fit.h>
#include <subvol/io/mesh_io.h>
#include <subvol/templates/auto_template.h>
#include <subvol/templates/carve.h>
#include <subvol/templates/pillow.h>
#include <subvol/templates/voxel_grid.h>
#include "samples/shapes.h"

#include <cstdio>
#include <exception>
#include <filesystem>

int main(int argc, char** argv) try {
  const std::filesystem::path folder = argc > 1 ? argv[1] : ".";
  const subvol::TriangleMesh target = subvol::samples::torus_sample().target;

  // A box of cubes around the torus; those that lie in it by half; a layer of cells inside their boundary.
  const subvol::VolumeMesh grid =
      subvol::voxel_mesh(subvol::box_grid(subvol::Vec3(-1.6, -1.6, -0.48), subvol::Vec3(1.6, 1.6, 0.48), {8, 8, 2}));
  const std::vector<char> inside = subvol::cells_inside(grid, target);
  const subvol::VolumeMesh carved = subvol::carve(grid, [&](std::size_t c) { return inside[c] != 0; });
  const subvol::VolumeMesh pillowed = subvol::pillow(carved);
  const subvol::FitResult fit = subvol::fit_subdivision_volume(target, pillowed, {.levels = 2});

  subvol::write_volume_mesh(folder / "walk_grid.mesh", grid);
  subvol::write_volume_mesh(folder / "walk_carved.mesh", carved);
  subvol::write_volume_mesh(folder / "walk_pillowed.mesh", pillowed);
  subvol::write_volume_mesh(folder / "walk_fitted.mesh", fit.mesh);
  const subvol::QualityReport quality = subvol::measure_quality(fit.mesh);
  std::printf("grid %zu, carved %zu, pillowed %zu cells; fitted: scaled Jacobian at least %.3f, %.3f in the mean\n",
              grid.num_cells(), carved.num_cells(), pillowed.num_cells(), quality.min_scaled_jacobian,
              quality.mean_scaled_jacobian);

  // The same without a hand: a carved grid with the torus's one handle.
  const subvol::AutoTemplateResult made = subvol::auto_templates(target, {.cells = 150});
  if (made.templates.empty()) return 1;
  const subvol::VolumeMesh& automatic = made.templates.front().mesh;
  subvol::write_volume_mesh(folder / "automatic.mesh", automatic);
  std::printf("automatic: %zu cells, %s\n", automatic.num_cells(), to_string(made.wanted).c_str());
  return quality.certificate.all_certified() ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "make_template: %s\n", error.what());
  return 1;
}
