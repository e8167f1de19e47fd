// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"

#include <array>
#include <string>
#include <vector>

namespace subvol {

/// Configurations of the boundary, and of interfaces between regions, that degrade cells under subdivision, however
/// good the cells are now.
///
/// Edges are pairs of vertices, the smaller first; all lists ascend.
struct SubdivisionAudit {
  std::size_t num_boundary_edges = 0;
  std::size_t num_interface_edges = 0;  ///< smooth edges of interfaces between regions
  /// Smooth boundary edges of one cell, and smooth edges of interfaces with one cell on a side: the limit surface is
  /// smooth across them, so the cell's angle there tends to 180 degrees and its smallest scaled Jacobian roughly halves
  /// per level. Remedy: a crease, or a layer of cells (pillow).
  std::vector<std::array<Index, 2>> flattened_edges;
  /// Creases whose faces enclose more than 180 degrees inside the volume. `CreaseSheets` keeps valid cells valid.
  std::vector<std::array<Index, 2>> reflex_creases;
  /// Fixed vertices at which two or more boundary faces between two creases span more than 180 degrees: the
  /// Catmull-Clark surface itself folds there. Remedy: creases along the edges within the span, `folding_edges`.
  std::vector<Index> folding_corners;
  std::vector<std::array<Index, 2>> folding_edges;
  /// Boundary edges without exactly two boundary faces, and vertices of more than one fan: `subdivide` refuses them.
  std::vector<std::array<Index, 2>> nonmanifold_edges;
  std::vector<Index> nonmanifold_vertices;
  std::vector<std::string> warnings;  ///< one line for people per kind of finding, with its count

  bool can_subdivide() const { return nonmanifold_edges.empty() && nonmanifold_vertices.empty(); }
};

/// Audits the boundary of a mesh. Cells may be inverted; indices must be valid.
///
/// Angles at creases are those between the mean planes of the faces; an angle counts if it exceeds 180 degrees by more
/// than 1. If the boundary is not a manifold, only the non-manifold entities and flattened edges are listed.
/// InputError: as `MeshTopology` and, if the boundary is a manifold, `tagged_boundary`. Cost: linear.
SubdivisionAudit audit(const VolumeMesh& mesh);

/// Returns the mesh's tags with the audit's `folding_edges` added as creases, so that the boundary does not fold at
/// corners.
///
/// sharpness  of the added creases, > 0: from 1 on, the first refinement keeps the edges straight; an infinite one
///            always does.
FeatureTags unfolding_tags(const VolumeMesh& mesh, const SubdivisionAudit& found,
                           double sharpness = kInfiniteSharpness);

}  // namespace subvol
