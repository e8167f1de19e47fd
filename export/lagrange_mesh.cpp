// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/lagrange_mesh.h"

#include "subvol/base/error.h"
#include "subvol/base/parallel_errors.h"
#include "subvol/fit/elements/pattern_table.h"
#include "subvol/io/bezier_cells.h"
#include "subvol/mesh/pyramids.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <utility>

namespace subvol::internal {
namespace {

/// Location of a grid point: the part of its cell on which it lies, and its weights at the cell's vertices.
struct LatticeNode {
  enum class On { vertex, edge, face, cell };
  On on = On::cell;
  int part = 0;  ///< local number of the vertex, edge or face
  /// Weights of the local vertices; their sum is order^d with d = 1 for a tet, 2 for a prism, 3 for a hex.
  std::array<std::int64_t, 8> weights{};
};

/// Weights of the corners, as exact integers.
std::array<std::int64_t, 8> corner_weights(CellKind kind, std::int64_t p, const LatticePoint& at) {
  const std::int64_t u = at[0], v = at[1], w = at[2];
  if (kind == CellKind::tet) return {p - u - v - w, u, v, w};
  if (kind == CellKind::prism) {
    const std::int64_t a = p - u - v, b = p - w;
    return {a * b, u * b, v * b, a * w, u * w, v * w};
  }
  const std::int64_t a = p - u, b = p - v, c = p - w;
  return {a * b * c, u * b * c, u * v * c, a * v * c, a * b * w, u * b * w, u * v * w, a * v * w};
}

bool is_positive(std::int64_t weight) { return weight > 0; }

LatticeNode classify(CellKind kind, int order, const LatticePoint& at) {
  LatticeNode node{.weights = corner_weights(kind, order, at)};
  const CellTopology& topology = cell_topology(kind);
  const auto num_used = std::count_if(node.weights.begin(), node.weights.end(), is_positive);
  const auto used_in = [&](const auto& corners) {
    return std::count_if(corners.begin(), corners.end(), [&](int v) { return v >= 0 && node.weights[v] > 0; });
  };
  if (num_used == 1) {
    node.on = LatticeNode::On::vertex;
    node.part =
        static_cast<int>(std::find_if(node.weights.begin(), node.weights.end(), is_positive) - node.weights.begin());
    return node;
  }
  for (int e = 0; e < topology.num_edges; ++e)
    if (used_in(topology.edges[e]) == num_used) {
      node.on = LatticeNode::On::edge;
      node.part = e;
      return node;
    }
  for (int f = 0; f < topology.num_faces; ++f)
    if (used_in(topology.faces[f]) == num_used) {
      node.on = LatticeNode::On::face;
      node.part = f;
      return node;
    }
  return node;
}

/// The grid of one kind and order, with its points classified once.
struct Lattice {
  std::vector<LatticeNode> nodes;
  std::vector<Vec3> points;
};

Lattice make_lattice(CellKind kind, int order, NodeOrdering ordering) {
  Lattice lattice;
  for (const LatticePoint& at : cell_lattice(kind, order, ordering)) {
    lattice.nodes.push_back(classify(kind, order, at));
    lattice.points.push_back(at.cast<double>() / order);
  }
  return lattice;
}

/// Numbers points: those on an edge or face in its own frame, so that all cells around it agree.
class NodeNumbering {
 public:
  explicit NodeNumbering(const ElementSpace& space) : space_(space), count_(space.num_vertices()) {}

  std::size_t count() const { return count_; }

  Index number(std::size_t c, int order, const LatticeNode& node) {
    const auto vertices = space_.vertices(c);
    const auto share = [&](Index v) {
      return node.weights[std::find(vertices.begin(), vertices.end(), v) - vertices.begin()];
    };
    const MeshTopology& topology = space_.topology();
    if (node.on == LatticeNode::On::vertex) return vertices[node.part];
    if (node.on == LatticeNode::On::cell) return static_cast<Index>(count_++);
    if (node.on == LatticeNode::On::edge) {
      const Index e = topology.cell_edges(c)[node.part];
      const auto [a, b] = topology.edge(e);
      const auto t = static_cast<Index>(share(b) * order / (share(a) + share(b)));
      return block(edge_blocks_, e, order, order - 1) + t - 1;
    }
    const Index f = topology.cell_faces(c)[node.part];
    const auto& [a, b, across, d] = space_.face_frame(f);
    const int rows = order - 1;
    if (d == kNoIndex) {
      const auto sum = share(a) + share(b) + share(across);
      const auto i = static_cast<int>(share(b) * order / sum), j = static_cast<int>(share(across) * order / sum);
      return block(face_blocks_, f, order, rows * (rows - 1) / 2) + triangle_place(order, i, j);
    }
    const auto sum = share(a) + share(b) + share(across) + share(d);
    const auto i = static_cast<int>((share(b) + share(across)) * order / sum);
    const auto j = static_cast<int>((share(d) + share(across)) * order / sum);
    return block(face_blocks_, f, order, rows * rows) + (j - 1) * rows + i - 1;
  }

