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
#include <utility>
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

/// Holds what a change of a patch replaced, so that it can be undone.
struct PatchUndo {
  std::vector<std::pair<Index, std::array<Index, 3>>> triangles;  ///< numbers, and corners before
  Index moved = kNoIndex;                                         ///< a vertex that moved, if any
  Vec3 position = Vec3::Zero();                                   ///< of that vertex before
};

/// The triangles around a fault and all that are near them, with numbers of their own.
struct MendingPatch {
  TriangleMesh mesh;                       ///< dropped triangles are `kDropped`
  std::vector<char> is_inner;              ///< vertices all of whose triangles are in the patch
  std::vector<char> is_border;             ///< vertices at an edge of one triangle, of the inner ones
  Eigen::AlignedBox3d box;                 ///< in which triangles are of the patch
  std::vector<std::vector<Index>> around;  ///< triangles at each vertex, ascending; see `index`
  std::vector<Eigen::AlignedBox3d> boxes;  ///< of each triangle

  /// Fills `around` and `boxes` from the mesh.
  void index();
  /// Returns the triangles at the edge between two vertices, ascending.
  std::vector<Index> at_edge(Index a, Index b) const;
  std::set<Index> neighbors(Index v) const;
  /// Makes a change, and tells what it replaced; returns false, and leaves all as it was, if the surface would be no
  /// manifold.
  bool apply(const MendingChange& change, PatchUndo& replaced);
  /// Takes back the last change that is not taken back yet.
  void undo(const PatchUndo& replaced);
};

/// Returns the changes by up to a distance near some vertices of a patch: of edges between inner vertices, the shorter
/// ones collapse, and flips whose diagonals are closer are made; vertices move along their normal and toward their
/// neighbors.
///
/// vertices  of the patch.
/// given     position of each vertex of the patch before any change: none moves farther from it than the distance.
std::vector<MendingChange> possible_changes(const MendingPatch& patch, const std::vector<Index>& vertices,
                                            std::span<const Vec3> given, double distance);

/// Lists the faults of a patch.
struct PatchFaults {
  std::vector<std::array<Index, 2>> meeting;  ///< pairs of triangles that meet improperly
  std::vector<Index> flat;                    ///< triangles without area
  /// Per vertex: the least cosine between the normals around it and the direction that sees all of them best; -1 if
  /// there is none; 1 if it is no inner vertex, or has no triangles.
  std::vector<double> clearances;
  std::size_t num_hidden = 0, num_hard = 0;  ///< clearances of -1, and those at which a triangle is seen almost edge-on
};

/// How good a patch is: less is better.
struct PatchRating {
  std::size_t faults = 0;
  bool is_hard = false;  ///< from the best direction at some vertex, a triangle is seen almost edge-on
  double distance = 0;   ///< of the changes
  friend bool operator<(const PatchRating& a, const PatchRating& b) {
    return std::tie(a.faults, a.is_hard, a.distance) < std::tie(b.faults, b.is_hard, b.distance);
  }
};

/// Returns what is wrong with a patch. Cost: that of `self_intersections`.
PatchFaults faults_of(const MendingPatch& patch);

/// Finds the faults of a patch after a change. It looks only at the triangles that the change touches.
class FaultsAfter {
 public:
  /// patch  after the change.  replaced: by the change.  known: the faults before it. All must outlive this.
  FaultsAfter(const MendingPatch& patch, const PatchUndo& replaced, const PatchFaults& known);
  /// distance  of all changes.  goal: decides what counts as a fault.
  PatchRating rating(double distance, MendingGoal goal) const;
  PatchFaults faults() const;
  /// Number of pairs of a changed triangle and one near it: a measure of what this cost.
  std::size_t work() const { return work_; }

 private:
  bool is_changed(Index t) const;

  const PatchFaults& known_;
  std::vector<Index> changed_;  ///< triangles, ascending
  std::vector<std::array<Index, 2>> meeting_;
  std::vector<Index> flat_;                           ///< of the changed ones
  std::vector<std::pair<Index, double>> clearances_;  ///< of the vertices touched
  std::size_t work_ = 0;
};

/// goal  decides what counts as a fault.
PatchRating rating_of(const PatchFaults& faults, double distance, MendingGoal goal);

}  // namespace subvol::internal
