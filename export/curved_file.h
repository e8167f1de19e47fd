// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/export/high_order_file.h"
#include "subvol/io/nodal_mesh.h"

#include <filesystem>
#include <string>
#include <vector>

namespace subvol {

/// Returns true if a file is a .vtu with the exact map of its cells, for `read_high_order`, as subvol writes it: not
/// after another program has rewritten it.
bool holds_exact_map(const std::filesystem::path& path);

/// Returns the cells of another program as one high-order mesh with the Legendre basis: the same polynomials, up to
/// rounding.
///
/// Its vertices are the nodes that are corners of cells, in their order. All edges, faces and cells get the largest
/// order of the mesh. If all cells (or all prisms) are mirrored, their nodes are renumbered, with a warning.
/// name      of the file, for messages. warnings: receives those of the mesh, with the name; may be null.
/// InputError: cells that do not fit together (`validate`, of the straight-sided mesh; they may be inverted), that
/// curve a common edge or face differently, or that have an order above 16.
HighOrderFile curved_mesh(const std::string& name, NodalMesh mesh, std::vector<std::string>* warnings = nullptr);

/// Reads curved cells: exactly if the file holds their map (`read_high_order`), else as `curved_mesh` of
/// `read_nodal_mesh`. InputError: as these.
HighOrderFile read_curved(const std::filesystem::path& path, std::vector<std::string>* warnings = nullptr,
                          const std::string& references = {});

}  // namespace subvol
