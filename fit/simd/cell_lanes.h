// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/simd/lanes.h"
#include "subvol/mesh/volume_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

namespace subvol::internal {

/// One number of each of kSimdLanes hexes: kernels that are templates over the number type process them all at once.
using Lanes = Eigen::Array<double, kSimdLanes, 1>;

inline double larger(double a, double b) { return a > b ? a : b; }
inline double smaller(double a, double b) { return a < b ? a : b; }
inline Lanes larger(const Lanes& a, const Lanes& b) { return (a > b).select(a, b); }
inline Lanes smaller(const Lanes& a, const Lanes& b) { return (a < b).select(a, b); }
inline double square_root(double a) { return std::sqrt(a); }
inline Lanes square_root(const Lanes& a) {
  Lanes result;
  for (int lane = 0; lane < kSimdLanes; ++lane) result[lane] = std::sqrt(a[lane]);
  return result;
}

/// Corners of kSimdLanes consecutive hexes, one per lane; `vertices` are those of the first.
inline std::array<std::array<Lanes, 3>, 8> gather_hexes(std::span<const Vec3> positions, const Index* vertices) {
  std::array<std::array<Lanes, 3>, 8> x;
  for (int lane = 0; lane < kSimdLanes; ++lane)
    for (int v = 0; v < 8; ++v) {
      const Vec3& p = positions[vertices[8 * lane + v]];
      for (int axis = 0; axis < 3; ++axis) x[v][axis][lane] = p[axis];
    }
  return x;
}

/// Corners of one cell; as many entries as its kind has corners are set.
inline std::array<Vec3, kMaxCellVertices> gather_cell(std::span<const Vec3> positions, const VolumeMesh& mesh,
                                                      std::size_t cell) {
  std::array<Vec3, kMaxCellVertices> x;
  const auto vertices = mesh.cell(cell);
  for (std::size_t v = 0; v < vertices.size(); ++v) x[v] = positions[vertices[v]];
  return x;
}

/// Calls hexes(first) for kSimdLanes consecutive hexes and cell(c) for every other cell, in parallel.
///
/// The grouping of cells depends on the mesh alone, so results do not depend on the number of threads.
template <class Hexes, class Cell>
void for_each_cell_block(const VolumeMesh& mesh, const Hexes& hexes, const Cell& cell) {
  const std::size_t num_cells = mesh.num_cells(), num_blocks = (num_cells + kSimdLanes - 1) / kSimdLanes;
#pragma omp parallel for schedule(static)
  for (std::size_t block = 0; block < num_blocks; ++block) {
    const std::size_t begin = block * kSimdLanes, end = std::min(begin + kSimdLanes, num_cells);
    const auto is_hex = [](CellKind kind) { return kind == CellKind::hex; };
    if (end - begin == kSimdLanes && std::all_of(mesh.kinds.begin() + begin, mesh.kinds.begin() + end, is_hex))
      hexes(begin);
    else
      for (std::size_t c = begin; c < end; ++c) cell(c);
  }
}

}  // namespace subvol::internal
