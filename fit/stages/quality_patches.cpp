// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/stages/quality_patches.h"

#include "subvol/base/disjoint_sets.h"
#include "subvol/base/sort_unique.h"

#include <algorithm>
#include <cstdint>
#include <utility>

namespace subvol::internal {

namespace {

/// Cells of each vertex.
struct VertexCells {
  explicit VertexCells(const VolumeMesh& mesh) : offsets(mesh.num_vertices() + 1, 0), cells(mesh.cell_vertices.size()) {
    for (const Index v : mesh.cell_vertices) ++offsets[v + 1];
    for (std::size_t v = 0; v < mesh.num_vertices(); ++v) offsets[v + 1] += offsets[v];
    std::vector<std::size_t> next(offsets.begin(), offsets.end() - 1);
    for (std::size_t c = 0; c < mesh.num_cells(); ++c)
      for (const Index v : mesh.cell(c)) cells[next[v]++] = static_cast<Index>(c);
  }
  std::span<const Index> of(Index v) const { return {cells.data() + offsets[v], offsets[v + 1] - offsets[v]}; }

  std::vector<std::size_t> offsets;
  std::vector<Index> cells;
};

std::vector<Index> marked_ones(const std::vector<std::uint8_t>& marks) {
  std::vector<Index> result;
  for (std::size_t i = 0; i < marks.size(); ++i)
    if (marks[i]) result.push_back(static_cast<Index>(i));
  return result;
}

/// Marks the cells around the centers: them and so many rings of cells that share a vertex.
std::vector<std::uint8_t> core_cells(const VolumeMesh& mesh, const VertexCells& cells_of,
                                     std::span<const Index> centers, int rings) {
  std::vector<std::uint8_t> is_core(mesh.num_cells(), 0);
  std::vector<Index> front(centers.begin(), centers.end());
  for (const Index c : front) is_core[c] = 1;
  for (int ring = 0; ring < rings; ++ring) {
    std::vector<Index> next;
    for (const Index c : front)
      for (const Index v : mesh.cell(c))
        for (const Index other : cells_of.of(v))
          if (!std::exchange(is_core[other], std::uint8_t{1})) next.push_back(other);
    front = std::move(next);
  }
  return is_core;
}

/// Joins the unknowns that are free and move one cell, or one triangle. Each has a set that one of them stands for.
class JoinedUnknowns {
 public:
  explicit JoinedUnknowns(std::span<const std::uint8_t> is_free) : is_free_(is_free), sets_(is_free.size()) {}

  /// Joins those of which the vertices, or samples, are made. Returns one of them; kNoIndex if none is free.
  Index join(const SparseMap& map, std::span<const Index> rows) {
    Index first = kNoIndex;
    for (const Index row : rows)
      for (const Index j : map.row_columns(row)) {
        if (!is_free_[j]) continue;
        if (first == kNoIndex) first = j;
        sets_.join(first, j);
      }
    return first;
  }
  Index set_of(Index unknown) { return sets_.of(unknown); }

 private:
  std::span<const std::uint8_t> is_free_;
  DisjointSets sets_;
};

}  // namespace

std::vector<QualityPatch> quality_patches(const VolumeMesh& mesh, const FitProblem& problem,
                                          std::span<const std::array<Index, 3>> triangles,
                                          std::span<const Index> centers, int rings, std::size_t most_cells) {
  const VertexCells cells_of(mesh);
  std::vector<std::uint8_t> is_free(problem.nodes.num_cols, 0);
  for (const Index c : marked_ones(core_cells(mesh, cells_of, centers, rings)))
    for (const Index v : mesh.cell(c))
      for (const Index j : problem.nodes.row_columns(v)) is_free[j] = 1;

  const std::vector<Index> free = marked_ones(is_free);
  std::vector<std::uint8_t> moves(mesh.num_vertices(), 0), is_active(mesh.num_cells(), 0);
  for (const Index j : free)
    for (const Index v : problem.nodes_transposed.row_columns(j)) moves[v] = 1;
  for (const Index v : marked_ones(moves))
    for (const Index c : cells_of.of(v)) is_active[c] = 1;
  const std::vector<Index> active = marked_ones(is_active);
  if (active.size() > most_cells) return {};

  JoinedUnknowns joined(is_free);
  std::vector<Index> free_of_cell, free_of_triangle;
  for (const Index c : active) free_of_cell.push_back(joined.join(problem.nodes, mesh.cell(c)));
  for (const auto& triangle : triangles) free_of_triangle.push_back(joined.join(problem.samples, triangle));

  std::vector<QualityPatch> patches;
  std::vector<Index> patch_of_set(problem.nodes.num_cols, kNoIndex);
  for (const Index j : free) {
    Index& patch = patch_of_set[joined.set_of(j)];
    if (patch == kNoIndex) {
      patch = static_cast<Index>(patches.size());
      patches.emplace_back();
    }
    patches[patch].unknowns.push_back(j);
  }
  for (std::size_t i = 0; i < active.size(); ++i) {
    QualityPatch& patch = patches[patch_of_set[joined.set_of(free_of_cell[i])]];
    patch.cells.push_back(active[i]);
    const auto vertices = mesh.cell(active[i]);
    patch.vertices.insert(patch.vertices.end(), vertices.begin(), vertices.end());
  }
  for (std::size_t t = 0; t < triangles.size(); ++t)
    if (const Index j = free_of_triangle[t]; j != kNoIndex)
      patches[patch_of_set[joined.set_of(j)]].triangles.push_back(static_cast<Index>(t));
  for (QualityPatch& patch : patches) {
    sort_unique(patch.vertices);
  }
  return patches;
}

VolumeMesh patch_mesh(const VolumeMesh& mesh, std::span<const Index> cells) {
  std::vector<std::uint8_t> is_used(mesh.num_vertices(), 0);
  for (const Index c : cells)
    for (const Index v : mesh.cell(c)) is_used[v] = 1;
  VolumeMesh part;
  std::vector<Index> numbers(mesh.num_vertices(), kNoIndex);
  for (const Index v : marked_ones(is_used)) {
    numbers[v] = static_cast<Index>(part.positions.size());
    part.positions.push_back(mesh.positions[v]);
  }
  std::vector<Index> corners;
  for (const Index c : cells) {
    corners.clear();
    for (const Index v : mesh.cell(c)) corners.push_back(numbers[v]);
    part.add_cell(mesh.kinds[c], corners);
  }
  return part;
}

SparseMap select(const SparseMap& map, std::span<const Index> rows, std::span<const Index> columns) {
  SparseMap part;
  part.num_cols = columns.size();
  for (const Index row : rows) {
    const auto entries = map.row_columns(row);
    const auto values = map.row_values(row);
    for (std::size_t k = 0; k < entries.size(); ++k) {
      const auto at = std::lower_bound(columns.begin(), columns.end(), entries[k]);
      if (at == columns.end() || *at != entries[k]) continue;
      part.columns.push_back(static_cast<Index>(at - columns.begin()));
      part.values.push_back(values[k]);
    }
    part.offsets.push_back(part.columns.size());
  }
  return part;
}

}  // namespace subvol::internal
