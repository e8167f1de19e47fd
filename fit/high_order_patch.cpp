// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/high_order_patch.h"

#include "subvol/fit/stages/quality_patches.h"

#include <algorithm>
#include <cstdint>
#include <utility>

namespace subvol::internal {

namespace {

using Marks = std::vector<std::uint8_t>;

/// Returns the cells with a marked vertex, ascending.
std::vector<Index> cells_at(const VolumeMesh& mesh, const Marks& vertices) {
  std::vector<Index> cells;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    if (std::ranges::any_of(mesh.cell(c), [&](Index v) { return vertices[v] != 0; }))
      cells.push_back(static_cast<Index>(c));
  return cells;
}

Marks vertices_within(const VolumeMesh& mesh, std::span<const Index> centers, int rings) {
  Marks marks(mesh.num_vertices(), 0);
  const auto mark = [&](std::span<const Index> cells) {
    for (const Index c : cells)
      for (const Index v : mesh.cell(c)) marks[v] = 1;
  };
  mark(centers);
  for (int ring = 0; ring < rings; ++ring) mark(cells_at(mesh, marks));
  return marks;
}

/// Returns the nodes of the vertices, edges, faces and cells all of whose vertices are marked.
std::vector<Index> nodes_between(const ElementSpace& space, const Marks& vertices) {
  const MeshTopology& topology = space.topology();
  std::vector<Index> nodes;
  const auto add = [&](std::size_t begin, std::size_t end, std::span<const Index> corners) {
    if (!std::ranges::all_of(corners, [&](Index v) { return vertices[v] != 0; })) return;
    for (std::size_t node = begin; node < end; ++node) nodes.push_back(static_cast<Index>(node));
  };
  for (std::size_t v = 0; v < vertices.size(); ++v)
    if (vertices[v]) nodes.push_back(static_cast<Index>(v));
  for (std::size_t e = 0; e < topology.num_edges(); ++e)
    add(space.edge_nodes(e), space.edge_nodes(e + 1), topology.edge(static_cast<Index>(e)));
  for (std::size_t f = 0; f < topology.num_faces(); ++f)
    add(space.face_nodes(f), space.face_nodes(f + 1), topology.face(static_cast<Index>(f)));
  for (std::size_t c = 0; c < space.num_cells(); ++c)
    add(space.cell_nodes(c), space.cell_nodes(c + 1), space.vertices(c));
  return nodes;
}

/// The orders of the entities of a part of a mesh, whose cells have these numbers in it.
EntityOrders orders_of_part(const MeshTopology& part, const ElementSpace& whole, std::span<const Index> cells) {
  EntityOrders orders = EntityOrders::uniform(part, 1);
  const auto copy = [](std::span<const Index> to, std::span<const Index> from, const std::vector<int>& values,
                       std::vector<int>& result) {
    for (std::size_t k = 0; k < to.size(); ++k) result[to[k]] = values[from[k]];
  };
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const Index c = cells[i];
    copy(part.cell_edges(i), whole.topology().cell_edges(c), whole.orders().edges, orders.edges);
    copy(part.cell_faces(i), whole.topology().cell_faces(c), whole.orders().faces, orders.faces);
    orders.cells[i] = whole.orders().cells[c];
  }
  return orders;
}

/// The space of some cells of a mesh, with its orders. The vertices of the part are numbered in the order of the mesh,
/// so that the frames of its entities are the same.
ElementSpace space_of(const VolumeMesh& mesh, const ElementSpace& space, std::span<const Index> cells) {
  const VolumeMesh part = patch_mesh(mesh, cells);
  return {part, space.basis(), orders_of_part(MeshTopology(part), space, cells)};
}

/// For each node of a part, the node of the whole mesh.
std::vector<Index> nodes_of_part(const ElementSpace& part, const ElementSpace& whole, std::span<const Index> cells) {
  std::vector<Index> nodes(part.num_nodes());
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const auto own = part.nodes(i), of_whole = whole.nodes(cells[i]);
    for (std::size_t a = 0; a < own.size(); ++a) nodes[own[a]] = of_whole[a];
  }
  return nodes;
}

}  // namespace

