// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// The formats behind surface_io.h. Each parser returns the contents of a file as they are, with all indices in range.

#include "subvol/surface/triangle_mesh.h"

#include <string>
#include <string_view>
#include <vector>

namespace subvol::internal {

/// Polygons as the file describes them, and warnings without the file's name.
struct ParsedSurface {
  PolygonMesh mesh;
  std::vector<std::string> warnings;
};

/// Parse polygons. `name` is the file's name for messages. InputError: as `read_polygon_mesh`, for the file itself.
ParsedSurface parse_off(const std::string& name, std::string_view bytes);
ParsedSurface parse_obj(const std::string& name, std::string_view bytes);
ParsedSurface parse_stl(const std::string& name, std::string_view bytes);
ParsedSurface parse_ply(const std::string& name, std::string_view bytes);
ParsedSurface parse_3mf(const std::string& name, std::string_view bytes);
ParsedSurface parse_gltf(const std::string& name, std::string_view bytes);   ///< name: also where its buffers are
ParsedSurface parse_scene(const std::string& name, std::string_view bytes);  ///< .fbx and .dae, by Assimp
ParsedSurface parse_vtp(const std::string& name, std::string_view bytes);
/// Returns the values of a vertex property, one per vertex. InputError: there is no such property.
std::vector<double> parse_ply_attribute(const std::string& name, std::string_view bytes, const std::string& attribute);

/// Returns true if the header of a .ply announces faces. InputError: the header is malformed.
bool ply_has_faces(const std::string& name, std::string_view bytes);
/// Parses three coordinates per line. longer_lines: receives the number of lines with more columns.
std::vector<Vec3> parse_xyz(const std::string& name, std::string_view bytes, std::size_t& longer_lines);

}  // namespace subvol::internal
