// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// The formats behind mesh_io.h, one pair of functions and one .cpp file each.

#include "subvol/mesh/volume_mesh.h"

#include <string>
#include <string_view>
#include <vector>

namespace subvol::internal {

/// A mesh as the file describes it, and warnings without the file's name.
struct ParsedMesh {
  VolumeMesh mesh;
  std::vector<std::string> warnings;
};

/// Parse a mesh; its indices are in range and its positions are finite. `read_volume_mesh` makes all other checks.
///
/// name        the file's name for messages.
/// references  `ReadOptions::references`.
/// Errors: as `read_volume_mesh`.
ParsedMesh parse_medit(const std::string& name, std::string_view bytes, const std::string& references);

/// Return the bytes of the file. The mesh must be consistent, which `write_volume_mesh` checks.
std::string format_medit(const VolumeMesh& mesh);
std::string format_legacy_vtk(const VolumeMesh& mesh);

/// Throws InputError: a file has no cells. warnings: those of reading it, which tell what it has instead.
[[noreturn]] void fail_without_cells(const std::string& name, const std::vector<std::string>& warnings);

/// Reason for messages why curved pyramids cannot be read.
inline constexpr const char* kNoCurvedPyramids =
    "pyramids are read with straight edges only, because their functions of higher order are no polynomials";

}  // namespace subvol::internal
