// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// The formats behind nodal_mesh.h, one .cpp file each. All indices of the result are in range, and its positions are
// finite; its cells need not fit together. Errors: as `read_nodal_mesh`.

#include "subvol/io/nodal_mesh.h"

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace subvol::internal {

NodalMesh parse_msh(const std::string& name, std::string_view bytes, const std::string& references);
NodalMesh parse_vtu(const std::string& name, std::string_view bytes, const std::string& references);
NodalMesh parse_nodal_vtk(const std::string& name, std::string_view bytes, const std::string& references);
NodalMesh parse_inp(const std::string& name, std::string_view bytes, const std::string& references);
NodalMesh parse_nastran(const std::string& name, std::string_view bytes, const std::string& references);
NodalMesh parse_mfem(const std::string& name, std::string_view bytes, const std::string& references);
NodalMesh parse_exodus(const std::string& name, std::string_view bytes, const std::string& references);
NodalMesh parse_cgns(const std::string& name, std::string_view bytes, const std::string& references);

/// Parses a file by its extension, with unused references dropped and groups sorted. It may have no cells. InputError:
/// also an unknown extension.
NodalMesh parse_nodal(const std::filesystem::path& path, std::string_view bytes, const std::string& references);

/// True if the bytes begin as an MFEM mesh, or as Gmsh's; a .mesh may be of either program or Medit's.
bool is_mfem(std::string_view bytes);
bool is_gmsh(std::string_view bytes);

/// Tells if `add_vtk_cell` added a cell, added one whose nodes are control points so far, or left it out because it is
/// a point, a line or a face.
enum class VtkCellUse { added, bezier, lower_dimension };

/// Appends a cell of a VTK type, linear, quadratic, Lagrange or Bezier, to a mesh.
///
/// nodes        the cell's points, in VTK's order.
/// old_numbers  true if the file is older than XML 2.1 or legacy 5.1: the last two edges of a Lagrange hex are swapped.
/// fail         throws; it receives what is wrong with the cell: a type that cannot be read, a wrong number of points,
///              a point that does not exist.
VtkCellUse add_vtk_cell(NodalMesh& mesh, NodalCells& cells, int type, std::span<const std::int64_t> nodes,
                        bool old_numbers, const std::function<void(const std::string&)>& fail);

/// Returns the cell seen in a mirror: node i of it is node places[i] of the cell, in `NodeOrdering::vtk`.
std::vector<int> mirrored_places(CellKind kind, int order);

/// Adds a face, given by its corners in any order, to a group of the mesh.
void add_face(NodalMesh& mesh, std::span<const Index> corners, Index group);

}  // namespace subvol::internal
