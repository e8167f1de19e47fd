// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/mesh/cell_checks.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <span>

namespace subvol::internal {

namespace {

/// The vertices of a cell in ascending order, with kNoIndex last.
using CellKey = std::array<Index, kMaxCellVertices>;

CellKey cell_key(std::span<const Index> vertices) {
  CellKey key;
  key.fill(kNoIndex);
  std::size_t size = 0;
  for (const Index v : vertices) {
    std::size_t i = size++;
    for (; i > 0 && key[i - 1] > v; --i) key[i] = key[i - 1];
    key[i] = v;
  }
  return key;
}

}  // namespace

bool check_array_sizes(const VolumeMesh& mesh, DefectList& defects) {
  const auto fail = [&](std::string message) {
    defects.add(MeshDefect::Kind::size_mismatch, kNoIndex, std::move(message));
    return false;
  };
  if (mesh.kinds.empty()) defects.add(MeshDefect::Kind::no_cells, kNoIndex, "the mesh has no cells");
  const auto& offsets = mesh.cell_offsets;
  if (offsets.size() != mesh.kinds.size() + 1 || offsets.front() != 0 || offsets.back() != mesh.cell_vertices.size())
    return fail("cell_offsets must run from 0 to the size of cell_vertices, one entry more than there are cells");
  for (std::size_t c = 0; c < mesh.kinds.size(); ++c) {
    if (static_cast<int>(mesh.kinds[c]) >= kNumCellKinds) return fail("cell " + std::to_string(c) + " is of no kind");
    const std::size_t expected = static_cast<std::size_t>(cell_topology(mesh.kinds[c]).num_vertices);
    if (offsets[c + 1] < offsets[c] || offsets[c + 1] - offsets[c] != expected)
      return fail(cell_name(mesh, c) + " must have " + std::to_string(expected) + " corners");
  }
  if (!mesh.references.empty() && mesh.references.size() != mesh.kinds.size())
    return fail("references must be empty or one per cell: " + std::to_string(mesh.references.size()) + " for " +
                std::to_string(mesh.kinds.size()) + " cells");
  return true;
}

bool check_vertex_numbers(const VolumeMesh& mesh, DefectList& defects) {
  const auto num_vertices = static_cast<Index>(mesh.num_vertices());
  bool good = true;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    for (const Index v : mesh.cell(c))
      if (v < 0 || v >= num_vertices) {
        defects.add(MeshDefect::Kind::index_out_of_range, c,
                    cell_name(mesh, c) + " names " + vertex_name(v) + " of " + std::to_string(num_vertices));
        good = false;
      }
  return good;
}

void check_positions(const VolumeMesh& mesh, DefectList& defects) {
  for (std::size_t v = 0; v < mesh.num_vertices(); ++v)
    if (!mesh.positions[v].allFinite())
      defects.add(MeshDefect::Kind::not_finite, v, vertex_name(v) + " has a coordinate that is not finite");
}

bool check_cell_vertices(const VolumeMesh& mesh, DefectList& defects) {
  const std::size_t before = defects.size();
  std::vector<std::pair<CellKey, Index>> items(mesh.num_cells());
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const auto cell = mesh.cell(c);
    items[c] = {cell_key(cell), static_cast<Index>(c)};
    const auto& key = items[c].first;
    const auto twice = std::adjacent_find(key.begin(), key.begin() + cell.size());
    if (twice != key.begin() + cell.size())
      defects.add(MeshDefect::Kind::repeated_vertex, c,
                  cell_name(mesh, c) + " names " + vertex_name(*twice) + " more than once");
  }
  const bool good = defects.size() == before;
  std::sort(items.begin(), items.end());
  for (std::size_t first = 0, i = 1; i < items.size(); ++i) {
    if (items[i].first != items[first].first) {
      first = i;
      continue;
    }
    const auto c = static_cast<std::size_t>(items[i].second);
    defects.add(MeshDefect::Kind::duplicate_cell, c,
                cell_name(mesh, c) + " has the same vertices as cell " + std::to_string(items[first].second));
  }
  return good;
}

void check_jacobians(const VolumeMesh& mesh, DefectList& defects) {
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const CellTopology& topology = cell_topology(mesh.kinds[c]);
    const auto position = [&](int corner) -> const Vec3& { return mesh.positions[mesh.cell(c)[corner]]; };
    int bad = 0, first = -1;
    for (int i = 0; i < topology.num_trivalent; ++i) {
      const auto& n = topology.corner_neighbors[i];
      const Vec3& x = position(i);
      const Vec3 e0 = position(n[0]) - x, e1 = position(n[1]) - x, e2 = position(n[2]) - x;
      if (e0.cross(e1).dot(e2) > 0) continue;
      if (bad++ == 0) first = i;
    }
    if (bad > 0)
      defects.add(MeshDefect::Kind::inverted_cell, c,
                  cell_name(mesh, c) + " is flat or left-handed at " + std::to_string(bad) + " of " +
                      std::to_string(topology.num_trivalent) + " corners, first at " +
                      vertex_name(mesh.cell(c)[first]));
  }
}

void check_unused_vertices(const VolumeMesh& mesh, DefectList& defects) {
  std::vector<char> used(mesh.num_vertices(), 0);
  for (const Index v : mesh.cell_vertices) used[v] = 1;
  for (std::size_t v = 0; v < used.size(); ++v)
    if (!used[v])
      defects.add(MeshDefect::Kind::unused_vertex, v, vertex_name(static_cast<Index>(v)) + " belongs to no cell");
}

}  // namespace subvol::internal
