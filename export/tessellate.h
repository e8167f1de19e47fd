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

inline constexpr std::size_t kMostQuads = 4'000'000;  ///< largest number of quads of a tessellation, unless another is
                                                      ///< requested

/// A quarter of a boundary quad, or a third of a boundary triangle: the part next to one of its corners.
///
///   corner of the face ---- edge midpoint      One refinement of the cage makes one boundary quad of each patch, and
///          |                     |             that quad belongs to the child of (cell, corner).
///     edge midpoint ------- face center
struct SurfacePatch {
  Index face;    ///< position in MeshTopology::boundary_faces()
  Index corner;  ///< position in that face, 0 .. 2 or 3
};

/// A surface cut into quads, each to be drawn as the triangles 0 1 2 and 0 2 3 of its corners.
struct TessellatedSurface {
  std::vector<Vec3> positions;                  ///< on the surface; doubled where a crease separates the normals
  std::vector<Vec3> normals;                    ///< unit, outward, one per position
  std::vector<std::array<Index, 4>> quads;      ///< outward; the quads of one patch are consecutive
  std::vector<Index> quad_patches;              ///< number in `patches` for each quad
  std::vector<SurfacePatch> patches;            ///< ordered by face, then corner
  std::vector<std::array<Index, 2>> wireframe;  ///< the mesh's boundary edges as curves: segments along quad edges
  double chord_error = 0;                       ///< largest distance from the surface to the triangles, length unit
};

/// Cuts a surface of patches until its triangles are close to it.
///
/// Every patch becomes a grid of quads. Its cuts belong to the strips of patches that cross opposite sides, so that
/// neighbors agree along their common edge: there are no cracks, no T-junctions, and only quads. An interval of a strip
/// is halved as long as a quad that spans it is too far from the surface, so cuts gather where the surface bends. At
/// singular corners (three or more faces on one side of a crease, where halving a quad only multiplies its error by
/// 0.6) this takes a few more cuts near the corner instead of more everywhere. Distances are measured at 5 x 5 points
/// of each quad (see `chord_distance`) and increased by what a quadratic patch may add between them.
///
/// max_chord_error  > 0, in the mesh's length unit.
/// max_quads        intervals are halved only while there are not more quads than this, the worst first; `chord_error`
///                  is then above `max_chord_error`. One quad per patch is always made. No interval is halved more than
///                  12 times.
/// progress         called with "tessellation" in every round of halving; if it ends the rounds, `chord_error` holds
///                  the accuracy that they reached.
///
/// Normals differ only across creases of infinite sharpness; elsewhere a vertex has the mean normal of its patches. If
/// the tangents are parallel (as in the only face at an untagged boundary vertex), the vertex has the mean normal of
/// the quads around it.
/// InputError: max_chord_error not positive. The same bits for any number of threads. Cost for a limit surface: about 2
/// microseconds per quad.
TessellatedSurface tessellate(PatchSurface& patches, double max_chord_error, std::size_t max_quads = kMostQuads,
                              const WorkProgress& progress = {});

/// Tessellates the Catmull-Clark limit surface of a control cage. InputError: also for a cage that `LimitPatches`
/// refuses.
TessellatedSurface tessellate(const VolumeMesh& cage, double max_chord_error, std::size_t max_quads = kMostQuads,
                              const WorkProgress& progress = {});

/// Returns only the triangles, two for each quad. Vertices along hard creases occur once for each side.
TriangleMesh triangles_of(const TessellatedSurface& surface);

}  // namespace subvol
