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
    size_mismatch,            ///< arrays of inconsistent length
    index_out_of_range,
    not_finite,               ///< a position that is NaN or infinite
    repeated_vertex,          ///< a cell that names one vertex twice
    duplicate_cell,
    face_of_many_cells,       ///< a face of three or more cells
    nonconforming_face,       ///< a quad against triangles, or a hanging vertex in a face
    nonmanifold_edge,         ///< a boundary edge with other than two boundary faces
    nonmanifold_vertex,       ///< a boundary vertex whose boundary faces form more than one fan
    inconsistent_orientation, ///< two cells that see their common face from the same side
    inverted_cell,            ///< a corner Jacobian <= 0
    bad_tag,                  ///< a crease or corner that is no boundary edge or vertex, or sharpness <= 0 or NaN
    unused_vertex             ///< named by no cell
  };
  Kind kind;
  Index entity;         ///< vertex or cell number (of the first entity concerned), or kNoIndex
  std::string message;  ///< one line for people, with numbers from 0
};

/// Lists every defect, in the order of `MeshDefect::Kind`; empty when the mesh is sound.
///
/// Later groups are looked for only where the earlier ones allow it (no topology with indices out of range).
/// `unused_vertex` and `inverted_cell` are for the caller to judge; all others make a mesh unusable for subdivision.
/// Cost: linear in the mesh but for one sort of its faces.
std::vector<MeshDefect> validate(const VolumeMesh& mesh);

/// Name of a defect kind in snake_case, as it stands in reports.
const char* to_string(MeshDefect::Kind kind);

}  // namespace subvol
