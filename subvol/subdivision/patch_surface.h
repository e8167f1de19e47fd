// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/surface_topology.h"

#include <array>
#include <span>

namespace subvol {

/// A smooth boundary of a volume mesh that is evaluated patch by patch at dyadic parameters.
///
/// A patch is a quad of the boundary refined once: the part of a boundary face next to one of its corners.
///
///   (0, n) ----------- (n, n)      n = kPatchSideUnits. Corner 0 is a vertex of the mesh, corner 2 the center of the
///       |  3          2  |         face; sides 3-0 and 0-1 are halves of the mesh's edges. Across every side the
///       |  0          1  |         parameter along it runs the same way in the neighbor.
///   (0, 0) ----------- (n, 0)
class PatchSurface {
 public:
  static constexpr int kMostPatchDepth = 14;                    ///< halvings of a side that parameters can tell apart
  static constexpr int kPatchSideUnits = 1 << kMostPatchDepth;  ///< parameters are integers from 0 to this

  virtual ~PatchSurface() = default;

  std::size_t num_patches() const { return quads().num_faces(); }
  /// Returns the quads of one refinement: corner k of patch p is corner 4 p + k. Normals jump across edges of infinite
  /// sharpness.
  virtual const SurfaceTopology& quads() const = 0;
  /// Returns the boundary face of a patch (a place in MeshTopology::boundary_faces()), and the number of its corner.
  virtual const std::array<Index, 2>& face_corner(Index patch) const = 0;
  /// Returns true for each of the patch's sides 0-1 and 3-0 that lies on a crease, of any sharpness.
  virtual const std::array<bool, 2>& sharp_sides(Index patch) const = 0;

  /// Prepares for parameters that are multiples of kPatchSideUnits / 2^depth; 0 <= depth <= kMostPatchDepth.
  virtual void prepare(int depth) = 0;

  /// Evaluates the surface at u.size() x v.size() parameters, u fastest; also its normals, unless null.
  ///
  /// u, v       ascending, within the patch, multiples of the step that has been prepared.
  /// normals    unit, outward unless the patch is folded; zero if the tangents are parallel; those of this patch's
  ///            side.
  /// May be called from several threads.
  virtual void evaluate(Index patch, std::span<const int> u, std::span<const int> v, Vec3* positions,
                        Vec3* normals = nullptr) const = 0;
};

/// Returns the unit vector along du x dv; zero if they are parallel up to rounding.
Vec3 unit_normal(const Vec3& du, const Vec3& dv);

/// The patches of a boundary: the face and corner of each, and which of its two outer sides are sharp.
struct PatchLayout {
  std::vector<std::array<Index, 2>> face_corners;
  std::vector<std::array<bool, 2>> sharp_sides;
};
PatchLayout patch_layout(const SurfaceTopology& boundary);

}  // namespace subvol
