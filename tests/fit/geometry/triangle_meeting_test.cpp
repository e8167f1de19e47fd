// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/geometry/triangle_meeting.h"

#include <catch2/catch.hpp>

using namespace subvol;
using namespace subvol::internal;

TEST_CASE("Triangles whose edges cross touch at a point, and cross if they share a stretch", "[geometry]") {
  // Each has corners on both sides of the other's plane. The upper edge of the first one lies at z = 1.
  const std::array<Vec3, 3> wall{Vec3(4, 0, 0), Vec3(4, 4, 1), Vec3(4, 0, 1)};
  const auto across = [](double low, double high) {
    return std::array<Vec3, 3>{Vec3(3, 1.5, low), Vec3(5, 1.5, low), Vec3(5, 1.5, high)};
  };
  const TriangleMeeting above = meeting_of(wall, across(1, 1.5));
  CHECK(above.kind == MeetingKind::vertex);
  CHECK((above.place - Vec3(4, 1.5, 1)).norm() < 1e-12);
  CHECK(meeting_of(across(1, 1.5), wall).kind == MeetingKind::vertex);
  CHECK(meeting_of(wall, across(0.9, 1.5)).kind == MeetingKind::crossing);
  // The edges cross where the common stretch ends.
  CHECK(meeting_of(wall, across(1, 0.5)).kind == MeetingKind::crossing);
  CHECK(meeting_of(across(1, 0.5), wall).kind == MeetingKind::crossing);
}
