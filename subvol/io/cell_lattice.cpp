// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/cell_lattice.h"

#include "subvol/base/error.h"

#include <array>
#include <span>
#include <string>

namespace subvol {
namespace {

using Lattice = std::vector<LatticePoint>;
using Edge = std::array<int, 2>;

/// Corners of a face; the last is -1 for a triangle.
using Face = std::array<int, 4>;

constexpr Edge kTriangleEdges[] = {{0, 1}, {1, 2}, {2, 0}};
constexpr Edge kQuadEdges[] = {{0, 1}, {1, 2}, {2, 3}, {3, 0}};

constexpr Edge kVtkTetEdges[] = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};
constexpr Edge kVtkPrismEdges[] = {{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5}, {5, 3}, {0, 3}, {1, 4}, {2, 5}};
constexpr Edge kVtkHexEdges[] = {{0, 1}, {1, 2}, {3, 2}, {0, 3}, {4, 5}, {5, 6},
                                 {7, 6}, {4, 7}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};
constexpr Face kVtkTetFaces[] = {{0, 1, 3, -1}, {2, 3, 1, -1}, {0, 3, 2, -1}, {0, 2, 1, -1}};
constexpr Face kVtkPrismFaces[] = {{0, 1, 2, -1}, {3, 4, 5, -1}, {0, 1, 4, 3}, {1, 2, 5, 4}, {2, 0, 3, 5}};
constexpr Face kVtkHexFaces[] = {{0, 3, 7, 4}, {1, 2, 6, 5}, {0, 1, 5, 4}, {3, 2, 6, 7}, {0, 1, 2, 3}, {4, 5, 6, 7}};

constexpr Edge kGmshTetEdges[] = {{0, 1}, {1, 2}, {2, 0}, {3, 0}, {3, 2}, {3, 1}};
constexpr Edge kGmshPrismEdges[] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 4}, {2, 5}, {3, 4}, {3, 5}, {4, 5}};
constexpr Edge kGmshHexEdges[] = {{0, 1}, {0, 3}, {0, 4}, {1, 2}, {1, 5}, {2, 3},
                                  {2, 6}, {3, 7}, {4, 5}, {4, 7}, {5, 6}, {6, 7}};
constexpr Face kGmshTetFaces[] = {{0, 2, 1, -1}, {0, 1, 3, -1}, {0, 3, 2, -1}, {3, 1, 2, -1}};
constexpr Face kGmshPrismFaces[] = {{0, 2, 1, -1}, {3, 4, 5, -1}, {0, 1, 4, 3}, {0, 3, 5, 2}, {1, 2, 5, 4}};
constexpr Face kGmshHexFaces[] = {{0, 3, 2, 1}, {0, 1, 5, 4}, {0, 4, 7, 3}, {1, 2, 6, 5}, {2, 3, 7, 6}, {4, 5, 6, 7}};

/// A part of the grid, given by its corners; its edges have `order` steps.
struct Part {
  Lattice corners;
  int order;

  LatticePoint step(int from, int to) const { return (corners[to] - corners[from]) / order; }
};

void add_inside_edge(Lattice& out, const Part& part, const Edge& edge) {
  for (int t = 1; t < part.order; ++t) out.push_back(part.corners[edge[0]] + t * part.step(edge[0], edge[1]));
}

bool is_triangle(const Face& face) { return face[3] < 0; }

void add_rows_inside_face(Lattice& out, const Part& part, const Face& face) {
  const int beside = is_triangle(face) ? face[2] : face[3], p = part.order;
  const LatticePoint first = part.corners[face[0]], i_step = part.step(face[0], face[1]),
                     j_step = part.step(face[0], beside);
  for (int j = 1; j < p; ++j)
    for (int i = 1; i < (is_triangle(face) ? p - j : p); ++i) out.push_back(first + i * i_step + j * j_step);
}

/// The polygon one step inside `part`, which is a triangle or quad with all its edges.
Part inner_polygon(const Part& part) {
  const int n = static_cast<int>(part.corners.size());
  Part inner{part.corners, n == 3 ? part.order - 3 : part.order - 2};
  for (int k = 0; k < n; ++k) inner.corners[k] += part.step(k, (k + 1) % n) + part.step(k, (k + n - 1) % n);
  return inner;
}

void add_nested_polygon(Lattice& out, const Part& part) {
  if (part.order < 0) return;
  if (part.order == 0) return out.push_back(part.corners[0]);
  out.insert(out.end(), part.corners.begin(), part.corners.end());
  const std::span<const Edge> edges =
      part.corners.size() == 3 ? std::span<const Edge>(kTriangleEdges) : std::span<const Edge>(kQuadEdges);
  for (const Edge& edge : edges) add_inside_edge(out, part, edge);
  if (part.order > 1) add_nested_polygon(out, inner_polygon(part));
}

