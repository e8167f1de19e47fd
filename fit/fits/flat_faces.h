// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/flat_facets.h"
#include "subvol/fit/fits/fitted_cage.h"
#include "subvol/fit/geometry/closest_point.h"
#include "subvol/fit/target/fit_target.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <cstddef>

namespace subvol::internal {

/// Moves the boundary vertices of a fitted mesh onto the planes of the target's flat facets, so that planar faces are
/// planar and the edges between them straight, up to rounding.
///
/// A boundary face is flat if its center and the points halfway to its corners are all closest to the same facet, and
/// its normal is within 25 degrees of the facet's. Each of its vertices must lie in the facet's plane; a vertex with
/// several planes moves by the shortest vector that satisfies them all:
///
///   min |d|  subject to  n_i . (x + d) = c_i
///
/// Vertices stay where they are if no such vector exists, or if it is longer than a tenth of their shortest edge. Where
/// a cell would lose its certificate, or become poorer than the poorest cell of the mesh was, the vertices of that cell
/// stay, too.
///
/// mesh    passes `validate` except for unused vertices and inverted cells; its boundary lies close to the target
/// target  oriented outward or inward as a whole; tree and facets: its own.
/// returns the number of vertices that lie on planes afterwards. Same bits for any number of threads.
/// Cost: five closest points for each boundary face, and the quality of the mesh some times.
std::size_t flatten_faces(VolumeMesh& mesh, const TriangleMesh& target, const ClosestPoint& tree,
                          const FlatFacets& facets);

/// Does the same for the vertices of a cage, whose subdivision surface becomes flat where they are. The cells of its
/// mesh are judged, and moves are compared with twice the edges of the mesh, because cells of a cage are often flat,
/// and its edges short, if the mesh is good. If a cell suffers, vertices of the cage that move it stay.
std::size_t flatten_faces(FittedCage& cage, const TriangleMesh& target, const ClosestPoint& tree,
                          const FlatFacets& facets);

/// Does the same for the boundary and for the interfaces between regions: vertices that lie in both satisfy the planes
/// of both. With interfaces, a cell may become as poor as `least_jacobian`, even if no cell of the mesh was before.
///
/// target  with the interfaces that the mesh is to keep; the mesh is in its coordinates.
std::size_t flatten_sheets(VolumeMesh& mesh, const FitTarget& target, double least_jacobian);
std::size_t flatten_sheets(FittedCage& cage, const FitTarget& target, double least_jacobian);

/// Moves the control vertices of flat interfaces into their planes, so that their subdivision surfaces are flat, up to
/// rounding: those of each patch of interface faces between creases and feature curves that lies on one flat facet of
/// the target's interfaces. A vertex of several patches moves as in `flatten_faces`.
///
/// cage  a control mesh, in the target's coordinates. Its cells are not looked at: the caller must.
/// returns the number of vertices that were moved. Cost: five closest points for each interface face.
std::size_t flatten_interface_patches(VolumeMesh& cage, const FitTarget& target);

}  // namespace subvol::internal
