// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/energies/block_sparse.h"

#include "subvol/base/error.h"

#include <catch2/catch.hpp>

using namespace subvol;
using namespace subvol::internal;

TEST_CASE("a clique pattern couples the nodes of each element, and every node with itself") {
  const std::vector<std::size_t> offsets{0, 3, 5};
  const std::vector<Index> nodes{2, 0, 1, 3, 1};
  const BlockSparse pattern = clique_pattern(5, offsets, nodes);
  CHECK(pattern.offsets == std::vector<std::size_t>{0, 3, 7, 10, 12, 13});
  CHECK(pattern.columns == std::vector<Index>{0, 1, 2, 0, 1, 2, 3, 0, 1, 2, 1, 3, 4});
  CHECK(pattern.find(1, 3) == 6);
  CHECK(pattern.find(0, 3) == pattern.num_entries());
  CHECK_THROWS_AS(clique_pattern(3, offsets, nodes), InputError);
}

TEST_CASE("a block matrix multiplies row by row") {
  BlockSparse matrix = clique_pattern(2, std::vector<std::size_t>{0, 2}, std::vector<Index>{0, 1});
  matrix.set_zero();
  for (std::size_t k = 0; k < matrix.blocks.size(); ++k) matrix.blocks[k] = static_cast<float>(k);
  const std::vector<Vec3> in{{1, 2, 3}, {-1, 0, 2}};
  std::vector<Vec3> out(2);
  matrix.multiply(in, out);
  CHECK(out[0] == Vec3(0 + 2 + 6 - 9 + 22, 3 + 8 + 15 - 12 + 28, 6 + 14 + 24 - 15 + 34));
  CHECK_THROWS_AS(matrix.multiply(in, std::span(out).first(1)), InputError);
  matrix.set_zero();
  matrix.multiply(in, out);
  CHECK(out[1] == Vec3(0, 0, 0));
}
