// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/templates/voxel_grid.h"

#include "subvol/base/error.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace subvol {

namespace {

void check_box(const Vec3& low, const Vec3& high) {
  if (!low.allFinite() || !high.allFinite() || !(low.array() < high.array()).all())
    throw InputError("grid: the box must be finite, and its high corner above its low one along every axis");
}

}  // namespace

VoxelGrid box_grid(const Vec3& low, const Vec3& high, const std::array<int, 3>& counts) {
  check_box(low, high);
  double total = 1;
  for (int count : counts) {
    if (count < 1) throw InputError("grid: each count must be at least 1, got " + std::to_string(count));
    total *= count + 1.0;
  }
  // Lattice points are numbered with 32 bits, and a hex mesh has about three times as many faces.
  if (total > std::numeric_limits<Index>::max() / 4.0) throw InputError("grid: more cells than can be numbered");
  VoxelGrid grid{counts, low, Mat3::Zero()};
  for (int a = 0; a < 3; ++a) grid.edges(a, a) = (high[a] - low[a]) / counts[a];
  return grid;
}

VoxelGrid box_grid(const Vec3& low, const Vec3& high, double size) {
  check_box(low, high);
  if (!(size > 0) || !std::isfinite(size)) throw InputError("grid: the size of a cell must be finite and above 0");
  std::array<int, 3> counts{};
  for (int a = 0; a < 3; ++a)
    counts[a] = static_cast<int>(
        std::clamp(std::round((high[a] - low[a]) / size), 1.0, double(std::numeric_limits<int>::max() - 1)));
  return box_grid(low, high, counts);
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
