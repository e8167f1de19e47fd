// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/text_scanner.h"
#include "subvol/surface/triangle_mesh.h"

#include <concepts>
#include <filesystem>
#include <string>

namespace subvol::internal {

/// Appends a whole number.
void append_number(std::string& text, std::integral auto value) { text += std::to_string(value); }

/// Appends three numbers with a separator between them.
void append_vector(std::string& text, const Vec3& vector, const char* separator);

/// The extension with its dot, in lower case.
std::string lower_case_extension(const std::filesystem::path& path);

/// Throws InputError, naming `what`, unless there are faces, each of at least three corners, all in range, all
/// positions are finite, and the groups of the faces are in range.
void require_polygons(const PolygonMesh& mesh, const std::string& what);

}  // namespace subvol::internal
