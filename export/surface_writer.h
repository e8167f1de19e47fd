// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <filesystem>
#include <string>

namespace subvol {

/// Returns true for the extensions that `surface_bytes` knows: .stl, .ply, .vtp and .3mf.
bool is_surface_output(const std::string& extension);

/// Returns a surface as a file. Equal surfaces give equal bytes.
///
///   .stl  triangles; binary with single precision, or text if that would move vertices by more than a millionth of the
///         extent, or if there are groups: a solid for each, and one for faces of no group, whose name is "none"; names
///         that are taken get a number behind them
///   .ply  1.0, binary, little-endian, doubles; polygons; with groups the property `reference` of faces, 0 for none
///   .vtp  VTK XML 1.0, polygons; groups as the cell data `group` (0 for none) and the field data `group_numbers` and
///         `group_names`
///   .3mf  one object of triangles in the unit millimeter; groups as base materials of their names
///
/// Numbers of groups below 1 are replaced by the first free one. Polygons are cut as by `triangulate`.
/// InputError: another extension; no faces, indices out of range, coordinates that are not finite.
std::string surface_bytes(const std::string& extension, const PolygonMesh& surface);

/// Writes one of these; the whole file or nothing. IoError: the file cannot be written.
void write_surface(const std::filesystem::path& path, const PolygonMesh& surface);

}  // namespace subvol
