// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"
#include "subvol/subdivision/patch_surface.h"

#include <array>
#include <span>
#include <vector>

namespace subvol {

/// The Catmull-Clark limit surface of a control cage, evaluated exactly at dyadic parameters, patch by patch.
///
/// Where a quad and its neighbours are regular (valence 4, or beside creases of infinite sharpness that bound them as a
/// knot line would) it is one bicubic B-spline patch; else its four children are looked at, down to quads whose samples
/// are corners only, and those have limit masks. So every point is exact, up to rounding, at every kind of vertex.
class LimitPatches : public PatchSurface {
 public:
  /// InputError: as `tagged_boundary`. Cost: linear, about 1 microsecond per patch.
  explicit LimitPatches(const VolumeMesh& cage);

  const SurfaceTopology& quads() const override { return levels_[0].surface; }
  const std::array<Index, 2>& face_corner(Index patch) const override { return layout_.face_corners[patch]; }
  const std::array<bool, 2>& sharp_sides(Index patch) const override { return layout_.sharp_sides[patch]; }

  /// Does work once per depth, for the quads that are still irregular there: few, but along semi-sharp creases 2^depth
  /// a quad.
  void prepare(int depth) override;

  /// Normals are outward but for tangents spanning more than 180 degrees at a vertex; on creases of infinite sharpness
  /// they are of this patch's side. Cost: about 10 ns per point.
  void evaluate(Index patch, std::span<const int> u, std::span<const int> v, Vec3* positions,
                Vec3* normals = nullptr) const override;

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
  PatchLayout layout_;
};

}  // namespace subvol
