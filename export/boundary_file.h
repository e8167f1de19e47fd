// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace subvol {

/// Numbers that tie a boundary to its volume mesh; each is empty if there are none.
struct BoundaryOrigin {
  std::span<const Index> vertices;  ///< of the volume mesh, one per vertex of the boundary
  std::span<const Index> cells;     ///< of the volume mesh, one per face
};

/// Returns the number of each face's group, 0 for none; a number below 1 of a group is replaced by the lowest free one.
std::vector<std::int32_t> group_numbers_of_faces(const PolygonMesh& mesh);
/// Appends the `<FieldData>` `group_numbers` and `group_names` (texts) of the groups, with the same numbers; nothing if
/// there are none.
void append_group_fields(std::string& text, const FaceGroups& groups);

/// Returns the faces of a boundary as a VTK XML unstructured grid of triangles, quads and polygons (5, 9, 7).
///
/// Cell data `group` holds the number of each face's group, 0 for none, and `cell` the cell behind it; point data
/// `vertex` holds the number of each point in the volume mesh. The field data `group_numbers` and `group_names` list
/// the groups; the names are UInt8, in UTF-8, each ended by 0, since meshio stops at texts. A negative number, or 0, of
/// a group is replaced by the lowest free positive one.
/// InputError: no faces, indices out of range, coordinates that are not finite, lists of wrong length.
std::string boundary_vtu_text(const PolygonMesh& boundary, const BoundaryOrigin& origin = {});

/// Returns the same as legacy VTK 3.0 text.
std::string boundary_vtk_text(const PolygonMesh& boundary, const BoundaryOrigin& origin = {});

/// Writes one of these, by the extension .vtu or .vtk; the whole file or nothing. InputError: also another extension.
/// IoError: the file cannot be written.
void write_boundary(const std::filesystem::path& path, const PolygonMesh& boundary, const BoundaryOrigin& origin = {});

}  // namespace subvol
