// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <filesystem>
#include <string>

namespace subvol {

/// A polygon mesh as Wavefront .obj text: `v` and `f` lines only, faces as they are (quads stay quads).
///
/// Coordinates have 17 significant digits where they need them, so that reading gives the same doubles.
/// InputError: no faces, a face of fewer than three corners, an index out of range, a coordinate that is not finite.
std::string obj_text(const PolygonMesh& mesh, const std::string& name = "surface");

/// Writes `obj_text` to a file, all of it or nothing. IoError: the file cannot be written.
void write_obj(const std::filesystem::path& path, const PolygonMesh& mesh);

}  // namespace subvol
