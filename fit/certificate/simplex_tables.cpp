// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/certificate/simplex_tables.h"

#include "subvol/fit/simd/wide.h"

#include <cassert>
#include <memory>

namespace subvol::internal {

const SimplexTables& SimplexTables::get(int dimension, int degree) {
  assert((dimension == 2 || dimension == 3) && degree >= 1 && degree <= kMostTableDegree);
  static std::array<std::array<std::unique_ptr<const SimplexTables>, kMostTableDegree + 1>, 2> tables;
  static std::array<std::array<std::once_flag, kMostTableDegree + 1>, 2> made;
  const auto d = static_cast<std::size_t>(dimension - 2);
  std::call_once(made[d][degree], [&] { tables[d][degree].reset(new SimplexTables(dimension, degree)); });
  return *tables[d][degree];
}

SimplexTables::SimplexTables(int dimension, int degree)
    : index(dimension, degree), lower(dimension, degree - 1), stride(rounded_up(index.size(), kWide)) {
  for (int c = 0; c <= dimension; ++c) {
    for (int n = 0; n < lower.size(); ++n) {
      SimplexIndex::Exponents e = lower.exponents(n);
      ++e[c];
      raised[c].push_back(index.find(e));
    }
    raised[c].resize(rounded_up(lower.size(), kControlPointLanes));
  }
}

const SimplexHalving& SimplexTables::halving(int a, int b) const {
  std::call_once(halved_[a][b], [&] { halvings_[a][b] = SimplexHalving(index, a, b); });
  return halvings_[a][b];
}

}  // namespace subvol::internal
