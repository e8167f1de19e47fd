// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// Text of .vtu and .msh files, for linear and for Lagrange cells alike.

#include "subvol/export/grouped_faces.h"
#include "subvol/export/volume_writer.h"

#include <cstdint>
#include <span>
#include <string>

namespace subvol::internal {

/// Cells with points on regular grids, in the order of the file format. The writers make sure that the arrays are
/// consistent.
struct CellView {
  std::span<const Vec3> positions;
  std::span<const CellKind> kinds;
  std::span<const int> orders;  ///< one per cell, or empty: all 1
  std::span<const std::size_t> offsets;
  std::span<const Index> nodes;
  std::span<const int> references;      ///< one per cell, or empty: all 0
  const GroupedFaces* faces = nullptr;  ///< for a .msh; may be null
  std::span<const Group> regions{};     ///< names of references, for a .msh
  bool has_control_points = false;      ///< the nodes of cells with orders are control points, for a .vtu

  std::size_t num_cells() const { return kinds.size(); }
  int order(std::size_t c) const { return orders.empty() ? 1 : orders[c]; }
  std::span<const Index> cell(std::size_t c) const { return nodes.subspan(offsets[c], offsets[c + 1] - offsets[c]); }
};

/// Text of a .vtu: of version 1.0 with plain cells (10, 12, 13, 14) without `orders`, else of version 2.2 with Lagrange
/// or Bezier cells and the cell data `order`. field_data, group_data: `<DataArray>` elements of our own, or empty. They
/// stand behind the grid, because some readers stop at field data before it; the groups of plain cells stand at its
/// end.
std::string vtu_document(const CellView& mesh, std::span<const double> cell_minima, std::span<const VertexField> fields,
                         const std::string& field_data = {}, const std::string& group_data = {});

/// Largest order that is written for a kind of cell: that which Gmsh evaluates (10 for tets, 2 for prisms, 9 for
/// hexes), and 1 for pyramids.
int max_gmsh_order(CellKind kind);
/// Gmsh's type number for cells of a kind and order, 1 .. max_gmsh_order (asserted).
int gmsh_type(CellKind kind, int order);
/// Returns Gmsh's type number of a face of 3 or 4 corners, of an order from 1 to 10.
int gmsh_face_type(std::size_t num_corners, int order);
/// VTK's type number of a Lagrange cell, or of a Bezier cell, of a kind other than pyramids.
std::uint8_t vtk_type(CellKind kind, bool is_bezier = false);
/// VTK's type number of a linear cell.
std::uint8_t vtk_linear_type(CellKind kind);
/// Renumbers the six corners of a prism to VTK's plain wedge, or back: the normal of its first triangle points outward.
void turn_wedge(std::int64_t* corners);
/// Text of a .msh. Orders: 1 .. max_gmsh_order (asserted). Grouped faces are elements of surfaces, behind the cells.
std::string msh_document(const CellView& mesh, std::span<const double> cell_minima, std::span<const VertexField> fields,
                         MshVersion version = MshVersion::v4_1);

/// Returns a name as a .msh holds it: on one line, without quotes, and at most 126 bytes, which is what Gmsh reads.
std::string gmsh_name(std::string name);

/// Throws InputError unless there is one finite number per cell, or none at all.
void require_cell_minima(std::span<const double> cell_minima, std::size_t num_cells);

}  // namespace subvol::internal
