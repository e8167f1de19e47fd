// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/color_map.h"

#include <algorithm>
#include <cmath>

namespace subvol {
namespace {

using Rgb = std::array<int, 3>;

constexpr std::array<Rgb, 9> kViridis{{{0x44, 0x01, 0x54},
                                       {0x47, 0x2d, 0x7b},
                                       {0x3b, 0x52, 0x8b},
                                       {0x2c, 0x72, 0x8e},
                                       {0x21, 0x91, 0x8c},
                                       {0x28, 0xae, 0x80},
                                       {0x5e, 0xc9, 0x62},
                                       {0xad, 0xdc, 0x30},
                                       {0xfd, 0xe7, 0x25}}};
constexpr Rgb kVermilion{0xd5, 0x5e, 0x00};

/// Decodes the sRGB transfer function: the table is in sRGB, but files need linear light.
double linear(double srgb) { return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4); }

}  // namespace

LinearColor quality_color(double scaled_jacobian) {
  LinearColor color{0, 0, 0, 1};
  const bool good = scaled_jacobian > 0;
  const double x = good ? std::min(scaled_jacobian, 1.0) * (kViridis.size() - 1) : 0;
  const auto lower = std::min(static_cast<std::size_t>(x), kViridis.size() - 2);
  for (std::size_t k = 0; k < 3; ++k) {
    const double from = kViridis[lower][k], to = kViridis[lower + 1][k];
    color[k] = linear((good ? from + (x - lower) * (to - from) : kVermilion[k]) / 255);
  }
  return color;
}

}  // namespace subvol
