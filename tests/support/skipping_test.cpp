// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/support/skipping.h"

#include <catch2/catch.hpp>

using namespace subvol::test;

TEST_CASE("A test that fails has failed, whatever else it leaves out") {
  CHECK(status_of_tests(0, false) == 0);
  CHECK(status_of_tests(0, true) == kSkippedStatus);
  CHECK(status_of_tests(1, true) == 1);
  CHECK(status_of_tests(kSkippedStatus, false) != 0);
  CHECK(status_of_tests(kSkippedStatus, false) != kSkippedStatus);
}

TEST_CASE("Only warnings that say so are of tests left out") {
  CHECK(says_skipped("SKIPPED: no folder with real data"));
  CHECK(!says_skipped("the file says SKIPPED: and more"));
}