void add_nested_inside_face(Lattice& out, const Part& part, const Face& face) {
  Part polygon{{}, part.order};
  for (int k = 0; k < (is_triangle(face) ? 3 : 4); ++k) polygon.corners.push_back(part.corners[face[k]]);
  if (part.order > 1) add_nested_polygon(out, inner_polygon(polygon));
}

/// The cell one step inside `part`.
Part inner_cell(CellKind kind, const Part& part) {
  Part inner{part.corners, kind == CellKind::tet ? part.order - 4 : part.order - 2};
  for (std::size_t k = 0; k < part.corners.size(); ++k)
    for (const int neighbor : cell_topology(kind).corner_neighbors[k])
      inner.corners[k] += part.step(static_cast<int>(k), neighbor);
  return inner;
}

/// Lists of edges and faces by their corners; flags for nested faces and cells, which are in rows otherwise.
struct Scheme {
  std::span<const Edge> edges;
  std::span<const Face> faces;
  bool nested_faces, nested_cell;
};

Scheme vtk_scheme(CellKind kind) {
  if (kind == CellKind::tet) return {kVtkTetEdges, kVtkTetFaces, true, true};
  if (kind == CellKind::prism) return {kVtkPrismEdges, kVtkPrismFaces, false, false};
  return {kVtkHexEdges, kVtkHexFaces, false, false};
}

Scheme gmsh_scheme(CellKind kind) {
  if (kind == CellKind::tet) return {kGmshTetEdges, kGmshTetFaces, true, true};
  if (kind == CellKind::prism) return {kGmshPrismEdges, kGmshPrismFaces, true, false};
  return {kGmshHexEdges, kGmshHexFaces, true, true};
}

/// Adds all points, or with inset = 1 only the inner ones, u fastest.
void add_rows(Lattice& out, CellKind kind, int order, int inset) {
  const int last = order - inset;
  for (int k = inset; k <= last; ++k) {
    const int rest = kind == CellKind::tet ? last - k : last;
    for (int j = inset; j <= rest; ++j)
      for (int i = inset; i <= (kind == CellKind::hex ? last : rest - j); ++i) out.emplace_back(i, j, k);
  }
}

void add_by_scheme(Lattice& out, CellKind kind, const Part& part, const Scheme& scheme) {
  if (part.order < 0) return;
  if (part.order == 0) return out.push_back(part.corners[0]);
  out.insert(out.end(), part.corners.begin(), part.corners.end());
  for (const Edge& edge : scheme.edges) add_inside_edge(out, part, edge);
  for (const Face& face : scheme.faces)
    scheme.nested_faces ? add_nested_inside_face(out, part, face) : add_rows_inside_face(out, part, face);
  if (!scheme.nested_cell)
    add_rows(out, kind, part.order, 1);
  else if (part.order > 1)
    add_by_scheme(out, kind, inner_cell(kind, part), scheme);
}

Lattice corner_points(CellKind kind, int p) {
  if (kind == CellKind::tet) return {{0, 0, 0}, {p, 0, 0}, {0, p, 0}, {0, 0, p}};
  if (kind == CellKind::prism) return {{0, 0, 0}, {p, 0, 0}, {0, p, 0}, {0, 0, p}, {p, 0, p}, {0, p, p}};
  if (kind == CellKind::pyramid) return {{0, 0, 0}, {p, 0, 0}, {p, p, 0}, {0, p, 0}, {0, 0, p}};
  return {{0, 0, 0}, {p, 0, 0}, {p, p, 0}, {0, p, 0}, {0, 0, p}, {p, 0, p}, {p, p, p}, {0, p, p}};
}

}  // namespace

std::vector<LatticePoint> cell_lattice(CellKind kind, int order, NodeOrdering ordering) {
  if (order < 1) throw InputError("cell_lattice: the order is " + std::to_string(order) + ", expected 1 or more");
  if (ordering == NodeOrdering::gmsh && kind == CellKind::prism && order > 2)
    throw InputError("cell_lattice: Gmsh evaluates prisms up to order 2 only, got " + std::to_string(order));
  if (kind == CellKind::pyramid && order > 1)
    throw InputError("cell_lattice: pyramids have order 1 only, got " + std::to_string(order));
  if (kind == CellKind::pyramid) return corner_points(kind, order);
  Lattice points;
  if (ordering == NodeOrdering::rows)
    add_rows(points, kind, order, 0);
  else
    add_by_scheme(points, kind, {corner_points(kind, order), order},
                  ordering == NodeOrdering::vtk ? vtk_scheme(kind) : gmsh_scheme(kind));
  return points;
}

std::size_t num_lattice_points(CellKind kind, int order) {
  const auto n = static_cast<std::size_t>(order) + 1;
  if (kind == CellKind::tet) return n * (n + 1) * (n + 2) / 6;
  if (kind == CellKind::pyramid) return n * (n + 1) * (2 * n + 1) / 6;
  return kind == CellKind::prism ? n * n * (n + 1) / 2 : n * n * n;
}

}  // namespace subvol
