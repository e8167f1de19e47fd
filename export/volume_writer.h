// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace subvol {

/// One number per vertex under a name of its own.
struct VertexField {
  std::string name;
  std::vector<double> values;
};

/// Linear cells as a VTK XML unstructured grid: one piece, file version 2.2, arrays in base64 of little-endian numbers.
///
/// Cells are written as Lagrange tets, hexes and wedges (71, 72, 73) of order 1, whose corners are numbered as ours;
/// VTK's plain wedge would have the opposite orientation. Cell data: `reference` where there are any, and
/// `scaled_jacobian` where values are given. Point data: the fields. Tags are not carried.
///
/// cell_minima  one scaled Jacobian per cell, or empty. fields: one number per vertex each.
/// InputError: no cells, arrays of inconsistent length, a vertex number out of range, a number that is not finite.
std::string vtu_text(const VolumeMesh& mesh, std::span<const double> cell_minima = {},
                     std::span<const VertexField> fields = {});

/// Linear cells as Gmsh 4.1 ASCII: tets (4), hexes (5), prisms (6); one volume per reference, which is a physical group
/// named `reference R`, of number R or, where that is not positive, of the first number that is free; `scaled_jacobian`
/// as element data, the fields as node data. Element numbers start at 1, volume by volume, then kind by kind. Doubles
/// survive. Tags are not carried. Errors as above.
std::string msh_text(const VolumeMesh& mesh, std::span<const double> cell_minima = {},
                     std::span<const VertexField> fields = {});

/// Writes `vtu_text` or `msh_text` by the extension, all of it or nothing. InputError: another extension. IoError: the
/// file cannot be written.
void write_volume(const std::filesystem::path& path, const VolumeMesh& mesh, std::span<const double> cell_minima = {},
                  std::span<const VertexField> fields = {});

}  // namespace subvol
