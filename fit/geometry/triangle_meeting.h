// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <array>

namespace subvol::internal {

/// How two triangles meet that have a point in common.
enum class MeetingKind {
  crossing,  ///< each has corners strictly on both sides of the other
  face,      ///< they overlap in one plane
  edge,      ///< an edge of one lies on the other
  vertex     ///< they have one point in common: a corner of one lies on the other, or two edges cross
};

struct TriangleMeeting {
  MeetingKind kind;
  Vec3 place;  ///< a point that both contain, up to rounding
};

/// Says how two triangles meet, by exact predicates.
///
/// a, b  corners; finite; both triangles have an area and they have a common point (`self_intersections`), else the
///       kind means nothing and the place is near both.
TriangleMeeting meeting_of(const std::array<Vec3, 3>& a, const std::array<Vec3, 3>& b);

}  // namespace subvol::internal
