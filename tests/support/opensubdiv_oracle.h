// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"

#include <vector>

namespace subvol::test {

/// OpenSubdiv's refinement of a volume mesh's boundary, by its own primvar refiner in double precision.
struct OracleLevels {
  std::vector<Index> vertices;                       ///< volume vertex of each boundary vertex
  std::vector<std::vector<Vec3>> positions;          ///< per level, in OpenSubdiv's own numbering
  std::vector<Vec3> limit_positions, limit_normals;  ///< of the last level's vertices, by the Far limit masks
};
OracleLevels oracle_refine(const VolumeMesh& mesh, int levels);

/// OpenSubdiv's positions of the children of the first refinement of the boundary, or of all sheets as one non-manifold
/// surface.
struct OracleChildren {
  std::vector<Index> vertices;              ///< volume vertex of each vertex of the surface
  std::vector<std::array<Index, 2>> edges;  ///< its edges, by volume vertices, smaller first
  std::vector<Vec3> vertex_children, edge_children;
};
enum class OracleFaces { boundary, sheets };
OracleChildren oracle_children(const VolumeMesh& mesh, OracleFaces faces = OracleFaces::boundary);

}  // namespace subvol::test
