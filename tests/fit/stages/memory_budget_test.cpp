// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/stages/memory_budget.h"

#include "subvol/base/process_memory.h"

#include <catch2/catch.hpp>

#include <vector>

using namespace subvol::internal;

TEST_CASE("Memory of a first part, whatever its size, does not count for each cell of the next",
          "[slow][memory_budget]") {
  const double held = static_cast<double>(held_memory_bytes());
  MemoryBudget budget(held + 600e6, kMemoryOfLevelCell);
  CHECK(budget.allows(100));
  {
    const std::vector<char> samples_and_trees(200'000'000, 1);
    CHECK(samples_and_trees.back() == 1);
  }
  CHECK(budget.allows(800));
  CHECK_FALSE(budget.allows(1'000'000));
  CHECK(MemoryBudget(0, kMemoryOfLevelCell).allows(1'000'000'000));
}
