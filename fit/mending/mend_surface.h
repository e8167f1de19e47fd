// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/mending/mending_goal.h"
#include "subvol/mesh/feature_tags.h"
#include "subvol/surface/triangle_mesh.h"

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace subvol {

/// Default distance within which a surface may be mended, as a share of its bounding box's diagonal: what a file of
/// eight digits loses in a few operations of a CAD program, and less than what any shell or fit resolves.
inline constexpr double kMendingShare = 2e-4;

/// A surface that was mended, and what was done to it.
struct MendedSurface {
  PolygonMesh surface;
  FeatureTags tags;                   ///< those of the given surface, by the new numbers
  std::vector<Index> vertex_numbers;  ///< number of each vertex in the given surface
  std::vector<Index> face_numbers;    ///< number of each face in the given surface
  std::size_t merged_vertices = 0;    ///< vertices at the place of another one, which became that one
  std::size_t split_vertices = 0;     ///< copies of vertices that several fans of faces had in common, moved apart
  std::size_t dropped_faces = 0;      ///< faces that collapsed, or that were there twice
  std::size_t flipped_edges = 0;      ///< pairs of triangles whose common edge was exchanged for the other diagonal
  std::size_t moved_vertices = 0;
  double distance = 0;        ///< largest distance between the two surfaces, in their unit
  bool is_cancelled = false;  ///< then the surface is as it was given

  bool is_mended() const {
    return merged_vertices + split_vertices + dropped_faces + flipped_edges + moved_vertices > 0;
  }
};

/// Removes what keeps a surface of triangles from its goal, if that is possible by changes within a distance: faces
/// without area, vertices and edges at which several fans of faces touch, small crossings and contacts, and, for
/// layers, vertices from which no direction sees all faces around.
///
/// - Vertices closer than the rounding of a file of single precision (1e-7 of the diagonal) become one. For a
///   solid with cracks, so do those at rims that are closer than the distance, unless they lie on one stretch of a rim
///   (`crack_vertices`), whose edges may be shorter than the distance.
/// - Of faces on the same vertices, those of equal orientation become one, and two that face each other vanish. For a
///   solid, these may be of any size, since they enclose nothing.
/// - Where several fans of faces have a vertex or an edge in common, each gets its own copy of it, and the copies move
///   apart, each toward its fan.
/// - At each fault (`find_faults`) the smallest change is made that leaves the fewest: an edge shorter than the
///   distance collapses, an edge is exchanged for the other diagonal of its two triangles if these are as close, or a
///   vertex moves by up to the distance. If no change helps, two are tried together.
///
/// surface   a surface without faults (for a solid with cracks, also without rims) is returned bit by bit, and so is
///           one with polygons of more than three corners.
/// distance  in the surface's unit, >= 0; 0: the surface is returned as it is.
/// returns   a surface that is farther than `distance` from the given one nowhere (for a solid: from the given one
///           without the faces that vanish). Faults that could not be removed are still there, and what `make_layers`
///           rejects may be, too.
/// InputError: a vertex number that is out of range, a position that is not finite.
/// Deterministic. Cost: that of `find_faults` if there are none; else up to a second for some hundred faults, and at
/// most some ten seconds: the search for changes ends early at vertices with hundreds of triangles.
MendedSurface mend_surface(const PolygonMesh& surface, const FeatureTags& tags, double distance,
                           MendingGoal goal = MendingGoal::layers, const std::function<bool()>& cancelled = {});

/// Returns a sentence that tells what was done, such as "mended within 0.003 (0.004 % of the diagonal): 2 faces
/// dropped"; empty if nothing was.
std::string to_text(const MendedSurface& mended, double diagonal);

}  // namespace subvol