HighOrderMesh cells_of(const HighOrderMesh& mesh, std::span<const Index> cells) {
  ElementSpace space = space_of(mesh.straight_sided(), mesh.space, cells);
  std::vector<Vec3> coefficients;
  for (const Index node : nodes_of_part(space, mesh.space, cells)) coefficients.push_back(mesh.coefficients[node]);
  return {std::move(space), std::move(coefficients)};
}

std::vector<Vec3> HighOrderPatch::coefficients(std::span<const Vec3> of_mesh) const {
  std::vector<Vec3> result;
  for (const Index node : nodes) result.push_back(of_mesh[node]);
  return result;
}

std::optional<HighOrderPatch> high_order_patch(const VolumeMesh& mesh, const ElementSpace& space,
                                               std::span<const Index> centers, int rings, std::size_t most_cells) {
  const Marks moves = vertices_within(mesh, centers, rings);
  std::vector<Index> cells = cells_at(mesh, moves);
  if (cells.size() > most_cells) return {};
  ElementSpace part = space_of(mesh, space, cells);
  std::vector<Index> nodes = nodes_of_part(part, space, cells);
  return HighOrderPatch{nodes_between(space, moves), std::move(cells), std::move(part), std::move(nodes)};
}

FitProblem patch_problem(const HighOrderPatch& patch, std::span<const Vec3> coefficients,
                         std::unique_ptr<VolumeTerm> volume, const BoundarySamples& samples,
                         const ClosestPointEnergy& surface, double lambda) {
  // All other nodes stay where they are.
  Marks moves(coefficients.size(), 0);
  std::vector<Vec3> fixed(coefficients.begin(), coefficients.end());
  for (const Index node : patch.unknowns) {
    moves[node] = 1;
    fixed[node].setZero();
  }

  std::vector<Index> triangles, rows, numbers(samples.points.size(), kNoIndex);
  Marks is_used(samples.points.size(), 0), is_sample_free(samples.points.size(), 0);
  for (std::size_t i = 0; i < is_sample_free.size(); ++i)
    is_sample_free[i] =
        std::ranges::any_of(samples.positions.row_columns(i), [&](Index node) { return moves[node] != 0; });
  for (std::size_t t = 0; t < samples.triangles.size(); ++t) {
    const auto& corners = samples.triangles[t];
    if (!std::ranges::any_of(corners, [&](Index sample) { return is_sample_free[sample] != 0; })) continue;
    triangles.push_back(static_cast<Index>(t));
    for (const Index sample : corners) is_used[sample] = 1;
  }
  if (surface.creases())
    surface.creases()->mark_moving_curves([&](Index sample) { return is_sample_free[sample] != 0; }, is_used);
  Marks is_free_row;
  std::vector<Vec3> fixed_samples;
  for (std::size_t i = 0; i < is_used.size(); ++i) {
    if (!is_used[i]) continue;
    numbers[i] = static_cast<Index>(rows.size());
    rows.push_back(static_cast<Index>(i));
    is_free_row.push_back(is_sample_free[i]);
    Vec3& position = fixed_samples.emplace_back(Vec3::Zero());
    for (std::size_t k = 0; k < samples.positions.row_size(i); ++k)
      position += samples.positions.row_values(i)[k] * fixed[samples.positions.row_columns(i)[k]];
  }

  std::unique_ptr<SurfaceTerm> part;
  if (!triangles.empty()) part = std::make_unique<ClosestPointEnergy>(surface, triangles, numbers, is_free_row);
  FitProblem problem(select(identity_map(coefficients.size()), patch.nodes, patch.unknowns),
                     select(samples.positions, rows, patch.unknowns), std::move(volume), std::move(part), lambda);
  problem.fixed_nodes = patch.coefficients(fixed);
  problem.fixed_samples = std::move(fixed_samples);
  return problem;
}

}  // namespace subvol::internal
