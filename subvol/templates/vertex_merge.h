// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"

#include <span>
#include <string>

namespace subvol {

/// The mesh in which every vertex v is replaced by target[v], and what becomes of its cells.
///
/// A cell whose corners stay distinct is kept. One whose faces then cover each other in pairs has become flat and goes:
/// a hex with four parallel edges collapsed, say, or a tet with one. A hex with two parallel edges of one face
/// collapsed becomes a prism. Anything else would break conformity. Unused vertices go; tags follow their vertices, the
/// larger sharpness counting, and go where they are no longer on the boundary.
///
/// target  a vertex for each one, with target[target[v]] == target[v]. Merged vertices take the target's position.
/// name    of the operation, for messages.
/// InputError: a cell that would be no tet, prism or hex; a result that `validate` objects to.
VolumeMesh merge_vertices(const VolumeMesh& mesh, std::span<const Index> target, const std::string& name);

/// Glues faces that lie on each other: boundary vertices within a distance become one, the one of the smaller number.
/// distance  >= 0; well below the shortest edge, so that the corners of every cell stay distinct, else InputError.
/// InputError as `merge_vertices`. Cost: sorts of the vertices and edges; for a distance that is not small beside the
/// mesh, up to the square of the boundary's vertices.
VolumeMesh glue(const VolumeMesh& mesh, double distance);

/// Two meshes as one, the second's vertices and cells after the first's. Nothing is glued.
VolumeMesh joined(const VolumeMesh& a, const VolumeMesh& b);

}  // namespace subvol
