// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/mending/mending_goal.h"
#include "subvol/surface/triangle_mesh.h"

#include <Eigen/Geometry>

#include <array>
#include <cstddef>
#include <set>
#include <span>
#include <tuple>
#include <vector>

namespace subvol::internal {

/// Corners of a triangle of a patch that was dropped.
inline constexpr std::array<Index, 3> kDropped{kNoIndex, kNoIndex, kNoIndex};

/// A change of a few triangles.
struct MendingChange {
  enum class Kind { collapse, flip, move } kind;
  Index a, b;                    ///< the ends of an edge; collapse: a becomes b; move: the vertex is a
  Vec3 position = Vec3::Zero();  ///< of a moved vertex
  double distance = 0;           ///< by which the surface changes, at most
};

/// The triangles around a fault and all that are near them, with numbers of their own.
struct MendingPatch {
  TriangleMesh mesh;            ///< dropped triangles are `kDropped`
  std::vector<char> is_inner;   ///< vertices all of whose triangles are in the patch
  std::vector<char> is_border;  ///< vertices at an edge of one triangle, of the inner ones
  Eigen::AlignedBox3d box;      ///< in which triangles are of the patch

  /// Returns the triangles at the edge between two vertices, ascending.
  std::vector<std::size_t> at_edge(Index a, Index b) const;
  std::set<Index> neighbors(Index v) const;
  /// Makes a change; returns false, and may be half changed, if the surface would be no manifold.
  bool apply(const MendingChange& change);
};

/// Returns the changes by up to a distance near some vertices of a patch: of edges between inner vertices, the shorter
/// ones collapse, and flips whose diagonals are closer are made; vertices move along their normal and toward their
/// neighbors.
///
/// vertices  of the patch.
/// given     position of each vertex of the patch before any change: none moves farther from it than the distance.
std::vector<MendingChange> possible_changes(const MendingPatch& patch, const std::vector<Index>& vertices,
                                            std::span<const Vec3> given, double distance);

/// What is wrong with a patch.
struct PatchFaults {
  std::vector<std::array<Index, 2>> meeting;  ///< pairs of triangles that meet improperly
  std::size_t num_flat = 0;                   ///< triangles without area
  /// Per vertex: the least cosine between the normals around it and the direction that sees all of them best; -1 if
  /// there is none; 1 if it is no inner vertex, or has no triangles.
  std::vector<double> clearances;
};

/// Returns what is wrong with a patch.
/// before, known  the patch before a change, and its faults: only what the change touches is searched. Null: all is.
PatchFaults faults_of(const MendingPatch& patch, const MendingPatch* before = nullptr,
                      const PatchFaults* known = nullptr);

/// How good a patch is: less is better.
struct PatchRating {
  std::size_t faults = 0;
  bool is_hard = false;  ///< from the best direction at some vertex, a triangle is seen almost edge-on
  double distance = 0;   ///< of the changes
  friend bool operator<(const PatchRating& a, const PatchRating& b) {
    return std::tie(a.faults, a.is_hard, a.distance) < std::tie(b.faults, b.is_hard, b.distance);
  }
};

/// goal  decides what counts as a fault.
PatchRating rating_of(const PatchFaults& faults, double distance, MendingGoal goal);

}  // namespace subvol::internal
