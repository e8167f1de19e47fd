// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/export/volume_writer.h"
#include "subvol/fit/elements/cell_reference.h"
#include "subvol/fit/elements/high_order_mesh.h"
#include "subvol/fit/elements/polynomial_map.h"
#include "subvol/io/nodal_mesh.h"

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace subvol {

/// Default of `map_tolerance_percent`: far below the distances to targets that fits reach (0.01 to 0.03 %).
inline constexpr double kMapTolerancePercent = 0.001;

/// Cells of VTK that hold polynomials in a .vtu: by points on the cell, or by control points in the Bernstein basis,
/// which programs of isogeometric analysis take.
enum class VtuCells { lagrange, bezier };

/// Data written to a file of a high-order mesh besides the mesh, and the resolution of its linear or polynomial cells.
struct HighOrderFileOptions {
  std::span<const double> cell_minima{};  ///< one scaled Jacobian per cell, or empty: cell data `scaled_jacobian`
  CellReference reference{};              ///< the cells that these are measured against; empty: the ideal cells
  std::span<const int> references{};      ///< one per cell, or empty: all 0
  const VolumeFaceGroups* face_groups = nullptr;  ///< named faces of the cells; may be null
  std::span<const Group> regions{};               ///< names of references
  MshVersion msh_version = MshVersion::v4_1;      ///< of a .msh
  VtuCells vtu_cells = VtuCells::lagrange;        ///< of a .vtu
  /// Fields with one number per vertex of the mesh: point data of .vtu and .msh, interpolated linearly (order 1 of the
  /// cell's kind).
  std::span<const VertexField> fields{};
  int linear_intervals = 0;  ///< `intervals` of `linear_cells` in .mesh and .vtk; 0: the mesh's largest
                             ///< order
  /// Largest distance of the polynomial cells of a .vtu or .msh from the map, in percent of the diagonal of the box of
  /// the mesh's vertices. Orders are raised to stay within it (`file_cells`).
  double map_tolerance_percent = kMapTolerancePercent;
};

/// Largest order of a Lagrange cell in a .vtu.
inline constexpr int kMaxVtkOrder = 12;

/// Returns the polynomial cells that a .vtu or .msh holds in place of the map, with a bound on the distance between the
/// two. They are what VTK and Gmsh reconstruct between the points of the file, up to rounding.
///
/// A Legendre mesh within the format's orders is returned unchanged, at distance 0; for any other mesh the cells are
/// those of `polynomial_map` with the lowest orders that keep to the tolerance, or the format's largest orders if none
/// do.
/// extension  ".vtu" (orders up to 12), ".msh" (up to 10 for tets, 2 for prisms, 9 for hexes), ".mfem" (up to 16), or
///            ".e", ".exo" and ".xdmf" (up to 2), or ".inp" and ".bdf" (up to 2, without the modes of faces and hexes:
///            `edge_cells`); else InputError.
PolynomialMap file_cells(const HighOrderMesh& mesh, const std::string& extension,
                         double map_tolerance_percent = kMapTolerancePercent);

/// Returns what a .inp, .bdf, .mfem, .e, .exo or .xdmf holds of a mesh: the cells of `file_cells` at the nodes of the
/// format, with references and groups.
NodalMesh written_nodes(const HighOrderMesh& mesh, const std::string& extension,
                        const HighOrderFileOptions& options = {});

/// Returns the mesh as a VTK XML unstructured grid, version 2.2, with arrays in base64.
///
/// Cells are Lagrange or Bezier tets, wedges and hexes (71, 73, 72, or 78, 80, 79): those of `file_cells`, each with
/// the largest order of its edges, faces and interior (cell data `order`). `scaled_jacobian` is that of these cells: it
/// is measured again if they differ from the map. Points that cells of equal order have in common are written once; the
/// first points are the mesh's vertices, and the first of every cell are its corners. The map itself is in the field
/// data, for `read_high_order`:
///
///   subvol_format        Int64: 1, basis (0 fourier, 1 legendre), number of vertices
///   subvol_cells_distance  Float64: upper bound of the distance between the cells of the file and the map, 0 if they
///                        are the same
///   subvol_edge_orders, subvol_face_orders, subvol_cell_orders      UInt8, numbered as in MeshTopology
///   subvol_coefficients  Float64, 3 per node, numbered as in ElementSpace
///
/// InputError: no cells, coefficients or minima that are not finite, arrays of wrong length.
std::string vtu_text(const HighOrderMesh& mesh, const HighOrderFileOptions& options = {});

/// Returns the cells of `file_cells` as Gmsh ASCII, each with its largest order and its nodes in Gmsh's order;
/// there is one volume per reference and order, otherwise the text is as for linear cells.
///
/// InputError: as above, and for meshes of orders beyond what Gmsh evaluates: 10 for tets, 2 for prisms, 9 for hexes.
std::string msh_text(const HighOrderMesh& mesh, const HighOrderFileOptions& options = {});

/// Writes .vtu or .msh as above, .inp, .bdf, .mfem, .e, .exo or .xdmf as the cells of `file_cells`
/// (subvol/io/nodal_writers.h), or .mesh or .vtk as `linear_cells` (whose references are those of the curved cells);
/// the whole file or nothing. InputError: another extension, orders above 2 in these but .mfem, and as above. IoError:
/// the file cannot be written.
void write_volume(const std::filesystem::path& path, const HighOrderMesh& mesh,
                  const HighOrderFileOptions& options = {});

/// Returns the cells of a .mesh or .vtk: `linear_cells`, with the references of the curved cells.
VolumeMesh small_cells(const HighOrderMesh& mesh, const HighOrderFileOptions& options = {});

/// A mesh from a file, with the references of its cells and its groups, if any.
struct HighOrderFile {
  HighOrderMesh mesh;
  std::vector<int> references;
  VolumeFaceGroups face_groups{};
  std::vector<Group> regions{};
};

/// Reads a file that `vtu_text` has written: orders, coefficients and references are the same to the bit.
///
/// InputError, naming the file and what was expected: any other .vtu, a truncated or changed file, inconsistent arrays,
/// numbers that are not finite, cells that do not fit together (`validate`, of the straight-sided mesh; its cells may
/// be inverted). Memory: a few times the size of the file.
HighOrderFile read_high_order(const std::filesystem::path& path);

/// Reads the Lagrange or Bezier cells of such a file and ignores its field data: the result holds the polynomials that
/// any other reader reconstructs (`polynomials_of`), cell by cell in the same order. InputError: as `read_high_order`.
HighOrderMesh read_polynomial_cells(const std::filesystem::path& path);

}  // namespace subvol
