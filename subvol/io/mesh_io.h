// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/io/nodal_mesh.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <filesystem>
#include <string>
#include <variant>
#include <vector>

namespace subvol {

/// Options for reading a volume mesh.
struct ReadOptions {
  /// If true, a mesh with a defect that `validate` finds is refused; inverted cells and unused vertices only give
  /// warnings, and tags off the boundary are dropped with a warning. If false, only the file itself must be valid, and
  /// tags are kept as they stand.
  bool check = true;
  /// Receives the warnings, one line each with the file's name; may be null.
  std::vector<std::string>* warnings = nullptr;
  /// Name of the cell data to use as references; if empty, they are chosen by the rules of docs/file-formats.md.
  /// InputError if there are none of that name.
  std::string references{};
};

/// What a file of cells holds.
using FileCells = std::variant<VolumeMesh, NodalMesh, PolygonMesh>;

/// Reads a file of cells, once, and returns what it holds:
///
///   VolumeMesh   linear cells, as `read_volume_mesh`
///   NodalMesh    cells, at least one of which has order 2 or more, as `read_nodal_mesh`; they are not checked, and
///                warnings are in the mesh
///   PolygonMesh  faces without cells (.msh, .inp), as `read_polygon_mesh`
///
/// InputError: as these.
FileCells read_cells(const std::filesystem::path& path, const ReadOptions& options = {});

/// Reads a volume mesh of hexes, prisms, tets and pyramids; the extension chooses the format (docs/file-formats.md).
///
///   .mesh  Medit ASCII, versions 1 to 4, dimension 3; tags from Edges + Ridges and Corners; groups of faces from the
///          references of Triangles and Quadrilaterals
///   .vtk   legacy VTK 2.0 to 5.1, ASCII or binary, UNSTRUCTURED_GRID; a VTK wedge is renumbered to our prism
///
/// Vertices and cells keep the file's order (Medit: section by section). Cells of lower dimension are skipped. Only
/// `check` repairs anything, with a warning: tags off the boundary are dropped, and the corners of cells are renumbered
/// if all cells, or all prisms, are left-handed at every corner.
///
/// Throws InputError with the file and, for its contents, the line (binary VTK: that of the last text) for an unknown
/// extension, keyword or cell type; cells of higher order; indices out of range; numbers that are not
/// finite; counts beyond what the file can hold; a file cut short; no cells; all their vertices in one place; and, with
/// `check`, a mesh that is not valid.
/// Memory: a few times the size of the file, whatever counts it claims.
VolumeMesh read_volume_mesh(const std::filesystem::path& path, const ReadOptions& options = {});

/// Writes a volume mesh atomically; the extension chooses the format. Reading it back gives the same bits of positions.
///
///   .mesh  Medit ASCII version 2: hexes, then prisms, then tets; tags as Edges + Ridges + Corners,
///          finite sharpness in comments of our own (values of 10 and above are written as infinite); groups of faces
///          as references of Triangles and Quadrilaterals, names in comments
///   .vtk   legacy VTK 3.0 ASCII; references as cell data; carries no tags
///
/// InputError: an unknown extension, inconsistent arrays, no cells, a position that is not finite, or a bad tag.
/// IoError: the file cannot be written.
void write_volume_mesh(const std::filesystem::path& path, const VolumeMesh& mesh);

/// Returns the extensions that `read_volume_mesh` accepts, as text for help and messages.
std::string volume_mesh_formats();

}  // namespace subvol
