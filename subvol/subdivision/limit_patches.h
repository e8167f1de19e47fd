// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"
#include "subvol/subdivision/patch_surface.h"

#include <array>
#include <span>
#include <vector>

namespace subvol::internal {

/// The Catmull-Clark limit surface of a control cage, evaluated exactly at dyadic parameters, patch by patch.
///
/// A quad is one bicubic B-spline patch if it and its neighbors are regular (valence 4, or next to creases of infinite
/// sharpness that bound them as a knot line would). Otherwise its four children are evaluated, down to quads that are
/// sampled only at corners, which have limit masks. So every point is exact, up to rounding, at every kind of vertex.
class LimitPatches : public PatchSurface {
 public:
  /// InputError: as `tagged_boundary`. Cost: linear, about 1 microsecond per patch.
  explicit LimitPatches(const VolumeMesh& cage);

  const SurfaceTopology& quads() const override { return levels_[0].surface; }
  const std::array<Index, 2>& face_corner(Index patch) const override { return layout_.face_corners[patch]; }
  const std::array<bool, 2>& sharp_sides(Index patch) const override { return layout_.sharp_sides[patch]; }

  /// Works once per depth on the quads that are still irregular there: few of them, except along semi-sharp creases,
  /// where there are 2^depth per quad.
  void prepare(int depth) override;

  /// Normals point outward, except at a vertex whose tangents span more than 180 degrees; on creases of infinite
  /// sharpness they are those of this patch's side. Cost: about 10 ns per point.
  void evaluate(Index patch, std::span<const int> u, std::span<const int> v, Vec3* positions,
                Vec3* normals = nullptr) const override;

 private:
  struct Level {
    SurfaceTopology surface;
    std::vector<Vec3> points;
    std::vector<char> regular;          // true for regular faces; only for faces of patches, which come first
    std::vector<Index> first_children;  // in the next level, once it exists; kNoIndex for regular faces
  };
  struct Block;
  struct Samples;

  void classify(Level& level, std::size_t num_faces) const;
  void fill(const Block& block, const Samples& samples) const;
  void fill_children(const Block& block, const Samples& samples) const;

  std::vector<Level> levels_;
  PatchLayout layout_;
};

}  // namespace subvol::internal
