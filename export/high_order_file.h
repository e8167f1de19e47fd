// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/volume_writer.h"
#include "fit/high_order_mesh.h"

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace subvol {

/// What a file of a high-order mesh holds besides, and how fine its linear cells are.
struct HighOrderFileOptions {
  std::span<const double> cell_minima{};  ///< one scaled Jacobian per cell, or empty: cell data `scaled_jacobian`
  std::span<const int> references{};      ///< one per cell, or empty: all 0
  /// One number per vertex of the mesh each: point data of .vtu and .msh, linear in between (order 1 of the cell's
  /// kind).
  std::span<const VertexField> fields{};
  int linear_intervals = 0;               ///< of `linear_cells` in .mesh and .vtk; 0: the largest order of the mesh
};

/// Largest order of a Lagrange cell in a .vtu; cells of higher order are shown by grids of this one.
inline constexpr int kMaxVtkOrder = 12;

/// The mesh as a VTK XML unstructured grid, version 2.2, arrays in base64.
///
/// Cells are Lagrange tets, wedges and hexes (71, 73, 72), each of the largest order of its edges, faces and itself
/// (cell data `order`), sampled from the map: exact everywhere for legendre up to kMaxVtkOrder, at the points for
/// fourier. Points that cells of equal order have in common are there once; the first are the mesh's vertices, and the
/// first of every cell are its corners. The map itself is in the field data, for `read_high_order`:
///
///   subvol_format        Int64: 1, basis (0 fourier, 1 legendre), number of vertices
///   subvol_edge_orders, subvol_face_orders, subvol_cell_orders      UInt8, as MeshTopology numbers edges and faces
///   subvol_coefficients  Float64, 3 per node, as ElementSpace numbers nodes
///
/// InputError: no cells, coefficients or minima that are not finite, arrays of wrong length.
std::string vtu_text(const HighOrderMesh& mesh, const HighOrderFileOptions& options = {});

/// The mesh as Gmsh 4.1 ASCII, each cell of its largest order, nodes as Gmsh numbers them; one volume per reference and
/// order, else as for linear cells.
///
/// InputError as above, and for orders beyond what Gmsh evaluates: 10 for tets, 2 for prisms, 9 for hexes.
std::string msh_text(const HighOrderMesh& mesh, const HighOrderFileOptions& options = {});

/// Writes .vtu or .msh as above, .mesh or .vtk as `linear_cells` (whose references are those of the curved cells), all
/// of it or nothing. InputError: another extension, and as above. IoError: the file cannot be written.
void write_volume(const std::filesystem::path& path, const HighOrderMesh& mesh,
                  const HighOrderFileOptions& options = {});

/// The cells of a .mesh or .vtk: `linear_cells`, with the references of the curved ones.
VolumeMesh small_cells(const HighOrderMesh& mesh, const HighOrderFileOptions& options = {});

/// A mesh from a file, with the references of its cells, or none.
struct HighOrderFile {
  HighOrderMesh mesh;
  std::vector<int> references;
};

/// Reads what `vtu_text` has written: orders, coefficients and references bit by bit.
///
/// InputError, naming the file and what was expected: any other .vtu, a file cut short or changed, arrays that do not
/// fit together, numbers that are not finite, cells that do not fit together (`validate`, of the straight-sided mesh;
/// its cells may be inverted). Memory: a few times the size of the file.
HighOrderFile read_high_order(const std::filesystem::path& path);

}  // namespace subvol