 private:
  using Blocks = std::map<std::pair<Index, int>, Index>;

  /// First number of the points inside an edge or face with a grid of this order.
  Index block(Blocks& blocks, Index entity, int order, int size) {
    const auto [it, added] = blocks.try_emplace({entity, order}, static_cast<Index>(count_));
    if (added) count_ += static_cast<std::size_t>(size);
    return it->second;
  }
  /// Rows j = 1, 2, ..  of order - 2, order - 3, .. points.
  static int triangle_place(int order, int i, int j) { return (j - 1) * (order - 1) - j * (j - 1) / 2 + i - 1; }

  const ElementSpace& space_;
  std::size_t count_;
  Blocks edge_blocks_, face_blocks_;
};

using LatticeKey = std::pair<CellKind, int>;

/// Samples every cell and takes each point from the first cell that has it.
void evaluate(const HighOrderMesh& mesh, const std::map<LatticeKey, Lattice>& lattices, LagrangeMesh& out) {
  std::vector<Index> first_cell(out.positions.size(), kNoIndex);
  for (std::size_t c = out.num_cells(); c-- > 0;)
    for (const Index node : out.cell(c)) first_cell[node] = static_cast<Index>(c);
  std::map<std::pair<std::size_t, int>, std::vector<Index>> groups;
  for (std::size_t c = 0; c < out.num_cells(); ++c)
    groups[{mesh.space.pattern(c), out.orders[c]}].push_back(static_cast<Index>(c));
  const std::size_t num_vertices = mesh.space.num_vertices();
  for (const auto& [key, members] : groups) {
    const std::vector<Index>& cells = members;  // Clang before 16 does not accept structured bindings in a parallel
                                                // region
    const PatternTable table(mesh.space, key.first,
                             lattices.at({mesh.space.pattern_kind(key.first), key.second}).points);
    const auto sample = [&](Index c, std::vector<Vec3>& x) {
      x.resize(table.num_points());
      table.positions(mesh, c, x);
      const auto nodes = out.cell(c);
      for (std::size_t q = 0; q < x.size(); ++q)
        if (first_cell[nodes[q]] == c && static_cast<std::size_t>(nodes[q]) >= num_vertices)
          out.positions[nodes[q]] = x[q];
    };
    ParallelErrors errors;
#pragma omp parallel
    {
      std::vector<Vec3> x;
#pragma omp for schedule(static)
      for (std::size_t i = 0; i < cells.size(); ++i) errors.guard([&] { sample(cells[i], x); });
    }
    errors.rethrow();
  }
}

/// Corners of the pieces of a cell of one kind with n intervals per side, as grid points.
std::vector<std::vector<LatticePoint>> pieces(CellKind kind, int n) {
  std::vector<std::vector<LatticePoint>> result;
  const auto add = [&](const LatticePoint& at, std::initializer_list<LatticePoint> corners) {
    std::vector<LatticePoint> piece;
    for (const LatticePoint& corner : corners) piece.push_back(at + corner);
    result.push_back(std::move(piece));
  };
  const auto p = [](int i, int j, int k) { return LatticePoint(i, j, k); };
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        const LatticePoint at(i, j, k);
        if (kind == CellKind::hex) {
          add(at, {p(0, 0, 0), p(1, 0, 0), p(1, 1, 0), p(0, 1, 0), p(0, 0, 1), p(1, 0, 1), p(1, 1, 1), p(0, 1, 1)});
        } else if (kind == CellKind::prism) {
          if (i + j < n) add(at, {p(0, 0, 0), p(1, 0, 0), p(0, 1, 0), p(0, 0, 1), p(1, 0, 1), p(0, 1, 1)});
          if (i + j + 1 < n) add(at, {p(1, 0, 0), p(1, 1, 0), p(0, 1, 0), p(1, 0, 1), p(1, 1, 1), p(0, 1, 1)});
        } else {
          // A tet at the corner, four around the diagonal of the octahedron behind it, and one more that fills the
          // cube.
          const LatticePoint a = p(1, 0, 0), b = p(0, 1, 0), c = p(0, 0, 1), ab = p(1, 1, 0), bc = p(0, 1, 1),
                             ac = p(1, 0, 1), abc = p(1, 1, 1);
          if (i + j + k < n) add(at, {p(0, 0, 0), a, b, c});
          if (i + j + k + 1 < n) {
            add(at, {a, bc, b, c});
            add(at, {a, bc, ab, b});
            add(at, {a, bc, ac, ab});
            add(at, {a, bc, c, ac});
          }
          if (i + j + k + 2 < n) add(at, {ab, bc, ac, abc});
        }
      }
  return result;
}

}  // namespace

