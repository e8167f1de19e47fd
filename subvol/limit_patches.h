// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface_topology.h"
#include "subvol/volume_mesh.h"

#include <array>
#include <span>
#include <vector>

namespace subvol {

/// The Catmull-Clark limit surface of a control cage, evaluated exactly at dyadic parameters, patch by patch.
///
/// A patch is a quad of the boundary refined once: the part of a boundary face next to one of its corners.
///
///   (0, kUnits) ------ (kUnits, kUnits)      corner 0 is a vertex of the cage, corner 2 the centre of the face;
///       |  3          2  |                   sides 3-0 and 0-1 are halves of cage edges. Across every side the
///       |  0          1  |                   parameter along it runs the same way in the neighbour.
///   (0, 0) ----------- (kUnits, 0)
///
/// Where a quad and its neighbours are regular (valence 4, or beside creases of infinite sharpness that bound them as a
/// knot line would) it is one bicubic B-spline patch; else its four children are looked at, down to quads whose samples
/// are corners only, and those have limit masks. So every point is exact, up to rounding, at every kind of vertex.
class LimitPatches {
 public:
  static constexpr int kMaxDepth = 14;
  static constexpr int kUnits = 1 << kMaxDepth;  ///< parameters are integers from 0 to kUnits

  /// InputError: as `tagged_boundary`. Cost: linear, about 1 microsecond per patch.
  explicit LimitPatches(const VolumeMesh& cage);

  std::size_t num_patches() const { return levels_[0].surface.num_faces(); }
  /// The quads of one refinement: corner k of patch p is corner 4 p + k.
  const SurfaceTopology& quads() const { return levels_[0].surface; }
  /// Boundary face of each patch (a place in MeshTopology::boundary_faces()), and which of its corners.
  const std::array<Index, 2>& face_corner(Index patch) const { return face_corners_[patch]; }
  /// Whether the patch's sides 0-1 and 3-0 lie on tagged cage edges, of any sharpness.
  const std::array<bool, 2>& sharp_sides(Index patch) const { return sharp_sides_[patch]; }

  /// Makes ready for parameters that are multiples of kUnits / 2^depth; 0 <= depth <= kMaxDepth. Does work once per
  /// depth, for the quads that are still irregular there: few, but along semi-sharp creases 2^depth a quad.
  void prepare(int depth);

  /// Points of the limit surface at u.size() x v.size() parameters, u fastest; normals too unless null.
  ///
  /// u, v       ascending, within the patch, multiples of what has been prepared.
  /// normals    unit, outward but for tangents spanning more than 180 degrees at a vertex; zero where tangents are
  ///            parallel. On creases of infinite sharpness: of this patch's side.
  /// Reads only: may be called from several threads. Cost: about 10 ns per point.
  void evaluate(Index patch, std::span<const int> u, std::span<const int> v, Vec3* positions,
                Vec3* normals = nullptr) const;

 private:
  struct Level {
    SurfaceTopology surface;
    std::vector<Vec3> points;
    std::vector<char> regular;          // of the faces that belong to patches: they come first
    std::vector<Index> first_children;  // in the next level, once that is there; kNoIndex for regular faces
  };
  struct Block;
  struct Samples;

  void classify(Level& level, std::size_t num_faces) const;
  void fill(const Block& block, const Samples& samples) const;
  void fill_children(const Block& block, const Samples& samples) const;

  std::vector<Level> levels_;
  std::vector<std::array<Index, 2>> face_corners_;
  std::vector<std::array<bool, 2>> sharp_sides_;
};

}  // namespace subvol
