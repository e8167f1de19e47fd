// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/mending/mending_patch.h"

#include "tests/support/surface_fixtures.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <numeric>
#include <vector>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

void check_same(const PatchFaults& a, const PatchFaults& b) {
  const auto sorted = [](auto all) {
    std::sort(all.begin(), all.end());
    return all;
  };
  CHECK(sorted(a.meeting) == sorted(b.meeting));
  CHECK(sorted(a.flat) == sorted(b.flat));
  CHECK(a.clearances == b.clearances);
  CHECK(a.num_hidden == b.num_hidden);
  CHECK(a.num_hard == b.num_hard);
}

}  // namespace

TEST_CASE("Changes of a patch are taken back, and their faults are those that a whole search finds", "[mending]") {
  MendingPatch patch;
  patch.mesh = cube_surface(4, true);
  RandomPoints random(3);
  for (Vec3& p : patch.mesh.positions) p += random.point(0.3);  // some triangles cross
  const std::size_t count = patch.mesh.positions.size();
  patch.is_inner.assign(count, 1);
  patch.is_border.assign(count, 0);
  patch.index();
  const MendingPatch before = patch;
  const PatchFaults known = faults_of(patch);
  CHECK(known.meeting.size() > 3);
  std::vector<Index> all(count);
  std::iota(all.begin(), all.end(), 0);
  std::array<int, 3> num_kinds{};
  for (const MendingChange& change : possible_changes(patch, all, patch.mesh.positions, 0.5)) {
    PatchUndo replaced;
    if (!patch.apply(change, replaced)) continue;
    ++num_kinds[static_cast<std::size_t>(change.kind)];
    const FaultsAfter after(patch, replaced, known);
    const PatchFaults whole = faults_of(patch);
    check_same(after.faults(), whole);
    for (const MendingGoal goal : {MendingGoal::layers, MendingGoal::solid}) {
      const PatchRating rating = after.rating(0.25, goal), expected = rating_of(whole, 0.25, goal);
      CHECK(rating.faults == expected.faults);
      CHECK(rating.is_hard == expected.is_hard);
    }
    patch.undo(replaced);
    CHECK(patch.mesh.triangles == before.mesh.triangles);
    CHECK(patch.mesh.positions == before.mesh.positions);
    CHECK(patch.around == before.around);
  }
  for (const int number : num_kinds) CHECK(number > 10);
}