LagrangeMesh lagrange_mesh(const HighOrderMesh& mesh, std::span<const int> orders, NodeOrdering ordering) {
  const ElementSpace& space = mesh.space;
  if (orders.size() != space.num_cells())
    throw InputError("lagrange_mesh: " + std::to_string(orders.size()) + " orders for " +
                     std::to_string(space.num_cells()) + " cells");
  require_no_pyramids(space.kinds(), "lagrange_mesh: pyramids cannot be curved");
  std::map<LatticeKey, Lattice> lattices;
  LagrangeMesh out;
  out.orders.assign(orders.begin(), orders.end());
  NodeNumbering numbering(space);
  for (std::size_t c = 0; c < space.num_cells(); ++c) {
    const CellKind kind = space.kind(c);
    auto found = lattices.find({kind, orders[c]});
    if (found == lattices.end())
      found = lattices.emplace(LatticeKey{kind, orders[c]}, make_lattice(kind, orders[c], ordering)).first;
    for (const LatticeNode& node : found->second.nodes) out.cell_nodes.push_back(numbering.number(c, orders[c], node));
    out.kinds.push_back(kind);
    out.cell_offsets.push_back(out.cell_nodes.size());
    if (numbering.count() > static_cast<std::size_t>(std::numeric_limits<Index>::max()))
      throw InputError("lagrange_mesh: more points than an index can tell");
  }
  out.positions.assign(numbering.count(), Vec3::Zero());
  std::copy_n(mesh.coefficients.begin(), space.num_vertices(), out.positions.begin());
  evaluate(mesh, lattices, out);
  return out;
}

void use_control_points(LagrangeMesh& mesh) {
  nodes_to_control_points(mesh.positions, {mesh.kinds, mesh.orders, mesh.cell_offsets, mesh.cell_nodes});
}

std::vector<int> lagrange_orders(const ElementSpace& space, int limit) {
  std::vector<int> orders;
  for (std::size_t c = 0; c < space.num_cells(); ++c)
    orders.push_back(std::min(limit, space.pattern_order(space.pattern(c))));
  return orders;
}

VolumeMesh linear_cells(const HighOrderMesh& mesh, int intervals, std::vector<Index>* parents) {
  const std::size_t num_cells = mesh.space.num_cells();
  if (intervals < 1)
    throw InputError("linear_cells: intervals is " + std::to_string(intervals) + ", expected 1 or more");
  if (std::pow(intervals, 3) * static_cast<double>(num_cells) > std::numeric_limits<Index>::max())
    throw InputError("linear_cells: " + std::to_string(intervals) +
                     " intervals make more cells than an index can tell");
  const LagrangeMesh grid = lagrange_mesh(mesh, std::vector<int>(num_cells, intervals), NodeOrdering::rows);
  std::map<CellKind, std::vector<std::vector<int>>> places;  // positions of the corners of each piece in the grid's
                                                             // rows
  for (const CellKind kind : {CellKind::tet, CellKind::prism, CellKind::hex}) {
    std::map<std::array<int, 3>, int> place;
    for (const LatticePoint& at : cell_lattice(kind, intervals, NodeOrdering::rows))
      place.try_emplace({at[0], at[1], at[2]}, static_cast<int>(place.size()));
    for (const auto& piece : pieces(kind, intervals)) {
      std::vector<int> corners;
      for (const LatticePoint& at : piece) corners.push_back(place.at({at[0], at[1], at[2]}));
      places[kind].push_back(std::move(corners));
    }
  }
  VolumeMesh out;
  out.positions = grid.positions;
  if (parents) parents->clear();
  std::vector<Index> corners;
  for (std::size_t c = 0; c < num_cells; ++c) {
    const auto nodes = grid.cell(c);
    for (const std::vector<int>& piece : places.at(grid.kinds[c])) {
      corners.clear();
      for (const int q : piece) corners.push_back(nodes[q]);
      out.add_cell(grid.kinds[c], corners);
      if (parents) parents->push_back(static_cast<Index>(c));
    }
  }
  return out;
}

}  // namespace subvol::internal
