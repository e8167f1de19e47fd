// SPDX-License-Identifier: GPL-3.0-or-later
// Writes every sample as NAME_target.off and NAME_template.mesh, torus_points.xyz, bowl.obj to grow shells on, rod.obj,
// starfish.off, plate.obj and mount.stl to fill and to compute on, and tangled.mesh to repair.

#include <subvol/export/obj_writer.h>
#include <subvol/export/surface_writer.h>
#include <subvol/io/mesh_io.h>
#include "samples/shapes.h"
#include "subvol/base/atomic_file.h"

#include <cstdio>
#include <exception>
#include <filesystem>
#include <string_view>

int main(int argc, char** argv) try {
  const std::string_view argument = argc == 2 ? argv[1] : "";
  const bool asks_for_help = argument == "--help" || argument == "-h";
  if (asks_for_help || argument.empty() || argument.front() == '-') {
    std::fprintf(asks_for_help ? stdout : stderr,
                 "usage: subvol_samples FOLDER\nWrites the surfaces, points and meshes of the samples to a folder.\n");
    return asks_for_help ? 0 : 2;
  }
  const std::filesystem::path folder = argv[1];
  std::filesystem::create_directories(folder);
  for (const auto& sample : subvol::samples::all_samples()) {
    subvol::write_file_atomically(folder / (sample.name + "_target.off"), subvol::samples::off_text(sample.target));
    subvol::write_volume_mesh(folder / (sample.name + "_template.mesh"), sample.template_mesh);
  }
  const auto points = subvol::samples::scattered_points(subvol::samples::torus_sample().target, 5000, 0.005);
  subvol::write_file_atomically(folder / "torus_points.xyz", subvol::samples::xyz_text(points));
  subvol::write_volume_mesh(folder / "tangled.mesh", subvol::samples::tangled_ball());
  subvol::write_obj(folder / "bowl.obj", subvol::samples::bowl_surface());
  subvol::write_obj(folder / "rod.obj", subvol::samples::rod_surface());
  subvol::write_file_atomically(folder / "starfish.off",
                                subvol::samples::off_text(subvol::samples::starfish_surface()));
  subvol::write_obj(folder / "plate.obj", subvol::samples::plate_surface());
  subvol::write_surface(folder / "mount.stl", subvol::samples::mount_surface());
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "subvol_samples: %s\n", error.what());
  return 1;
}
