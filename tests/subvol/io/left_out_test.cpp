// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/left_out.h"

#include <catch2/catch.hpp>

#include <string>

using subvol::LeftOut;

TEST_CASE("What a file holds and is not used is counted by kind; of very many kinds the first are named",
          "[io][quick]") {
  LeftOut few, many;
  few.add("lines", 2), few.add("bones", 0), few.add("groups"), few.add("lines");
  CHECK(few.text() == "3 lines, 1 groups");
  for (int i = 0; i < 100000; ++i) many.add("kind " + std::to_string(i));
  CHECK(many.text().starts_with("1 kind 0, 1 kind 1, "));
  CHECK(many.text().ends_with(", 1 kind 99, 99900 other kinds"));
}
