// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/outputs.h"
#include "subvol/export/high_order_file.h"
#include "subvol/mesh/volume_mesh.h"

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace subvol::cli {

/// A group of faces some of which are also in a group before it: a format with one group for each face loses those.
struct SharedGroup {
  std::string label;
  std::size_t faces = 0, lost = 0;                    ///< of all faces of the mesh
  std::size_t boundary_faces = 0, boundary_lost = 0;  ///< of the faces of its boundary
};

/// Data of a mesh besides its cells: numbers of cells with a reference, of creases, of corners and of groups of faces.
struct Marks {
  std::size_t references = 0, creases = 0, corners = 0, groups = 0;
  std::vector<SharedGroup> shared{};
  std::vector<Group> named{};  ///< the groups of faces (dimension 2) and the references (3) that have names
};
Marks marks_of(const VolumeMesh& mesh);
Marks marks_of(const HighOrderFile& file);
Marks marks_of(const PolygonMesh& surface);

/// Adds one warning about marks that were read but are in none of the outputs, because none of the formats holds them
/// or the result no longer has them.
///
/// curved  the outputs hold curved cells, which have no creases and corners.
void warn_of_losses(const Marks& read, const Marks& result, std::span<const Output> outputs,
                    std::vector<std::string>& warnings, bool curved = false);

/// Adds warnings about groups and references of a result, one of each kind for each output: its format holds one group
/// for each face, and groups lose faces by that; it holds numbers only, or not all characters, so that names are lost
/// or altered.
void warn_of_names(const Marks& result, std::span<const Output> outputs, std::vector<std::string>& warnings);

}  // namespace subvol::cli
