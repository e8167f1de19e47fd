// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/boundary_patches.h"
#include "subvol/fit/features/feature_routing.h"
#include "subvol/fit/features/signed_features.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace subvol::internal {

/// A face inside a mesh that belongs to a patch, as those of interfaces between regions do.
struct InnerFace {
  std::array<Index, 4> corners;  ///< kNoIndex after those of a triangle
  Index patch;
  std::span<const Index> vertices() const { return {corners.data(), corners[3] == kNoIndex ? 3u : 4u}; }
};

/// Says when a patch may be padded.
enum class PadRule : std::uint8_t {
  free,
  joining,  ///< only together with free ones that cannot be padded without it
  never
};

/// A mesh whose boundary is divided into patches by paths along the sharp edges of a target.
struct PatchedMesh {
  VolumeMesh mesh;                    ///< its positions are those that pads are put into; without tags
  std::vector<Vec3> fitted;           ///< positions of the vertices near the target
  std::vector<CreasePath> paths;      ///< ascending by curve
  std::vector<PlacedCorner> corners;  ///< ascending by vertex
  BoundaryPatches patches;
  std::vector<EdgeAngle> angles;  ///< of the boundary edges on no path; edges that are missing count as flat
  /// These faces and paths lie inside the mesh and move with its vertices.
  std::vector<InnerFace> inner_faces;
  std::vector<CreasePath> inner_paths;
  /// Pairs of patches that are padded together or not at all, besides those on both sides of a nearly flat path.
  std::vector<std::array<Index, 2>> united;
  std::vector<PadRule> rules;  ///< one per patch; empty: all are PadRule::free
  /// One entry per patch: 1 if its faces are faces of other cells as well, which are not in this mesh. Pads leave their
  /// vertices where they are. Empty: none.
  std::vector<std::uint8_t> shared;
  bool grows_to_shared = true;  ///< false: a pad that cannot be without another shared patch is not made
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
  moves_shared,    ///< a face of `PatchedMesh::shared` that is not padded has a vertex in common with one that is
  inverted         ///< no step keeps all cells valid
};

/// Returns text for people.
std::string to_string(PadProblem problem);

struct PadRefusal {
  PadProblem problem;
  Index vertex;  ///< of the mesh
};

/// Puts a layer of cells under some patches: each face of theirs becomes a cell between its old vertices and new ones,
/// to which all other cells move.
///
///        o---o---o---o  the patch        o---o---o---o  the patch, on its old vertices
///        |   |   |   |                   |   |   |   |  new cells
///        |   |   |   |         ->        o---o---o---o  new vertices
///        |   |   |   |                   |   |   |   |
///        o---o---o---o                   o---o---o---o
///
/// At the border of the patches the sides of the new cells are faces of the boundary; they belong to the patch beyond.
/// So an edge of the border has one cell afterwards, and the edge between its new vertices one more than it had before.
/// Paths at the border or inside the patches keep their old vertices; others get new ones. A path that ends at the
/// border from outside is continued by the edge from the new to the old vertex, so that corners stay where they are.
/// Where an inner face ends at a padded one, a side between two new cells is added to it.
///
/// From its old vertex, a new one lies 0.2 of the shortest edge there times the sum of the distinct normals away,
/// inward; less if a cell would be inverted. Their fitted positions are the same.
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
/// Patches on both sides of a path with an angle above 150 degrees belong to one set, since no pad may end there, and
/// so do those of `united`. These are reasons to pad a set:
///
///   - an edge inside it at which the target's angle divided by the number of cells is above 140 or below 42 degrees;
///     an edge at its border counts half, for both sets;
///   - a vertex of a path at which another patch's angle divided by its number of faces there is above 140 or below 40
///     degrees: after the pad, that patch has one more face there, or one only. Neighbors share this reason evenly.
///
/// The set with the most reasons is padded, together with neighbors without which it cannot be. This is repeated, with
/// each set at most once, until no reason is left. If sets that want a pad cannot have one, because those around them
/// came first, a single pad under all patches is made instead, if it leaves fewer reasons.
///
/// features  those that were routed.
/// Deterministic, serial. InputError: as `pad`. Cost: one pass over the mesh per pad.
///
/// Limits: a pad over both sides of a reflex edge leaves two cells there, with angles of 135 degrees and a scaled
/// Jacobian of 0.707 at most, even if there were three before. At a corner of four or more paths, neighbors are padded
/// together, and the edges between them keep their numbers of cells.
PadReport add_pads(PatchedMesh& patched, const SignedFeatures& features);

/// Puts one pad under some patches and those without which it cannot be made: those of their sets, and neighbors as
/// `add_pads` adds them.
///
/// never    patches that the pad may not lie under.
/// returns  the pad; nothing if there is none, and the mesh is unchanged then. InputError: as `pad`.
std::optional<Pad> pad_without(PatchedMesh& patched, const SignedFeatures& features, std::span<const Index> patches,
                               std::span<const Index> never);

}  // namespace subvol::internal
