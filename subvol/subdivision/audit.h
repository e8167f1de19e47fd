// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"

#include <array>
#include <string>
#include <vector>

namespace subvol {

/// What in a mesh's boundary works against good cells under subdivision, however good the cells are now.
///
/// Edges are pairs of vertices, the smaller first; all lists ascend.
struct SubdivisionAudit {
  std::size_t num_boundary_edges = 0;
  /// Smooth boundary edges of one cell: the limit surface is flat across them, so that cell's angle there tends to 180
  /// degrees and its smallest scaled Jacobian about halves per level. Remedy: a crease, or a layer of cells (pillow).
  std::vector<std::array<Index, 2>> flattened_edges;
  /// Creases whose faces enclose more than 180 degrees inside the volume. Interior rows are made for them.
  std::vector<std::array<Index, 2>> reflex_creases;
  /// Fixed vertices where two or more boundary faces between two creases span more than 180 degrees: there the
  /// Catmull-Clark surface itself folds. Remedy: creases along the edges within the span, `folding_edges`.
  std::vector<Index> folding_corners;
  std::vector<std::array<Index, 2>> folding_edges;
  /// Boundary edges of other than two boundary faces, and vertices of more than one fan: `subdivide` refuses them.
  std::vector<std::array<Index, 2>> nonmanifold_edges;
  std::vector<Index> nonmanifold_vertices;
  std::vector<std::string> warnings;  ///< one line for people per kind of finding, with its count

  bool can_subdivide() const { return nonmanifold_edges.empty() && nonmanifold_vertices.empty(); }
};

/// Looks a mesh's boundary over. Cells may be inverted; indices must be sound (InputError, as `MeshTopology`).
///
/// Angles are of mean planes of faces and count from 1 degree beyond straight. On a boundary that is no manifold only
/// the non-manifold entities and flattened edges are listed. Cost: linear.
SubdivisionAudit audit(const VolumeMesh& mesh);

/// The mesh's tags with the audit's `folding_edges` as creases too, so that its boundary does not fold at corners.
///
/// sharpness  of the added creases, > 0: above 1 the first refinement keeps the span straight, infinite for ever.
FeatureTags unfolding_tags(const VolumeMesh& mesh, const SubdivisionAudit& found,
                           double sharpness = kInfiniteSharpness);

}  // namespace subvol
