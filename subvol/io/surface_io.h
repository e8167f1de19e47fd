// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/point_cloud.h"
#include "subvol/surface/triangle_mesh.h"

#include <filesystem>
#include <string>
#include <vector>

namespace subvol {

/// Largest number of corners that a polygon in a file may have.
inline constexpr std::size_t kMaxPolygonCorners = 1000;

/// Reads polygons; the extension chooses the format (docs/file-formats.md). Soups are welcome: nothing is welded,
/// flipped or oriented, except that STL, which has no vertex numbers, gets one vertex per distinct position.
///
///   .off  OFF, COFF, NOFF, CNOFF, STOFF and the like, text     .stl  text or binary
///   .obj  polygons only; materials and the like are skipped    .ply  1.0, text or binary of either byte order
///   .vtp  VTK XML 0.1 to 2.2: polygons and strips              .3mf  objects of the build in their places
///   .glb .gltf  2.0: triangles of the scene's nodes in their places, equal positions merged; lines are skipped
///   .fbx .dae   likewise, polygons, if the library was built with Assimp (`has_assimp`)
///
/// warnings  receives the warnings, one line each with the file's name; may be null.
/// returns   faces and vertices in the file's order. Dropped, with a warning: corners that repeat the one before, faces
///           that then have fewer than three corners or name a vertex twice, and vertices of no face.
///
/// Throws InputError with the file and, for its contents, the line (binary: byte) for anything malformed, counts beyond
/// what the file can hold, indices out of range, numbers that are not finite, polygons of more than kMaxPolygonCorners,
/// no faces, all vertices in one place, coordinates beyond kMostSupportedLength, and an extent below
/// kLeastSupportedLength. Memory: a few times the size of the file, whatever it claims.
PolygonMesh read_polygon_mesh(const std::filesystem::path& path, std::vector<std::string>* warnings = nullptr);

/// Returns true if .fbx and .dae can be read.
bool has_assimp();

/// Reads polygons like `read_polygon_mesh` and cuts them into triangles (`triangulate`). Also dropped, with a warning:
/// triangles without area, and all but the first of triangles with the same three positions. InputError: also if no
/// triangle has any area.
TriangleMesh read_triangle_mesh(const std::filesystem::path& path, std::vector<std::string>* warnings = nullptr);

/// Checks polygons that come from elsewhere as `read_polygon_mesh` does with those of a file, or triangles as
/// `read_triangle_mesh`. name: their source for messages.
PolygonMesh sound_polygons(PolygonMesh mesh, const std::string& name, std::vector<std::string>* warnings = nullptr);
TriangleMesh sound_triangles(const PolygonMesh& mesh, const std::string& name,
                             std::vector<std::string>* warnings = nullptr);

/// Smallest number of points that a cloud may have.
inline constexpr std::size_t kLeastCloudPoints = 10;

/// Returns true if a file holds points without faces: an .xyz, or a .ply whose header announces no faces. InputError: a
/// .ply that cannot be read or has a malformed header.
bool is_point_cloud_file(const std::filesystem::path& path);

/// Reads points from .xyz (one per line: three coordinates, then anything) or .ply (`x y z` of `vertex`).
///
/// returns  points in the file's order. Dropped, with a warning: all but the first of points in one place, further
///          columns of .xyz, and faces of .ply.
/// InputError: as `read_polygon_mesh`, but faces are not needed; fewer than kLeastCloudPoints places.
PointCloud read_point_cloud(const std::filesystem::path& path, std::vector<std::string>* warnings = nullptr);

/// Reads a vertex property of a .ply: one value per vertex, in the file's order.
///
/// InputError: another extension; no such property; a malformed file; a value that is not finite.
std::vector<double> read_vertex_attribute(const std::filesystem::path& path, const std::string& attribute);

/// Returns true if `read_polygon_mesh` knows an extension, given in lower case with its dot.
bool is_surface_extension(const std::string& extension);

/// Return the extensions that the readers accept, as text for help and messages.
std::string surface_formats();
std::string point_cloud_formats();

}  // namespace subvol
