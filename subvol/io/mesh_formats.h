// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// The formats behind mesh_io.h, one pair of functions and one .cpp file each.

#include "subvol/mesh/volume_mesh.h"

#include <string>
#include <string_view>
#include <vector>

namespace subvol {

/// A mesh as the file says, and what there is to remark (without the file's name).
struct ParsedMesh {
  VolumeMesh mesh;
  std::vector<std::string> warnings;
};

/// `name` is the file's name for messages. Errors as `read_volume_mesh`, which also does the checks that are not the
/// format's business. Indices are in range, positions finite.
/// references: `ReadOptions::references`.
ParsedMesh parse_medit(const std::string& name, std::string_view bytes, const std::string& references);
ParsedMesh parse_legacy_vtk(const std::string& name, std::string_view bytes, const std::string& references);

/// The file's bytes. The mesh is consistent: `write_volume_mesh` has looked.
std::string format_medit(const VolumeMesh& mesh);
std::string format_legacy_vtk(const VolumeMesh& mesh);

/// Why no pyramid can be read, for messages.
inline constexpr const char* kNoPyramids =
    "pyramids cannot be used: four edges meet at the apex, so splitting its corners gives no hexes; cut each pyramid "
    "into "
    "two tets, or refine it into hexes, prisms and tets";

}  // namespace subvol
