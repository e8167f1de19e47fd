// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/features/boundary_patches.h"
#include "fit/features/feature_routing.h"
#include "fit/features/signed_features.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace subvol {

/// A mesh whose boundary is divided into patches by paths along the sharp edges of a target.
struct PatchedMesh {
  VolumeMesh mesh;                    ///< its positions are those that pads are put into; without tags
  std::vector<Vec3> fitted;           ///< positions of the vertices near the target
  std::vector<CreasePath> paths;      ///< ascending by curve
  std::vector<PlacedCorner> corners;  ///< ascending by vertex
  BoundaryPatches patches;
  std::vector<EdgeAngle> angles;  ///< of the boundary edges on no path; edges that are missing count as flat
};

/// Divides the boundary of a mesh along the paths of a routing.
///
/// mesh     passes `validate` except for unused vertices; its tags are dropped.
/// fitted   the positions that were routed: one per vertex, near the target and in its coordinates.
/// InputError: sizes that do not agree; a path that leaves the boundary; a boundary that is not a manifold; otherwise
/// as `boundary_patches` and `smooth_edge_angles`.
PatchedMesh patched_mesh(VolumeMesh mesh, std::vector<Vec3> fitted, const FeatureRouting& routing,
                         const TriangleMesh& target);

/// Reasons why patches cannot be padded.
enum class PadProblem {
  touches_itself,  ///< two fans of padded faces meet at a vertex
  too_many_paths,  ///< two paths run through the faces at a vertex that are not padded: it would become two vertices
  inverted         ///< no step keeps all cells valid
};

/// Returns text for people.
std::string to_string(PadProblem problem);

struct PadRefusal {
  PadProblem problem;
  Index vertex;  ///< of the mesh
};

/// Puts a layer of cells under some patches: each face of them becomes a cell between its old vertices and new ones, to
/// which all other cells move.
///
///      ----o-----o----  the patch        o-----o-----o
///          |     |            ->         |     |     |      the new layer
///          |     |                       o-----o-----o
///                                              |
///
/// At the border of the patches the sides of the new cells are faces of the boundary; they belong to the patch beyond.
/// So an edge there gets one cell, and the edge that it moves from, one more than before. Paths at the border or among
/// the patches keep their old vertices. A path that ends at the border from outside is continued by the edge between
/// the new and the old vertex, so that corners of the target stay where they are. Smooth angles move alike.
///
/// New vertices lie 0.2 of the shortest edge of their old vertex, times the sum of its distinct normals, under the
/// patches; less if a cell would be inverted. Their fitted positions are those of the old ones.
///
/// patched  from `patched_mesh`, or padded before. New vertices and cells are appended; old ones keep their numbers. A
///          quad gives a hex, a triangle a prism, with the reference of the cell behind it.
/// patches  numbers of patches; given twice counts once.
/// returns  nothing, or why and at which vertex the patches cannot be padded; the mesh is unchanged then.
/// InputError: a patch out of range.
std::optional<PadRefusal> pad(PatchedMesh& patched, std::span<const Index> patches);

/// A pad that was made.
struct Pad {
  std::vector<Index> patches;  ///< ascending
  std::size_t cells = 0;       ///< number of new cells
};

/// Patches that would be better with a pad but cannot have one.
struct MissedPad {
  std::vector<Index> patches;  ///< ascending; those from which the choice started
  PadRefusal refusal;
};

struct PadReport {
  std::vector<Pad> pads;          ///< in their order
  std::vector<MissedPad> missed;  ///< those that were still wanted at the end
};

/// Pads patches, one set after the other, where angles of the boundary do not suit the number of cells there.
///
/// Patches on both sides of a path with an angle above 150 degrees belong together, since no pad may end there. A set
/// of patches that belong together is wanted for each
///
///   - edge inside it at which the angle of the target over the number of cells is above 140 or below 42 degrees; half
///     as much for an edge at its border;
///   - vertex of a path at which another patch has an angle, over its number of faces there, above 140 or below 40
///     degrees: a pad beside it leaves that patch with one face there at the edge that stays.
///
/// The set that is wanted most is padded, together with neighbors that it cannot be padded without; each patch at most
/// once, until none is wanted.
///
/// features  those that were routed.
/// Deterministic, serial. InputError: as `pad`. Cost: one pass over the mesh per pad.
///
/// Limits: a pad over both sides of a reflex edge leaves two cells there, with angles of 135 degrees (a scaled Jacobian
/// of 0.707 at most), where three would be better. At a corner of four or more paths two patches are padded together,
/// and the edge between them keeps its cells.
PadReport add_pads(PatchedMesh& patched, const SignedFeatures& features);

}  // namespace subvol
