// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/mesh_defects.h"

namespace subvol::internal {

// These checks of a mesh's arrays and cells need no topology. They add what they find to `defects`.

/// Checks that there are cells, and that the arrays that describe them fit together. Returns false if they do not fit.
bool check_array_sizes(const VolumeMesh& mesh, DefectList& defects);

/// Checks that the cells name vertices of the mesh. Returns false if one does not. Expects arrays that fit together.
bool check_vertex_numbers(const VolumeMesh& mesh, DefectList& defects);

/// Checks that all coordinates are finite.
void check_positions(const VolumeMesh& mesh, DefectList& defects);

// The others expect vertex numbers in range.

/// Checks that no cell names a vertex twice, and that no two cells have the same vertices. Returns false if a cell
/// names a vertex twice.
bool check_cell_vertices(const VolumeMesh& mesh, DefectList& defects);

/// Checks that the Jacobian determinants at the corners of all cells are positive.
void check_jacobians(const VolumeMesh& mesh, DefectList& defects);

/// Checks that each vertex belongs to a cell.
void check_unused_vertices(const VolumeMesh& mesh, DefectList& defects);

}  // namespace subvol::internal
