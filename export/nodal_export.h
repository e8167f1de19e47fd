// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/high_order_mesh.h"
#include "subvol/fit/elements/polynomial_map.h"
#include "subvol/io/nodal_mesh.h"

#include <filesystem>
#include <string>

namespace subvol {

/// Returns true for the extensions whose files are made from a NodalMesh: .inp, .bdf, .mfem, .e, .exo and .xdmf.
bool is_nodal_output(const std::string& extension);

/// Returns the bytes of such a file. InputError: another extension, and as the writers of these formats.
std::string nodal_text(const std::string& extension, const NodalMesh& mesh);

/// Drops the modes of faces and cells of a mesh of order 1 or 2: what remains are cells with nodes at corners and in
/// the middles of edges only (C3D20, C3D15, C3D10). The edges stay where they are.
///
/// returns  the cells, and a bound on the distance that the rest moves by: the largest sum, over a cell's faces and
///          itself, of the lengths of the dropped coefficients times the largest values of their modes.
PolynomialMap edge_cells(PolynomialMap map);

/// Samples polynomial cells at the nodes of a format: at equal distances in order 1 or 2, at Gauss-Lobatto
/// points in the mesh's largest order (.mfem). Vertices come first, with their numbers.
NodalMesh nodal_cells(const HighOrderMesh& mesh, const std::string& extension);

}  // namespace subvol
