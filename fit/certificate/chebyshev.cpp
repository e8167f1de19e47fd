// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/certificate/chebyshev.h"

#include <utility>

namespace subvol::internal {

std::vector<std::vector<long double>> chebyshev_to_bernstein(int degree) {
  std::vector<std::vector<long double>> rows;
  for (int k = 0; k <= degree; ++k) {
    // T_k in its own degree: (-1)^(k-j) C(2k, 2j) / C(k, j), by ratios; then its degree is raised one by one.
    std::vector<long double> row{k % 2 ? -1.0L : 1.0L};
    for (int j = 0; j < k; ++j) row.push_back(-row[j] * (2 * k - 2 * j - 1) / (2 * j + 1));
    for (int n = k; n < degree; ++n) {
      row.push_back(row[n]);
      for (int j = n; j > 0; --j) row[j] = (j * row[j - 1] + (n + 1 - j) * row[j]) / (n + 1);
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace subvol::internal
