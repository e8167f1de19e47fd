// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace subvol {

/// One number per vertex under its own name.
struct VertexField {
  std::string name;
  std::vector<double> values;
};

/// Returns linear cells as a VTK XML unstructured grid: one piece, file version 1.0, arrays in base64 of little-endian
/// numbers.
///
/// Cells are plain tets, hexes and wedges (10, 12, 13); VTK's wedge has the opposite orientation of a prism here. Cell
/// data: `material` and `reference`, the same numbers, if the mesh has references, and `scaled_jacobian` if values are
/// given. Point data: the fields. Tags are not written.
///
/// cell_minima  one scaled Jacobian per cell, or empty. fields: one number per vertex each.
/// InputError: no cells, arrays of inconsistent length, a vertex number out of range, a number that is not finite.
std::string vtu_text(const VolumeMesh& mesh, std::span<const double> cell_minima = {},
                     std::span<const VertexField> fields = {});

/// Version of Gmsh's file format.
enum class MshVersion {
  v2_2,  ///< older, and read by more programs: each element has its physical group
  v4_1   ///< elements belong to volumes and surfaces, and these to physical groups
};

/// Returns linear cells as Gmsh ASCII: tets (4), hexes (5), prisms (6). There is one volume per reference, which is
/// a physical group named `reference R` with the number R or, if that is not positive, the first free number.
/// `scaled_jacobian` is written as element data, the fields as node data. Element numbers start at 1, volume by volume,
/// then kind by kind. In version 2.2, a face in several groups is an element of each. Reading gives the same doubles.
/// Tags are not written. Errors as above.
std::string msh_text(const VolumeMesh& mesh, std::span<const double> cell_minima = {},
                     std::span<const VertexField> fields = {}, MshVersion version = MshVersion::v4_1);

/// Writes `vtu_text`, `msh_text`, or the cells as .inp, .bdf, .mfem, .e, .exo or .xdmf (subvol/io/nodal_writers.h),
/// which hold neither minima nor fields, depending on the extension; the whole text or nothing. InputError: another
/// extension. IoError: the file cannot be written.
void write_volume(const std::filesystem::path& path, const VolumeMesh& mesh, std::span<const double> cell_minima = {},
                  std::span<const VertexField> fields = {}, MshVersion version = MshVersion::v4_1);

}  // namespace subvol
