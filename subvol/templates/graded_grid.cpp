// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/templates/graded_grid.h"

#include "subvol/templates/carve.h"
#include "subvol/templates/refine.h"
#include "subvol/templates/solid_fraction.h"
#include "subvol/templates/voxel_evolution.h"
#include "subvol/templates/voxel_topology.h"

#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

namespace subvol::internal {

namespace {

constexpr int kParts = 3;  // of an edge of a cell that is cut
constexpr std::size_t kAllParts = kParts * kParts * kParts;

using Place = std::array<int, 3>;  ///< of a cell in a grid

bool is_on_outer_layer(const VoxelGrid& grid, const Place& at) {
  for (std::size_t a = 0; a < 3; ++a)
    if (at[a] <= 0 || at[a] >= grid.cells[a] - 1) return true;
  return false;
}

/// Calls `visit` with each cell of a grid that touches a cell, and with that cell.
template <class Visit>
void for_each_around(const VoxelGrid& grid, const Place& at, Visit&& visit) {
  for (int k = std::max(at[2] - 1, 0); k <= std::min(at[2] + 1, grid.cells[2] - 1); ++k)
    for (int j = std::max(at[1] - 1, 0); j <= std::min(at[1] + 1, grid.cells[1] - 1); ++j)
      for (int i = std::max(at[0] - 1, 0); i <= std::min(at[0] + 1, grid.cells[0] - 1); ++i) visit(grid.cell(i, j, k));
}

/// Maps points to lattice coordinates in a grid.
class LatticeCoordinates {
 public:
  explicit LatticeCoordinates(const VoxelGrid& grid) : grid_(grid), to_grid_(grid.edges.inverse()) {}
  Vec3 operator()(const Vec3& point) const {
    const Vec3 along = to_grid_ * (point - grid_.origin);
    return {grid_.coordinate(0, along[0]), grid_.coordinate(1, along[1]), grid_.coordinate(2, along[2])};
  }

 private:
  const VoxelGrid& grid_;
  Mat3 to_grid_;
};

/// Returns the grid of the parts of the cells from `low` up to, not including, `high`.
VoxelGrid grid_of_parts(const VoxelGrid& grid, const Place& low, const Place& high) {
  VoxelGrid parts;
  parts.origin = grid.origin;
  parts.edges = grid.edges;
  for (std::size_t a = 0; a < 3; ++a) {
    parts.cells[a] = kParts * (high[a] - low[a]);
    for (int i = 0; i <= parts.cells[a]; ++i)
      parts.lines[a].push_back(grid.position(a, low[a] + static_cast<double>(i) / kParts));
  }
  return parts;
}

/// Tells which parts of the cells that are cut in 27 are kept.
class CarvedParts {
 public:
  /// is_cut  one entry per cell of the grid.
  CarvedParts(const TriangleMesh& surface, const VoxelGrid& grid, std::span<const char> kept,
              std::span<const char> is_cut, SearchStop* stop)
      : surface_(surface), grid_(grid), kept_(kept), is_cut_(is_cut), stop_(stop), parts_(kept.size(), 0) {
    std::vector<char> is_done(is_cut.size(), 0);
    for (std::size_t c = 0; c < is_cut.size(); ++c)
      if (is_cut[c] && !is_done[c] && !(stop && stop->is_stopped()))
        carve_set(connected(static_cast<Index>(c), is_done));
  }

  /// part  its place among the 27 of the cell.
  bool is_kept(Index cell, const Place& part) const { return (parts_[cell] >> bit(part) & 1) != 0; }

 private:
  static int bit(const Place& part) { return part[0] + kParts * (part[1] + kParts * part[2]); }

  std::vector<Index> connected(Index first, std::vector<char>& is_done) const {
    std::vector<Index> cells = {first};
    is_done[first] = 1;
    for (std::size_t q = 0; q < cells.size(); ++q)
      for_each_around(grid_, grid_.place(cells[q]), [&](Index c) {
        if (!is_cut_[c] || is_done[c]) return;
        is_done[c] = 1;
        cells.push_back(c);
      });
    return cells;
  }

