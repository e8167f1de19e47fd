// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/volume_writer.h"
#include "fit/elements/cell_reference.h"
#include "fit/elements/high_order_mesh.h"
#include "fit/elements/polynomial_map.h"

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace subvol {

/// Default of `map_tolerance_percent`: far below the distances to targets that fits reach (0.01 to 0.03 %).
inline constexpr double kMapTolerancePercent = 0.001;

/// What a file of a high-order mesh holds besides, and how fine its linear cells are.
struct HighOrderFileOptions {
  std::span<const double> cell_minima{};  ///< one scaled Jacobian per cell, or empty: cell data `scaled_jacobian`
  CellReference reference{};              ///< that these are measured against; empty: the ideal cells
  std::span<const int> references{};      ///< one per cell, or empty: all 0
  /// One number per vertex of the mesh each: point data of .vtu and .msh, linear in between (order 1 of the cell's
  /// kind).
  std::span<const VertexField> fields{};
  int linear_intervals = 0;               ///< of `linear_cells` in .mesh and .vtk; 0: the largest order of the mesh
  /// How far the polynomial cells of a .vtu or .msh may be from the map, in per cent of the diagonal of the box of the
  /// mesh's vertices. Orders are raised for its sake (`file_cells`).
  double map_tolerance_percent = kMapTolerancePercent;
};

/// Largest order of a Lagrange cell in a .vtu.
inline constexpr int kMaxVtkOrder = 12;

/// The polynomial cells that a .vtu or .msh holds in place of the map, with a bound of the distance between the two:
/// what VTK and Gmsh reconstruct between the points of the file, up to rounding.
///
/// A Legendre mesh within the format's orders is its own cells, at distance 0; all else is `polynomial_map` with the
/// least orders that keep to the tolerance, or the largest of the format if none does.
/// extension  ".vtu" (orders up to 12) or ".msh" (up to 10 for tets, 2 for prisms, 9 for hexes); else InputError.
PolynomialMap file_cells(const HighOrderMesh& mesh, const std::string& extension,
                         double map_tolerance_percent = kMapTolerancePercent);

/// The mesh as a VTK XML unstructured grid, version 2.2, arrays in base64.
///
/// Cells are Lagrange tets, wedges and hexes (71, 73, 72): those of `file_cells`, each of the largest order of its
/// edges, faces and itself (cell data `order`). `scaled_jacobian` is that of these cells: it is measured anew where they
/// are not the map. Points that cells of equal order have in common are there once; the first are the mesh's vertices,
/// and the first of every cell are its corners. The map itself is in the field data, for `read_high_order`:
///
///   subvol_format        Int64: 1, basis (0 fourier, 1 legendre), number of vertices
///   subvol_cells_distance  Float64: upper bound of the distance between the Lagrange cells and the map, 0 if they are
///                        the same
///   subvol_edge_orders, subvol_face_orders, subvol_cell_orders      UInt8, as MeshTopology numbers edges and faces
///   subvol_coefficients  Float64, 3 per node, as ElementSpace numbers nodes
///
/// InputError: no cells, coefficients or minima that are not finite, arrays of wrong length.
std::string vtu_text(const HighOrderMesh& mesh, const HighOrderFileOptions& options = {});

/// The cells of `file_cells` as Gmsh 4.1 ASCII, each of its largest order, nodes as Gmsh numbers them; one volume per
/// reference and order, else as for linear cells.
///
/// InputError as above, and for meshes of orders beyond what Gmsh evaluates: 10 for tets, 2 for prisms, 9 for hexes.
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

/// The Lagrange cells of such a file as they stand, without a look at its field data: the polynomials that any other
/// reader reconstructs (`polynomials_of`), cell by cell in the same order. InputError as for `read_high_order`.
HighOrderMesh read_lagrange_cells(const std::filesystem::path& path);

}  // namespace subvol
