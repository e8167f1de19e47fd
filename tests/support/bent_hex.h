// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/shape_functions.h"

#include <cstdint>
#include <random>
#include <vector>

namespace subvol {

/// One hex by its modes and their coefficients, without signs.
struct BentHex {
  std::vector<LocalMode> modes;
  std::vector<Vec3> coefficients;
};

/// Near the straight cell of these edges: coefficients are moved by `bent` at the most, less for higher modes. Each
/// mode but the vertices' is left out with a probability.
template <class Random>
BentHex bent_hex(Random& random, int order, const Mat3& edges, double bent, double share_left_out) {
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  BentHex result;
  for (int k = 0; k <= order; ++k)
    for (int j = 0; j <= order; ++j)
      for (int i = 0; i <= order; ++i) {
        const bool is_vertex = i < 2 && j < 2 && k < 2;
        if (!is_vertex && uniform(0, 1) < share_left_out) continue;
        LocalMode mode;
        mode.i = static_cast<std::uint8_t>(i), mode.j = static_cast<std::uint8_t>(j);
        mode.k = static_cast<std::uint8_t>(k);
        result.modes.push_back(mode);
        const double size = bent / (1 + i * i + j * j + k * k);
        Vec3 x = size * Vec3(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
        if (is_vertex) x += edges * Vec3(i, j, k);
        result.coefficients.push_back(x);
      }
  return result;
}

}  // namespace subvol
