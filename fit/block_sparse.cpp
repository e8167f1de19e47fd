// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/block_sparse.h"

namespace subvol {

void BlockSparse::multiply(std::span<const Vec3> in, std::span<Vec3> out) const {
#pragma omp parallel for schedule(static)
  for (std::size_t i = 0; i < num_rows(); ++i) {
    double x = 0, y = 0, z = 0;
    for (std::size_t k = offsets[i]; k < offsets[i + 1]; ++k) {
      const float* b = blocks.data() + 9 * k;
      const Vec3& p = in[columns[k]];
      x += b[0] * p[0] + b[1] * p[1] + b[2] * p[2];
      y += b[3] * p[0] + b[4] * p[1] + b[5] * p[2];
      z += b[6] * p[0] + b[7] * p[1] + b[8] * p[2];
    }
    out[i] = Vec3(x, y, z);
  }
}

}  // namespace subvol
