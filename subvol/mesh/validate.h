// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/mesh/volume_mesh.h"

#include <string>
#include <vector>

namespace subvol {

/// One defect of a mesh.
struct MeshDefect {
  enum class Kind {
    no_cells,
    size_mismatch,  ///< arrays of inconsistent length, or a cell of unknown kind
    index_out_of_range,
    not_finite,       ///< a position with a coordinate that is NaN or infinite
    repeated_vertex,  ///< a cell that names one vertex twice
    duplicate_cell,
    face_of_many_cells,  ///< a face of three or more cells
    nonconforming_face,  ///< a quad against triangles, a hanging vertex on an edge, or corners in different orders
    nonmanifold_edge,    ///< a boundary edge that does not have exactly two boundary faces
    nonmanifold_vertex,  ///< a boundary vertex whose boundary faces form more than one fan
    inconsistent_orientation,  ///< two cells that see their common face from the same side
    inverted_cell,             ///< a cell whose Jacobian determinant is <= 0 at a corner
    bad_tag,                   ///< a tag off all sheets, out of order or repeated, or with sharpness <= 0 or NaN
    unused_vertex              ///< a vertex that no cell names
  };
  Kind kind;
  Index entity;         ///< number of the first vertex or cell concerned, or kNoIndex
  std::string message;  ///< one line for people, with numbers from 0
};

/// Returns every defect, in the order of `MeshDefect::Kind`; nothing if the mesh is valid.
///
/// Later groups are checked only if the earlier ones allow it (no topology with indices out of range).
/// `unused_vertex` and `inverted_cell` are for the caller to judge; all others make a mesh unusable for subdivision.
/// Cost: linear in the mesh, apart from sorts of its cells and faces.
std::vector<MeshDefect> validate(const VolumeMesh& mesh);

enum class InvertedCells { refused, allowed };

/// Throws InputError with `what` and the first defect if a mesh has any, apart from unused vertices, and from inverted
/// cells if these are allowed.
void require_valid(const VolumeMesh& mesh, const std::string& what, InvertedCells inverted = InvertedCells::refused);

/// Throws InputError, naming `what`, if a grouped face names a group that is not there.
void require_groups(const VolumeFaceGroups& groups, const std::string& what);

/// Returns the name of a defect kind in snake_case, as it stands in reports.
const char* to_string(MeshDefect::Kind kind);

}  // namespace subvol
