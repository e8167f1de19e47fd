// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <filesystem>
#include <string>

namespace subvol {

/// Returns a polygon mesh as Wavefront .obj text: `v` and `f` lines, with the faces unchanged (quads stay quads), and a
/// line `g` wherever the group of the faces changes, if there are groups. Blanks in names become underscores.
///
/// Coordinates have up to 17 significant digits, as many as are needed to read back the same doubles.
/// InputError: no faces, a face of fewer than three corners, an index out of range, a coordinate that is not finite.
std::string obj_text(const PolygonMesh& mesh, const std::string& name = "surface");

/// Writes `obj_text` to a file, the whole text or nothing. IoError: the file cannot be written.
void write_obj(const std::filesystem::path& path, const PolygonMesh& mesh);

}  // namespace subvol
