// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/stages/work_share.h"

#include <catch2/catch.hpp>

using namespace subvol;
using namespace subvol::internal;

TEST_CASE("The share of a work follows its forecast and never falls or ends", "[work_share]") {
  WorkShare work;
  CHECK(work.share() == 0);
  work.begin_part(0.5, 10);
  work.add(4);
  CHECK(work.share() == Approx(0.2));
  double before = work.share();
  for (int step = 0; step < 100; ++step) {  // ten times the forecast
    work.add(1);
    CHECK(work.share() >= before);
    CHECK(work.share() <= 0.5);
    before = work.share();
  }
  work.begin_part(0.4, 1);  // ends before what is done
  CHECK(work.share() == 0.5);
  CHECK(work.share_at_end() == Approx(0.55));  // a tenth of what is left
  before = work.share();
  work.add(0.5);
  CHECK(work.share() > before);
  CHECK(work.share() < 1);
}

TEST_CASE("A portion of a work is one of what is left", "[work_share]") {
  WorkShare work;
  work.begin_part(0.2, 1);
  work.set(0.5);
  work.set(0.3);  // less than before: nothing changes
  CHECK(work.share() == Approx(0.1));
  work.begin_portion(0.5, 0.9, 4);  // the part before is over
  CHECK(work.share() == Approx(0.2));
  work.add(2);
  CHECK(work.share() == Approx(0.2 + 0.5 * 0.35));
}
