// SPDX-License-Identifier: GPL-3.0-or-later
// libFuzzer target of one reader: SUBVOL_FUZZ_EXTENSION says of which files. Whatever the bytes, the reader returns
// something sound or throws InputError.

#include "export/high_order_file.h"
#include "fit/checkpoint.h"
#include "subvol/error.h"
#include "subvol/fingerprint.h"
#include "subvol/mesh_io.h"
#include "subvol/surface_io.h"

#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <string_view>

#include <unistd.h>

namespace {

constexpr std::string_view kExtension = SUBVOL_FUZZ_EXTENSION;

void require(bool holds) {
  if (!holds) std::abort();
}

void read(const std::filesystem::path& file) {
  std::vector<std::string> warnings;
  if (kExtension == ".mesh" || kExtension == ".vtk") {
    const subvol::VolumeMesh mesh = subvol::read_volume_mesh(file, {.warnings = &warnings});
    for (const subvol::MeshDefect& defect : validate(mesh))
      require(defect.kind == subvol::MeshDefect::Kind::inverted_cell ||
              defect.kind == subvol::MeshDefect::Kind::unused_vertex);
  } else if (kExtension == ".vtu") {
    const subvol::HighOrderMesh mesh = subvol::read_high_order(file).mesh;
    require(mesh.coefficients.size() == mesh.space.num_nodes());
  } else {
    const subvol::TriangleMesh mesh = subvol::read_triangle_mesh(file, &warnings);
    require(!mesh.triangles.empty());
    for (const auto& triangle : mesh.triangles)
      for (const subvol::Index v : triangle) require(v >= 0 && static_cast<std::size_t>(v) < mesh.positions.size());
    if (kExtension == ".ply") subvol::read_vertex_attribute(file, "quality");
  }
}

/// The fingerprint is made right: it would keep everything else from being looked at.
void read_checkpoint_of(std::string_view bytes) {
  const std::string name = "checkpoint", head = "subvol checkpoint 1\n";
  const std::string_view content = bytes.substr(std::min(bytes.size(), head.size() + 17));
  const std::string whole = head + subvol::Fingerprint().add(content).text() + '\n' + std::string(content);
  const subvol::Checkpoint read = subvol::parse_checkpoint(whole, name);
  const std::string written = subvol::checkpoint_bytes(read.identity, read.stages);
  const subvol::Checkpoint again = subvol::parse_checkpoint(written, name);
  require(written.size() == whole.size() && subvol::checkpoint_bytes(again.identity, again.stages) == written);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::filesystem::path file = std::filesystem::temp_directory_path() /
                                            ("subvol-fuzz-" + std::to_string(getpid()) + SUBVOL_FUZZ_EXTENSION);
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  try {
    if (kExtension == ".checkpoint") {
      read_checkpoint_of(bytes);
    } else {
      std::ofstream(file, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
      read(file);
    }
  } catch (const subvol::InputError& error) {
    require(std::string_view(error.what()).size() > 3);
  }
  return 0;
}
