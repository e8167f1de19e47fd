// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/error.h"
#include "subvol/io/mesh_formats.h"
#include "subvol/io/nodal_formats.h"

#include <algorithm>
#include <array>
#include <limits>
#include <string>
#include <vector>

namespace subvol::internal {

namespace {

/// A VTK cell type of fixed size. node[i]: the VTK cell's number of node i of `NodeOrdering::vtk`; for types that have
/// our numbering the list is empty.
struct FixedCell {
  int type;
  CellKind kind;
  int order;
  std::size_t size;
  std::vector<int> node;
};

/// VTK's plain wedges see their first triangle from outside; ours, and VTK's own Lagrange wedges, from inside. Voxels
/// run along x fastest.
const std::vector<FixedCell>& fixed_cells() {
  static const std::vector<FixedCell> kCells{
      {10, CellKind::tet, 1, 4, {}},
      {11, CellKind::hex, 1, 8, {0, 1, 3, 2, 4, 5, 7, 6}},
      {12, CellKind::hex, 1, 8, {}},
      {13, CellKind::prism, 1, 6, {0, 2, 1, 3, 5, 4}},
      {14, CellKind::pyramid, 1, 5, {}},
      {24, CellKind::tet, 2, 10, {}},
      {25, CellKind::hex, 2, 20, {}},
      {26, CellKind::prism, 2, 15, {0, 2, 1, 3, 5, 4, 8, 7, 6, 11, 10, 9, 12, 14, 13}},
      {29, CellKind::hex, 2, 27, {}},
      {31, CellKind::prism, 2, 12, {0, 2, 1, 3, 5, 4, 8, 7, 6, 11, 10, 9}},
      {32, CellKind::prism, 2, 18, {0, 2, 1, 3, 5, 4, 8, 7, 6, 11, 10, 9, 12, 14, 13, 17, 16, 15}},
      {33, CellKind::hex, 2, 24, {}},
  };
  return kCells;
}

/// Types of vertices, lines and polygons, linear and of higher order.
constexpr int kLowerDimensions[] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 21, 22, 23, 28, 30, 34, 35, 36, 68, 69, 70, 75, 76, 77};

/// Why a type cannot be read.
std::string refusal(int type) {
  const auto is = [&](std::initializer_list<int> types) {
    return std::find(types.begin(), types.end(), type) != types.end();
  };
  const std::string text = "has VTK type " + std::to_string(type);
  if (is({27, 37, 74, 81})) return std::string("is a curved pyramid: ") + kNoCurvedPyramids;
  if (is({41, 42, 15, 16})) return text + ", a polyhedron, which is not read";
  return text +
         ", expected 10 (tet), 11 (voxel), 12 (hex), 13 (wedge), 14 (pyramid), the quadratic forms 24, 25, 26, 29, "
         "31, 32 and 33, Lagrange cells 71, 72 and 73, or Bezier cells 78, 79 and 80";
}

/// A cell of any order, by its first type; Bezier cells are numbered alike.
constexpr int kFirstLagrange = 71, kFirstBezier = 78;
constexpr CellKind kHigherKinds[] = {CellKind::tet, CellKind::hex, CellKind::prism};

/// The order of a Lagrange or Bezier cell of so many nodes; 0 if there is none.
int order_of(CellKind kind, std::size_t num_nodes) {
  constexpr int kMostOrder = 16;
  for (int order = 1; order <= kMostOrder; ++order)
    if (num_lattice_points(kind, order) == num_nodes) return order;
  return 0;
}

/// Swaps the nodes inside the last two edges of a hex, as files before XML 2.1 and legacy 5.1 have them.
void swap_last_edges(int order, std::vector<Index>& nodes) {
  const auto inside = static_cast<std::ptrdiff_t>(order) - 1, first = 8 + 10 * inside;
  std::swap_ranges(nodes.begin() + first, nodes.begin() + first + inside, nodes.begin() + first + inside);
}

}  // namespace

void add_face(NodalMesh& mesh, std::span<const Index> corners, Index group) {
  mesh.face_groups.faces.push_back({face_key(corners), group});
}

VtkCellUse add_vtk_cell(NodalMesh& mesh, NodalCells& cells, int type, std::span<const std::int64_t> nodes,
                        bool old_numbers, const std::function<void(const std::string&)>& fail) {
  if (std::find(std::begin(kLowerDimensions), std::end(kLowerDimensions), type) != std::end(kLowerDimensions))
    return VtkCellUse::lower_dimension;
  const auto fixed = std::find_if(fixed_cells().begin(), fixed_cells().end(),
                                  [&](const FixedCell& cell) { return cell.type == type; });
  const bool is_fixed = fixed != fixed_cells().end();
  const bool is_bezier = type >= kFirstBezier && type < kFirstBezier + 3;
  const int higher_kind = type - (is_bezier ? kFirstBezier : kFirstLagrange);
  if (!is_fixed && (higher_kind < 0 || higher_kind > 2)) fail(refusal(type));
  const CellKind kind = is_fixed ? fixed->kind : kHigherKinds[higher_kind];
  const int order = is_fixed ? fixed->order : order_of(kind, nodes.size());
  if (is_fixed && nodes.size() != fixed->size)
    fail("of VTK type " + std::to_string(type) + " has " + std::to_string(nodes.size()) + " points, expected " +
         std::to_string(fixed->size));
  if (order == 0)
    fail("of VTK type " + std::to_string(type) + " has " + std::to_string(nodes.size()) + " points, as no " +
         cell_topology(kind).name + " of an order from 1 to 16");
  std::vector<Index> own;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const std::int64_t v = nodes[is_fixed && !fixed->node.empty() ? static_cast<std::size_t>(fixed->node[i]) : i];
    if (v < 0 || static_cast<std::uint64_t>(v) >= mesh.positions.size())
      fail("names point " + std::to_string(v) + " of " + std::to_string(mesh.positions.size()));
    own.push_back(static_cast<Index>(v));
  }
  if (!is_fixed && kind == CellKind::hex && old_numbers && order > 1) swap_last_edges(order, own);
  cells.add(kind, order, NodeOrdering::vtk, own);
  return is_bezier ? VtkCellUse::bezier : VtkCellUse::added;
}

}  // namespace subvol::internal