  void carve_set(std::span<const Index> cells) {
    Place low = grid_.cells, high{};
    for (const Index c : cells) {
      const Place at = grid_.place(c);
      for (std::size_t a = 0; a < 3; ++a) {  // the cells around them, whose state matters, lie in the box, too
        low[a] = std::min(low[a], at[a] - 1);
        high[a] = std::max(high[a], at[a] + 2);
      }
    }
    const VoxelGrid parts = grid_of_parts(grid_, low, high);
    const std::vector<double> fractions = solid_fractions(surface_, parts, 4, stop_);
    const auto cell_of = [&](const Place& at) {
      return grid_.cell(low[0] + at[0] / kParts, low[1] + at[1] / kParts, low[2] + at[2] / kParts);
    };
    VoxelSolid solid(parts.cells, VertexRule::pillowable);
    for (std::size_t p = 0; p < solid.num_cells(); ++p) {
      const auto part = static_cast<Index>(p);
      const Index cell = cell_of(parts.place(part));
      if (solid.may_flip(part) && kept_[cell]) solid.flip(part);
    }
    std::vector<char> in_set(kept_.size(), 0);
    for (const Index c : cells) in_set[c] = 1;
    for (std::size_t p = 0; p < solid.num_cells(); ++p)
      if (!in_set[cell_of(parts.place(static_cast<Index>(p)))]) solid.freeze(static_cast<Index>(p));
    const VoxelGoal goal{fractions, 0.5, {}, stop_};
    evolve(solid, goal);
    reach_thin_parts(solid, goal);
    for (std::size_t p = 0; p < solid.num_cells(); ++p) {
      const Place at = parts.place(static_cast<Index>(p));
      const Index cell = cell_of(at);
      if (in_set[cell] && solid.filled(static_cast<Index>(p)))
        parts_[cell] |= 1u << bit({at[0] % kParts, at[1] % kParts, at[2] % kParts});
    }
  }

  const TriangleMesh& surface_;
  const VoxelGrid& grid_;
  std::span<const char> kept_, is_cut_;
  SearchStop* stop_;
  std::vector<std::uint32_t> parts_;  ///< for each cell, a bit for each part that is kept
};

}  // namespace

GradedGrid graded_grid(const TriangleMesh& surface, const VoxelGrid& grid, std::span<const char> kept,
                       std::span<const char> cut, SearchStop* stop) {
  std::vector<char> is_there(kept.begin(), kept.end()), is_cut(cut.begin(), cut.end());
  for (std::size_t c = 0; c < is_cut.size(); ++c) {
    const Place at = grid.place(static_cast<Index>(c));
    if (is_cut[c] && is_on_outer_layer(grid, at)) is_cut[c] = 0;
    if (is_cut[c]) for_each_around(grid, at, [&](Index other) { is_there[other] = 1; });
  }
  const VolumeMesh whole = voxel_mesh(grid, is_there);
  std::vector<Index> cell_of;  // of the grid, for each cell of that mesh
  std::vector<char> chosen;
  for (std::size_t c = 0; c < is_there.size(); ++c)
    if (is_there[c]) {
      cell_of.push_back(static_cast<Index>(c));
      chosen.push_back(is_cut[c]);
    }
  const LocalRefinement refined = refine_locally(whole, vertices_of(whole, chosen), WarpedParts::kept);
  std::vector<std::size_t> num_parts(cell_of.size(), 0);
  for (const Index parent : refined.parents) ++num_parts[parent];
  for (std::size_t c = 0; c < cell_of.size(); ++c)
    is_cut[cell_of[c]] = num_parts[c] == kAllParts && !is_on_outer_layer(grid, grid.place(cell_of[c]));
  const CarvedParts parts(surface, grid, kept, is_cut, stop);

  const LatticeCoordinates lattice(grid);
  const auto is_kept = [&](std::size_t c) {
    const Index cell = cell_of[refined.parents[c]];
    if (!is_cut[cell]) return kept[cell] != 0;
    Vec3 center = Vec3::Zero();
    for (const Index v : refined.mesh.cell(c)) center += refined.mesh.positions[v] / 8;
    const Place at = grid.place(cell);
    const Vec3 place = lattice(center);
    Place part;
    for (std::size_t a = 0; a < 3; ++a)
      part[a] = std::clamp(static_cast<int>(kParts * (place[static_cast<int>(a)] - at[a])), 0, kParts - 1);
    return parts.is_kept(cell, part);
  };
  GradedGrid result;
  for (std::size_t c = 0; c < refined.mesh.num_cells(); ++c)
    if (is_kept(c)) result.sizes.push_back(1 / std::cbrt(num_parts[refined.parents[c]]));
  if (!result.sizes.empty()) result.mesh = carve(refined.mesh, is_kept);
  return result;
}

std::vector<char> cells_around_points(const VoxelGrid& grid, std::span<const Vec3> points) {
  std::vector<char> marked(grid.num_cells(), 0);
  const LatticeCoordinates lattice(grid);
  for (const Vec3& point : points) {
    const Vec3 at = lattice(point);
    Place cell;
    bool is_inside = true;
    for (std::size_t a = 0; a < 3; ++a) {
      const double coordinate = std::floor(at[static_cast<int>(a)]);
      is_inside = is_inside && coordinate >= 0 && coordinate < grid.cells[a];
      if (is_inside) cell[a] = static_cast<int>(coordinate);
    }
    if (is_inside) for_each_around(grid, cell, [&](Index c) { marked[c] = 1; });
  }
  return marked;
}

}  // namespace subvol::internal
