// SPDX-License-Identifier: GPL-3.0-or-later
// Grows two layers of hexes on either side of a bowl and writes the cells and what a DCC tool opens.

#include <subvol/export/export.h>
#include <subvol/export/gltf_writer.h>
#include <subvol/io/mesh_io.h>
#include <subvol/shell/shell.h>
#include "samples/shapes.h"

#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>

int main(int argc, char** argv) try {
  const std::filesystem::path folder = argc > 1 ? argv[1] : ".";
  const subvol::ShellResult shell = subvol::make_shell(
      subvol::samples::bowl_surface(), {.thickness = 0.1, .side = subvol::ShellSide::both, .layers = 2, .growth = 1.5});

  std::printf("%s: %s\n", to_string(shell.report.stop_reason), shell.report.explanation.c_str());
  std::printf("%zu cells, %zu proved valid, %zu faces meet; thickness %.4f to %.4f, asked for 0.1\n",
              shell.mesh.num_cells(), shell.failures.certificate.certified, shell.failures.intersecting.size(),
              *std::min_element(shell.achieved.begin(), shell.achieved.end()),
              *std::max_element(shell.achieved.begin(), shell.achieved.end()));

  subvol::write_volume_mesh(folder / "bowl_shell.mesh", shell.mesh);
  const subvol::SceneSheet sheets[] = {
      {.name = "inner", .mesh = sheet_surface(shell.layers, shell.mesh, 0)},
      {.name = "base", .mesh = shell.layers.surface},
      {.name = "outer", .mesh = sheet_surface(shell.layers, shell.mesh, shell.layers.num_sheets() - 1)}};
  subvol::write_gltf(folder / "bowl_shell.glb", subvol::sheet_scene(sheets, ""));
  return shell.failures.none() ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "grow_bowl: %s\n", error.what());
  return 1;
}
