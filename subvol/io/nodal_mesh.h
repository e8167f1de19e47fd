// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/io/cell_lattice.h"
#include "subvol/mesh/face_groups.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

namespace subvol {

/// Where the nodes of a cell of order p lie along each axis of its canonical coordinates.
enum class NodeSpacing {
  equal,   ///< at i / p
  lobatto  ///< at the Gauss-Lobatto points of p + 1 points
};

/// Cells of any order as a file of another program describes them: polynomials through their nodes.
///
/// Every cell has all nodes of its grid, in the order of `cell_lattice(kind, order, NodeOrdering::vtk)`: corners first.
/// Nodes keep the order of the file; those that complete cells without nodes inside faces come last.
struct NodalMesh {
  std::vector<Vec3> positions;
  std::vector<CellKind> kinds;
  std::vector<int> orders;              ///< one per cell, from 1 on
  std::vector<std::size_t> offsets{0};  ///< num_cells() + 1 entries into nodes
  std::vector<Index> nodes;
  std::vector<int> references;   ///< one per cell, or empty (all 0)
  std::vector<Group> regions;    ///< names of references, where there are any
  VolumeFaceGroups face_groups;  ///< by the corners of faces
  PolygonMesh shells;            ///< without cells: elements of two dimensions by their corners, which are
                                 ///< numbers of nodes; it has no positions of its own (.msh, .inp, .bdf)
  NodeSpacing spacing = NodeSpacing::equal;
  std::vector<std::string> warnings;  ///< without the file's name

  std::size_t num_cells() const { return kinds.size(); }
  std::span<const Index> cell(std::size_t c) const { return {nodes.data() + offsets[c], offsets[c + 1] - offsets[c]}; }
  int max_order() const;
};

/// Appends cells to a NodalMesh, whatever the order of their nodes.
///
/// A cell of order 2 may lack nodes at the end of VTK's order, which are added where the polynomial of such a cell has
/// them, so that the cell is the same:
///
///   20 of a hex    without the insides of faces and of the cell
///   15 of a prism  without the insides of faces
///   24 of a hex    without the insides of the bottom, the top and the cell; only in VTK's ordering
///   12 of a prism  without the insides of faces, and straight from the bottom to the top; only in VTK's ordering
///
/// The middle of a quad is at half the sum of the middles of its edges less a quarter of the sum of its corners.
class NodalCells {
 public:
  explicit NodalCells(NodalMesh& mesh) : mesh_(mesh) {}

  /// Appends a cell. nodes: all of its grid in the given ordering, or the first ones of order 2 as above; all
  /// must be in range of the positions (asserted).
  void add(CellKind kind, int order, NodeOrdering ordering, std::span<const Index> nodes);
  /// Returns true if a cell of this kind and order may have so many nodes in any ordering.
  static bool is_size(CellKind kind, int order, std::size_t num_nodes);

 private:
  const std::vector<int>& places(CellKind kind, int order, NodeOrdering ordering);
  Index center(std::span<const Index> corners, std::span<const Index> middles, double corner_weight,
               double middle_weight);
  Index shared_center(std::span<const Index> corners, std::span<const Index> middles, double corner_weight,
                      double middle_weight);
  void complete(CellKind kind, std::vector<Index>& nodes);

  NodalMesh& mesh_;
  std::map<std::tuple<CellKind, int, NodeOrdering>, std::vector<int>> places_;
  std::map<FaceKey, Index> centers_;  ///< of quads, and of edges that lack their middles
};

/// Reads cells of any order; the extension chooses the format (docs/file-formats.md).
///
///   .msh, or a .mesh that begins with "$MeshFormat"      Gmsh 2.2, 4.0 and 4.1, ASCII or binary
///   .vtu                 VTK XML, 0.1 to 2.2, ASCII, base64 or appended, compressed or not; Bezier cells, too
///   .vtk                 legacy VTK
///   .inp                 Abaqus and CalculiX
///   .bdf .nas .fem       Nastran bulk data
///   .mfem, or a .mesh that begins with "MFEM mesh"       MFEM mesh v1.0, 1.2 and 1.3
///   .e .exo .ex2 .gen    Exodus II, if the library was built with netCDF (`has_exodus`)
///   .cgns                CGNS, zones without structure, if it was built with the CGNS library (`has_cgns`)
///
/// references  name of the cell data that become the references (.vtu, .vtk); empty: the usual ones.
/// InputError, naming the file and line: as `read_volume_mesh`, except that the cells may be curved, and that they need
/// not fit together.
NodalMesh read_nodal_mesh(const std::filesystem::path& path, const std::string& references = {});

/// Returns true if `read_nodal_mesh` reads files of this name, as far as the extension says.
bool is_nodal_extension(const std::filesystem::path& path);

/// Returns true if Exodus files can be read and written: the library was built with netCDF.
bool has_exodus();

/// Returns true if CGNS files can be read.
bool has_cgns();

/// Returns the cells as linear ones; nodes keep their numbers. name: of the file, for messages. InputError: a cell of
/// order 2 or more; no cells.
VolumeMesh linear_mesh(const std::string& name, NodalMesh mesh);

/// Returns the cells by their corners, without groups and references. The vertices are the nodes that are corners, in
/// the order of the nodes.
///
/// keeps_unused  true: nodes of no cell become vertices, too, as do all others that are no corners.
/// number        receives the vertex of each node, or kNoIndex.
VolumeMesh corner_mesh(const NodalMesh& mesh, bool keeps_unused, std::vector<Index>& number);

/// Renumbers the nodes of all cells, or of all prisms, as `read_volume_mesh` does if each of them is left-handed at
/// every corner, with a warning.
void turn_over_mirrored(NodalMesh& mesh);

}  // namespace subvol
