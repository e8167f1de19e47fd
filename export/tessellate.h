// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/work_progress.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/subdivision/patch_surface.h"
#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <cstddef>
#include <vector>

namespace subvol {

inline constexpr std::size_t kMostQuads = 4'000'000;  ///< of a tessellation, unless asked otherwise

/// A quarter of a boundary face (a third of a triangle): the part next to one of its corners.
///
///   corner of the face ---- edge midpoint      one refinement of the cage makes one boundary quad of each patch, and
///          |                     |             that quad belongs to the child of (cell, corner)
///     edge midpoint ------- face centre
struct SurfacePatch {
  Index face;    ///< a place in MeshTopology::boundary_faces()
  Index corner;  ///< 0 .. 2 or 3: place in that face
};

/// A surface cut into quads, each to be drawn as the triangles 0 1 2 and 0 2 3 of its corners.
struct TessellatedSurface {
  std::vector<Vec3> positions;             ///< on the surface; doubled where a crease parts the normals
  std::vector<Vec3> normals;               ///< unit, outward, one per position
  std::vector<std::array<Index, 4>> quads; ///< outward; the quads of one patch follow one another
  std::vector<Index> quad_patches;         ///< number in `patches` of each quad
  std::vector<SurfacePatch> patches;       ///< by face, then corner
  std::vector<std::array<Index, 2>> wireframe;  ///< the mesh's boundary edges as curves: segments along quad edges
  double chord_error = 0;                  ///< largest distance from the surface to the triangles, length unit
};

/// A surface of patches, cut until its triangles are close to it.
///
/// Every patch becomes a grid of quads. Its cuts belong to the strips of patches that cross opposite sides, so
/// neighbours agree along their common edge: no cracks, no T-junctions, quads only. An interval of a strip is halved as
/// long as a quad that spans it is too far from the surface, so cuts gather where the surface bends, and at singular
/// corners (three or more faces on one side of a crease, where halving a quad takes only 0.6 off its error) it takes a
/// few cuts more near the corner, not more everywhere. Distances are measured at 5 x 5 points of each quad (see
/// `chord_distance`) and raised by what a quadratic patch may add between them.
///
/// max_chord_error  > 0, in the mesh's length unit.
/// max_quads        intervals are halved only while there are not more quads than this, the worst first; `chord_error`
///                  then is above `max_chord_error`. One quad per patch is always made. No interval is halved more than
///                  12 times.
/// progress         told "tessellation" in every round of halving; where it ends the rounds, `chord_error` tells how
///                  far they came.
///
/// Normals part across creases of infinite sharpness only; elsewhere a vertex has the mean one of its patches. Where
/// the tangents are parallel (the one face at an untagged boundary vertex, say) it is the mean one of the quads around.
/// InputError: max_chord_error not positive. The same bits for any number of threads. Cost of a limit surface: about 2
/// microseconds per quad.
TessellatedSurface tessellate(PatchSurface& patches, double max_chord_error, std::size_t max_quads = kMostQuads,
                              const WorkProgress& progress = {});

/// The same of the Catmull-Clark limit surface of a control cage. InputError also for what `LimitPatches` refuses.
TessellatedSurface tessellate(const VolumeMesh& cage, double max_chord_error, std::size_t max_quads = kMostQuads,
                              const WorkProgress& progress = {});

/// The triangles alone, two for each quad. Vertices along hard creases are there once for each side.
TriangleMesh triangles_of(const TessellatedSurface& surface);

}  // namespace subvol
