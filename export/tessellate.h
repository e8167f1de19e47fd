// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/volume_mesh.h"

#include <array>
#include <cstddef>
#include <vector>

namespace subvol {

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
  std::vector<Vec3> positions;             ///< on the limit surface; doubled where a crease parts the normals
  std::vector<Vec3> normals;               ///< unit, outward, one per position
  std::vector<std::array<Index, 4>> quads; ///< outward; the quads of one patch follow one another
  std::vector<Index> quad_patches;         ///< number in `patches` of each quad
  std::vector<SurfacePatch> patches;       ///< by face, then corner
  std::vector<std::array<Index, 2>> wireframe;  ///< the cage's boundary edges as curves: segments along quad edges
  double chord_error = 0;                  ///< largest distance from the limit surface to the triangles, length unit
};

/// The Catmull-Clark limit surface of a control cage, cut until its triangles are close to it.
///
/// Every patch becomes a grid of 2^a x 2^b quads. The two counts belong to the strips of patches that cross opposite
/// sides, so neighbours agree along their common edge: no cracks, no T-junctions, quads only. A strip is cut as finely
/// as its most curved patch needs, measured at the points of a uniform refinement that is one level finer (see
/// `chord_distance`); the measure is raised by a third, the most by which a quadratic patch can exceed it between them.
///
/// max_chord_error    > 0, in the mesh's length unit.
/// max_refined_quads  bounds that uniform refinement, which takes about 300 bytes a quad; a cage that would need more is
///                    cut as finely as this allows and `chord_error` is above `max_chord_error`. At least two
///                    refinements are always made.
///
/// At a corner or crease with three or more faces on one side the limit surface itself is singular: its error falls by
/// a factor of 0.6 a level, not 0.25. Where only such places (less than one patch in a hundred) are left, refinement stops, and
/// `chord_error` tells.
///
/// Normals part across creases of infinite sharpness only. Where the tangents are parallel (the one face at an untagged
/// boundary vertex, say) the normal is the mean one of the quads around.
/// InputError: max_chord_error not positive; a cage that `refine_boundary` refuses. The same bits for any number of
/// threads.
TessellatedSurface tessellate(const VolumeMesh& cage, double max_chord_error,
                              std::size_t max_refined_quads = 4'000'000);

}  // namespace subvol
