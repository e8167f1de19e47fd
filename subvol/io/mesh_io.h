// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"

#include <filesystem>
#include <string>
#include <vector>

namespace subvol {

/// How strictly a volume mesh is read.
struct ReadOptions {
  /// Refuse what `validate` finds, but for inverted cells and unused vertices, which become warnings. Without it only
  /// the file itself must be sound; tags are kept as they stand.
  bool check = true;
  /// Where warnings go, one line each with the file's name; may be null.
  std::vector<std::string>* warnings = nullptr;
  /// Name of the cell data that become the references; empty: those that are meant (docs/file-formats.md). InputError
  /// where there is none of that name.
  std::string references{};
};

/// Reads a volume mesh of hexes, prisms and tets; the extension chooses the format (docs/file-formats.md).
///
///   .mesh  Medit ASCII, versions 1 to 4, dimension 3; tags from Edges + Ridges and Corners
///   .vtk   legacy VTK 2.0 to 5.1, ASCII or binary, UNSTRUCTURED_GRID; a VTK wedge is renumbered to our prism
///
/// Vertices and cells keep the file's order (Medit: section by section). Nothing is flipped or repaired, but with a
/// warning: tags off the boundary are dropped; and with `check` cells are numbered anew where all of them, or all
/// prisms, are left-handed at every corner. Cells of lower dimension are skipped.
///
/// Throws InputError with file and line (binary VTK: the line is that of the last text) for anything else: unknown
/// extension, keyword or cell type; pyramids and cells of higher order; indices out of range; numbers that are not
/// finite; counts beyond what the file can hold; a file cut short; no cells; all their vertices in one place; and, with
/// `check`, a mesh that is not sound.
/// Memory: a few times the size of the file, whatever counts it claims.
VolumeMesh read_volume_mesh(const std::filesystem::path& path, const ReadOptions& options = {});

/// Writes a volume mesh atomically; the extension chooses the format. Doubles survive bit by bit.
///
///   .mesh  Medit ASCII version 2: hexes, then prisms, then tets; tags as Edges + Ridges + Corners,
///          finite sharpness in comments of our own (10 and above is written as infinite)
///   .vtk   legacy VTK 3.0 ASCII; references as cell data; carries no tags
///
/// An unknown extension, inconsistent arrays, no cells, a position that is not finite or a bad tag: InputError. 
/// A refusing disk: IoError.
void write_volume_mesh(const std::filesystem::path& path, const VolumeMesh& mesh);

/// Extensions `read_volume_mesh` accepts, with their versions, as text for help and messages.
std::string volume_mesh_formats();

}  // namespace subvol
