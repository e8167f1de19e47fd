// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"

#include <array>
#include <random>
#include <span>

namespace subvol::bench {

/// n^3 hexes of unit side; every coordinate is moved by up to `shake`, each time the same way.
inline VolumeMesh hex_grid(int n, double shake = 0) {
  VolumeMesh mesh;
  std::mt19937_64 engine(1);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int k = 0; k <= n; ++k)
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i <= n; ++i) {
        const double x = unit(engine), y = unit(engine), z = unit(engine);
        mesh.positions.emplace_back(i + shake * x, j + shake * y, k + shake * z);
      }
  const auto id = [n](int i, int j, int k) { return static_cast<Index>(i + (n + 1) * (j + (n + 1) * k)); };
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        const Index hex[8] = {id(i, j, k),     id(i + 1, j, k),     id(i + 1, j + 1, k),     id(i, j + 1, k),
                              id(i, j, k + 1), id(i + 1, j, k + 1), id(i + 1, j + 1, k + 1), id(i, j + 1, k + 1)};
        mesh.add_cell(CellKind::hex, hex);
      }
  return mesh;
}

/// The same grid in cells of a kind: each hex in two prisms or six tets around its diagonal.
inline VolumeMesh cells_of(CellKind kind, int n, double shake = 0) {
  VolumeMesh hexes = hex_grid(n, shake);
  if (kind == CellKind::hex) return hexes;
  static constexpr int kPrisms[2][6] = {{0, 1, 2, 4, 5, 6}, {0, 2, 3, 4, 6, 7}};
  static constexpr int kTets[6][4] = {{0, 1, 2, 6}, {0, 2, 3, 6}, {0, 3, 7, 6},
                                      {0, 7, 4, 6}, {0, 4, 5, 6}, {0, 5, 1, 6}};
  VolumeMesh mesh;
  mesh.positions = hexes.positions;
  const auto add = [&](std::span<const Index> hex, std::span<const int> corners) {
    std::array<Index, 6> cell;
    for (std::size_t v = 0; v < corners.size(); ++v) cell[v] = hex[corners[v]];
    mesh.add_cell(kind, std::span(cell).first(corners.size()));
  };
  for (std::size_t c = 0; c < hexes.num_cells(); ++c) {
    if (kind == CellKind::prism)
      for (const auto& corners : kPrisms) add(hexes.cell(c), corners);
    else
      for (const auto& corners : kTets) add(hexes.cell(c), corners);
  }
  return mesh;
}

}  // namespace subvol::bench
