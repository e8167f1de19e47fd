// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <vector>

namespace subvol {

/// The boundary of a curved mesh as triangles. Neighbors share their vertices, also across sharp edges.
struct CurvedBoundary {
  TriangleMesh triangles;
  std::vector<Index> faces;  ///< per triangle: index into `MeshTopology::boundary_faces()`
  double chord_error = 0;    ///< distance of the triangles to the curved surface, in the mesh's unit
};

}  // namespace subvol
