// SPDX-License-Identifier: GPL-3.0-or-later
// Fits a ring of 60 hexes to a bumpy torus and writes the cage, the finest mesh and what a DCC tool opens.

#include <subvol/export/export.h>
#include <subvol/export/gltf_writer.h>
#include <subvol/fit/quality/quality.h>
#include <subvol/fit/subdivision_fit.h>
#include <subvol/io/mesh_io.h>
#include "samples/shapes.h"

#include <cstdio>
#include <exception>
#include <filesystem>

int main(int argc, char** argv) try {
  const std::filesystem::path folder = argc > 1 ? argv[1] : ".";
  const subvol::samples::Sample sample = subvol::samples::torus_sample();

  // Two levels of subdivision; the boundary's limit surface is what is fitted.
  const subvol::FitResult fit = subvol::fit_subdivision_volume(sample.target, sample.template_mesh, {.levels = 2});
  std::printf("%s: %s\n", to_string(fit.report.stop_reason), fit.report.explanation.c_str());

  const subvol::QualityReport quality = subvol::measure_quality(fit.mesh);
  std::printf("%zu cells, scaled Jacobian at least %.3f, %.3f in the mean; %zu proved valid\n", quality.num_cells,
              quality.min_scaled_jacobian, quality.mean_scaled_jacobian, quality.certificate.certified);

  subvol::write_volume_mesh(folder / "torus_cage.mesh", fit.cage);
  subvol::write_volume_mesh(folder / "torus.mesh", fit.mesh);
  subvol::write_gltf(folder / "torus.glb", subvol::surface_scene(fit.cage, &fit.mesh));
  return quality.certificate.all_certified() ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "fit_torus: %s\n", error.what());
  return 1;
}
