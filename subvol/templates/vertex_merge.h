// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"

#include <span>
#include <string>

namespace subvol {

/// Replaces every vertex v by target[v] and updates the cells accordingly.
///
/// A cell whose corners stay distinct is kept. A cell whose remaining faces cover each other in pairs is flat and is
/// removed: for example a hex in which four parallel edges collapsed, or a tet in which one edge did. A hex in which
/// two parallel edges of one face collapsed becomes a prism. Anything else would break conformity. Unused vertices are
/// removed; tags follow their vertices, the larger sharpness of two that coincide remaining, and are removed if they
/// are no longer on the boundary.
///
/// target  one vertex per vertex, with target[target[v]] == target[v]. Merged vertices take the target's position.
/// name    of the operation, for messages.
/// InputError: a cell that would be neither flat nor a tet, prism or hex; no cell left; a result in which `validate`
/// finds a defect.
VolumeMesh merge_vertices(const VolumeMesh& mesh, std::span<const Index> target, const std::string& name);

/// Glues faces that lie on each other: boundary vertices within a distance of each other, also in chains, are merged
/// into the one with the smallest number.
/// distance  finite, >= 0; well below the shortest edge, so that the corners of every cell stay distinct, else
///           InputError.
/// InputError also as `merge_vertices`. Cost: sorts of the vertices and edges; up to the square of the number of
/// boundary vertices if the distance is not small compared to the mesh.
VolumeMesh glue(const VolumeMesh& mesh, double distance);

/// Returns two meshes as one, with the second's vertices and cells after the first's. Nothing is glued. Groups and
/// regions of the same name and number become one. A named region of b whose number is taken by another one of a gets
/// the lowest positive number that is free, and so do its cells; numbers without names mean the same in both meshes.
/// For groups see `append_groups`.
VolumeMesh joined(const VolumeMesh& a, const VolumeMesh& b);

}  // namespace subvol
