// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/templates/voxel_grid.h"

#include "subvol/base/error.h"
#include "subvol/base/format.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace subvol {

namespace {

void check_box(const Vec3& low, const Vec3& high) {
  if (!low.allFinite() || !high.allFinite() || !(high - low).allFinite() || !(low.array() < high.array()).all())
    throw InputError(
        "grid: the box and its sizes must be finite, and its high corner above its low one along every axis");
}

/// Returns true if the cells of a grid with so many lines can be numbered.
bool can_be_numbered(const std::array<double, 3>& num_lines) {
  // Lattice points are numbered with 32 bits, and a hex mesh has about three times as many faces.
  return num_lines[0] * num_lines[1] * num_lines[2] <= std::numeric_limits<Index>::max() / 4.0;
}

/// Throws if a grid with so many lines has more cells than can be numbered.
void check_lines(const std::array<double, 3>& num_lines) {
  if (!can_be_numbered(num_lines)) throw InputError("grid: more cells than can be numbered");
}

}  // namespace

double VoxelGrid::coordinate(std::size_t axis, double position) const {
  const std::vector<double>& at = lines[axis];
  if (at.empty()) return position;
  const auto above = std::upper_bound(at.begin() + 1, at.end() - 1, position);
  const double low = above[-1], high = above[0];
  return static_cast<double>(above - at.begin() - 1) + (position - low) / (high - low);
}

VoxelGrid box_grid(const Vec3& low, const Vec3& high, const std::array<int, 3>& counts) {
  check_box(low, high);
  for (int count : counts)
    if (count < 1) throw InputError("grid: each count must be at least 1, got " + std::to_string(count));
  check_lines({counts[0] + 1.0, counts[1] + 1.0, counts[2] + 1.0});
  VoxelGrid grid{counts, low, Mat3::Zero(), {}};
  for (int a = 0; a < 3; ++a) grid.edges(a, a) = (high[a] - low[a]) / counts[a];
  return grid;
}

VoxelGrid box_grid(const Vec3& low, const Vec3& high, double size) {
  check_box(low, high);
  if (!(size > 0) || !std::isfinite(size)) throw InputError("grid: the size of a cell must be finite and above 0");
  const Vec3 counts = ((high - low) / size).array().round().max(1);
  if (!can_be_numbered({counts[0] + 1, counts[1] + 1, counts[2] + 1}))
    throw InputError(internal::formatted("grid: with size %g, there are more cells than can be numbered", size));
  return box_grid(low, high, {static_cast<int>(counts[0]), static_cast<int>(counts[1]), static_cast<int>(counts[2])});
}

VoxelGrid grid_through(const Mat3& frame, std::array<std::vector<double>, 3> lines) {
  for (const std::vector<double>& at : lines) {
    if (at.size() < 2) throw InputError("grid: along each axis there must be at least 2 lines");
    for (std::size_t i = 0; i < at.size(); ++i)
      if (!std::isfinite(at[i]) || (i > 0 && !(at[i - 1] < at[i])))
        throw InputError("grid: the positions of lines must be finite and increase, at line " + std::to_string(i));
  }
  check_lines({double(lines[0].size()), double(lines[1].size()), double(lines[2].size())});
  VoxelGrid grid;
  for (std::size_t a = 0; a < 3; ++a) grid.cells[a] = static_cast<int>(lines[a].size()) - 1;
  grid.edges = frame;
  grid.lines = std::move(lines);
  return grid;
}

std::vector<double> cell_volumes(const VoxelGrid& grid) {
  if (std::all_of(grid.lines.begin(), grid.lines.end(), [](const auto& at) { return at.empty(); })) return {};
  std::vector<double> volumes;
  volumes.reserve(grid.num_cells());
  const auto width = [&](std::size_t axis, int i) { return grid.position(axis, i + 1) - grid.position(axis, i); };
  for (int k = 0; k < grid.cells[2]; ++k)
    for (int j = 0; j < grid.cells[1]; ++j)
      for (int i = 0; i < grid.cells[0]; ++i) volumes.push_back(width(0, i) * width(1, j) * width(2, k));
  return volumes;
}

std::array<Vec3, 2> box_around(const TriangleMesh& surface, double margin_percent) {
  Eigen::AlignedBox3d box;
  for (const auto& t : surface.triangles)
    for (Index v : t) box.extend(surface.positions[v]);
  const Vec3 margin = Vec3::Constant(margin_percent / 100 * box.diagonal().norm());
  return {box.min() - margin, box.max() + margin};
}

VolumeMesh voxel_mesh(const VoxelGrid& grid, std::span<const char> kept) {
  const int nx = grid.cells[0], ny = grid.cells[1], nz = grid.cells[2];
  const Index row = nx + 1, layer = row * (ny + 1);
  const std::array<Index, 8> corner_offsets{0, 1, 1 + row, row, layer, layer + 1, layer + 1 + row, layer + row};
  std::vector<Index> number(static_cast<std::size_t>(layer) * static_cast<std::size_t>(nz + 1), kNoIndex);
  const auto for_each_kept = [&](const auto& visit) {
    for (int k = 0; k < nz; ++k)
      for (int j = 0; j < ny; ++j)
        for (int i = 0; i < nx; ++i)
          if (kept.empty() || kept[grid.cell(i, j, k)]) visit(i + row * j + layer * k);
  };
  for_each_kept([&](Index base) {
    for (Index offset : corner_offsets) number[base + offset] = 0;
  });
  VolumeMesh mesh;
  std::size_t at = 0;
  for (int k = 0; k <= nz; ++k)
    for (int j = 0; j <= ny; ++j)
      for (int i = 0; i <= nx; ++i, ++at) {
        if (number[at] == kNoIndex) continue;
        number[at] = static_cast<Index>(mesh.positions.size());
        mesh.positions.push_back(grid.point(i, j, k));
      }
  for_each_kept([&](Index base) {
    std::array<Index, 8> corners{};
    for (std::size_t c = 0; c < 8; ++c) corners[c] = number[base + corner_offsets[c]];
    mesh.add_cell(CellKind::hex, corners);
  });
  return mesh;
}

}  // namespace subvol
