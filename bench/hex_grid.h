// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/volume_mesh.h"

#include <random>

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

}  // namespace subvol::bench
