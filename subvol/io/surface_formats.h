// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// The formats behind surface_io.h. Each parser returns what the file says, with all indices in range.

#include "subvol/surface/triangle_mesh.h"

#include <string>
#include <string_view>
#include <vector>

namespace subvol {

/// Polygons as the file says, and what there is to remark (without the file's name).
struct ParsedSurface {
  PolygonMesh mesh;
  std::vector<std::string> warnings;
};

/// `name` is the file's name for messages. Errors: InputError, as `read_polygon_mesh` documents for the file itself.
ParsedSurface parse_off(const std::string& name, std::string_view bytes);
ParsedSurface parse_obj(const std::string& name, std::string_view bytes);
ParsedSurface parse_stl(const std::string& name, std::string_view bytes);
ParsedSurface parse_ply(const std::string& name, std::string_view bytes);
/// One value of a vertex property per vertex; InputError where there is no such property.
std::vector<double> parse_ply_attribute(const std::string& name, std::string_view bytes, const std::string& attribute);

/// Whether a .ply's header announces faces. InputError: the header is malformed.
bool ply_has_faces(const std::string& name, std::string_view bytes);
/// Three coordinates a line. longer_lines: receives how many lines have more columns.
std::vector<Vec3> parse_xyz(const std::string& name, std::string_view bytes, std::size_t& longer_lines);

}  // namespace subvol
