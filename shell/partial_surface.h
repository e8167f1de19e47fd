// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/feature_tags.h"
#include "subvol/shell/border_planes.h"
#include "subvol/surface/triangle_mesh.h"

#include <span>
#include <vector>

namespace subvol {

/// Angle between faces, in degrees, above which an edge separates two patches unless the caller says otherwise.
inline constexpr double kPatchDegrees = 30;

/// Returns the faces that are connected with one of a surface's faces through edges that are no sharper than an angle.
///
/// face     a number of the surface, else InputError.
/// degrees  the angle, in [0, 180].
/// returns  1 for each face of the patch, else 0.
std::vector<char> patch_of_face(const PolygonMesh& surface, Index face, double degrees = kPatchDegrees);

/// Returns the face that is closest to a point. InputError: no faces, a position that is not finite.
Index closest_face(const PolygonMesh& surface, const Vec3& point);

/// A surface without some of its faces.
struct PartialSurface {
  PolygonMesh surface;
  FeatureTags tags;                   ///< those of the given surface, by the new numbers
  std::vector<Index> vertex_numbers;  ///< number of each vertex in the given surface
  std::vector<Index> face_numbers;    ///< number of each face in the given surface
  /// The planes of flat patches that were left out, and the vertices at which they bordered on what is left.
  std::vector<BorderPlane> border_planes;
};

/// Leaves faces out of a surface.
///
/// is_left_out  one entry per face. InputError: none would be left.
PartialSurface without_faces(const PolygonMesh& surface, const FeatureTags& tags, std::span<const char> is_left_out);

}  // namespace subvol
