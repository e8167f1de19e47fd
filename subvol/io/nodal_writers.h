// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/io/nodal_mesh.h"

#include <string>

namespace subvol::internal {

/// Returns the cells as an input file of Abaqus and CalculiX.
///
/// Elements are C3D4, C3D5, C3D6 and C3D8, or C3D10, C3D15 and C3D20 of cells of order 2, whose nodes inside faces and
/// hexes are left out. Numbers of nodes and elements are ours and 1; the set EALL holds all elements. Each reference
/// has the element set REFERENCE_7 (REFERENCE_M7 for -7) and, if it has a name, another one of that name. Each group of
/// faces becomes a surface of elements and a set of its nodes. Names keep their letters, digits, _ and -; other
/// characters become _, and a name without any becomes GROUP_7.
///
/// InputError: orders other than 1 and 2, or both of them; nodes that are not equally spaced.
std::string inp_text(const NodalMesh& mesh);
/// Returns a name as such a file holds it: letters, digits, _ and -, a letter first, at most 73 characters; empty if no
/// letter or digit is left.
std::string inp_name(const std::string& wanted);

/// Returns the cells as bulk data of Nastran, with large fields: GRID, CTETRA, CPENTA, CPYRAM and CHEXA, of order 2
/// with the middles of edges as above. The number of a property is the reference, or, for those below 1, the first free
/// number; a card whose numbers have more than eight digits has large fields. There are no groups of faces: they would
/// be shells. InputError: as above.
std::string nastran_text(const NodalMesh& mesh);

/// Returns the cells as an MFEM mesh v1.0, curved ones with nodes in the space H1 of their order.
///
/// Attributes are as the properties above. If there are groups of faces, the boundary and the faces of groups are
/// listed with the group's number (below 1, or none: the first free number). Names are not written.
/// InputError: cells of several orders; cells of order 3 or more without Gauss-Lobatto nodes.
std::string mfem_text(const NodalMesh& mesh);

/// Returns the cells as an Exodus II file, netCDF of the classic format with 64-bit offsets.
///
/// There is a block for each reference and kind of cell, in this order; its number is the reference, or, for those
/// below 1 and for a second kind, the first free one. It is named as the region, or "reference 7"; a second kind has
/// "_prisms" and the like behind it. Elements are HEX8, WEDGE and TETRA, of order 2 HEX20, WEDGE15 and TETRA10 if all
/// cells are determined by their nodes on edges, else HEX27, WEDGE18 and TETRA10. Each group of faces becomes a side
/// set and a node set. InputError: orders other than 1 and 2, or both of them; the library has no netCDF
/// (`has_exodus`).
std::string exodus_bytes(const NodalMesh& mesh);

/// Returns the cells in the order of an Exodus file: by reference, then kind, then number.
std::vector<std::size_t> exodus_order(const NodalMesh& mesh);

/// Returns the cells as XDMF 3 with all arrays in the text: one grid "mesh" with the cell data "reference", which
/// meshio, dolfinx and ParaView read. Order 2 has all nodes of the grid (Hexahedron_27). Several kinds of cells make a
/// mixed topology, which dolfinx does not read. Groups of faces are not in it. InputError: orders other than 1 and 2,
/// or both of them.
std::string xdmf_text(const NodalMesh& mesh);

/// Returns the faces of the boundary and of groups as XDMF: a grid "groups" of triangles and quads with the nodes of
/// the cells, all nodes of the mesh, and the cell data "group": the number of the face's first group (below 1: the
/// first free number), 0 for none. dolfinx reads it as tags of facets. InputError: as above.
std::string xdmf_faces_text(const NodalMesh& mesh);

/// Returns linear cells as a NodalMesh.
NodalMesh nodal_mesh(const VolumeMesh& mesh);

}  // namespace subvol::internal
