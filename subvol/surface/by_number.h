// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/face_groups.h"
#include "subvol/mesh/feature_tags.h"
#include "subvol/surface/triangle_mesh.h"

#include <span>

namespace subvol::internal {

/// Returns the tags of a surface that was made from another one: those of the edges and vertices that they were on
/// there.
///
/// tags            of the other surface.
/// vertex_numbers  the number that each vertex of the surface had there; several may have had the same.
FeatureTags tags_by_number(const FeatureTags& tags, const PolygonMesh& surface, std::span<const Index> vertex_numbers);

/// Returns the groups of faces, given the number that each had in the other surface. Groups that had faces there and
/// have none here are dropped.
FaceGroups groups_by_number(const FaceGroups& groups, std::span<const Index> face_numbers);

}  // namespace subvol::internal
