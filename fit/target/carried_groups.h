// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/geometry/curved_boundary.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/surface/triangle_mesh.h"

#include <cstddef>
#include <string>
#include <vector>

namespace subvol::internal {

/// Returns for each boundary face the group of the target's triangles that it lies on, or kNoIndex.
///
/// Points are spread over each face. Each is in the group of the closest triangle whose normal is within 60 degrees of
/// the face's, if there is one within a face's size of the closest triangle of all; else in the group of that one. The
/// face gets the group with the largest share of its area; of equal shares, the one with the lowest number. A group
/// that gets no face so takes the one nearest to its largest triangle, if that is within the face's width and is not
/// the only one of another group: the name of a small pin is not lost, though its area is too large.
///
/// target     its groups; empty: the result is empty. Triangles may be oriented in any way: they are made to agree
///            (`solid_boundary`); if they bound no solid and disagree, normals count without their sign. InputError: as
///            `ClosestPoint`.
/// boundary   triangles of the boundary and the face of each of them.
/// num_faces  number of boundary faces.
/// Same bits for any number of threads. Cost: about ten closest points for each face.
std::vector<Index> carried_groups(const TriangleMesh& target, const CurvedBoundary& boundary, std::size_t num_faces);

/// Returns the groups of triangles that lie on those of a surface.
FaceGroups groups_of_pieces(const TriangleMesh& surface, const TriangleMesh& pieces);

/// Returns the boundary of a mesh of linear cells as triangles: eight for a quad, four for a triangle.
CurvedBoundary linear_boundary(const VolumeMesh& mesh, const MeshTopology& topology);

/// Returns the groups of a result: those of the target on its boundary, and its own on all faces that get none.
///
/// own      groups that the mesh has already, of a template for example. A number that the target also uses for another
///          group is replaced.
/// carried  of each boundary face, from `carried_groups`.
VolumeFaceGroups with_carried_groups(const TriangleMesh& target, std::vector<Index> carried,
                                     const VolumeFaceGroups& own, const MeshTopology& topology);

/// A group of the target and what has become of it.
struct CarriedGroup {
  Group group;
  double target_area = 0, area = 0;  ///< in the square of the mesh's unit
  std::size_t faces = 0;             ///< number of boundary faces
  /// True if no face has it.
  bool is_lost() const { return faces == 0; }
};

/// Largest difference of a group's areas that is not reported: a share of the group's area on the target, or of the
/// area of all groups, whichever is larger. An edge of the mesh beside the border of a group costs as much.
inline constexpr double kMostAreaDifference = 0.02, kMostShareOfWhole = 0.001;

/// Returns the groups of the target that have triangles, with their areas. Arguments as above.
std::vector<CarriedGroup> areas_of_groups(const TriangleMesh& target, const CurvedBoundary& boundary,
                                          const std::vector<Index>& carried);

/// Returns one warning for each group that is lost, or whose area differs by more than the limits above.
std::vector<std::string> warnings_of_groups(const std::vector<CarriedGroup>& groups);

}  // namespace subvol::internal
