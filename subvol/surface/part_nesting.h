// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <functional>
#include <span>
#include <vector>

namespace subvol::internal {

/// How the parts of a closed surface lie in each other.
struct PartNesting {
  std::vector<double> volumes;  ///< signed volume of each part: negative if its normals point inward
  std::vector<int> depths;      ///< number of other parts that each part lies in
  /// Returns true if a part bounds a void: it lies in an odd number of others, whatever its orientation.
  bool is_void(std::size_t part) const { return depths[part] % 2 != 0; }
  /// Returns true if a part's normals point out of the solid.
  bool faces_out(std::size_t part) const { return (volumes[part] > 0) != is_void(part); }
};

/// Finds out which parts of a surface lie in others, by winding numbers.
///
///   depth(part) = min over points x of the part of round(w(x) - w_part(x))
///
/// w sums over all parts, each of them turned outward, and w_part over this one alone. Points at which the difference
/// is not near a whole number, because another part touches there, do not count. A part that crosses others has points
/// outside them and lies in none.
///
/// part       number of the part of each triangle, in [0, count).
/// count      number of parts; each has triangles, closed and consistently oriented. If a part has holes, its depth is
///            an estimate.
/// cancelled  asked now and then, from the calling thread. If it returns true, some depths are missing and are 0.
/// Empty:
///            never.
/// Deterministic. Cost: that of the winding numbers at the corners and centers of 16 triangles of each part whose box
/// lies in another part's. Each point asks the closed parts whose boxes contain it, and all open ones together.
PartNesting part_nesting(const TriangleMesh& mesh, std::span<const int> part, int count,
                         const std::function<bool()>& cancelled = {});

/// Returns the smallest part that contains another part, or -1. nesting: as `part_nesting` returns it. Cost: that of
/// the winding numbers of each part whose box contains the other's.
int part_around(const TriangleMesh& mesh, std::span<const int> part, const PartNesting& nesting, int inner);

}  // namespace subvol::internal
