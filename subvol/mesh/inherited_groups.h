// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/face_groups.h"
#include "subvol/mesh/mesh_topology.h"

#include <array>
#include <span>
#include <vector>

namespace subvol::internal {

/// Where a vertex of a refined mesh lies in the mesh that it was made from: the vertices of the smallest edge or face
/// that contains it, a single vertex if it is one; unused entries are kNoIndex. None at all: inside a cell.
using VertexSupport = std::array<Index, 4>;

/// Returns the support of a vertex that the refinement keeps.
inline VertexSupport kept_vertex(Index v) { return {v, kNoIndex, kNoIndex, kNoIndex}; }
/// Returns the support of a point inside an edge or face with these vertices; more than four: inside a cell.
VertexSupport support_of(std::span<const Index> vertices);

/// Returns the groups of the faces of a refined mesh: a face is in the groups of the old face that it is a part of.
///
/// old      the groups of the mesh that was refined.
/// refined  topology of the result.
/// support  one per vertex of the result.
VolumeFaceGroups inherited_groups(const VolumeFaceGroups& old, const MeshTopology& refined,
                                  std::span<const VertexSupport> support);

/// Returns the groups after a refinement that adds no vertices and keeps the numbers of the old ones.
VolumeFaceGroups inherited_groups(const VolumeFaceGroups& old, const MeshTopology& refined);

}  // namespace subvol::internal
