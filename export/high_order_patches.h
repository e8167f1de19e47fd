// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/high_order_mesh.h"
#include "subvol/subdivision/patch_surface.h"

#include <vector>

namespace subvol {

/// The curved boundary of a high-order mesh, as the patches of its straight-sided mesh: quarters of quads, in which u
/// and v are halves of the face's coordinates, and thirds of triangles, bilinear in barycentric coordinates.
///
/// The faces of such a mesh hardly ever meet quite smoothly: an edge becomes a crease of infinite sharpness if the
/// normals on its two sides differ by more than an angle.
class HighOrderPatches : public PatchSurface {
 public:
  /// crease_angle_degrees: in [0, 180]; 180: no creases. The needed parts of `mesh` are copied.
  /// InputError: the angle out of range; a boundary that is not a surface (as `build_surface`).
  HighOrderPatches(const HighOrderMesh& mesh, double crease_angle_degrees);

  const SurfaceTopology& quads() const override { return quads_; }
  const std::array<Index, 2>& face_corner(Index patch) const override { return layout_.face_corners[patch]; }
  const std::array<bool, 2>& sharp_sides(Index patch) const override { return layout_.sharp_sides[patch]; }
  void prepare(int) override {}
  /// Cost: about 0.3 microseconds per point at order 4.
  void evaluate(Index patch, std::span<const int> u, std::span<const int> v, Vec3* positions,
                Vec3* normals = nullptr) const override;

  /// Length of the diagonal of the box around 5 x 5 points of every patch.
  double bounding_box_diagonal() const;

 private:
  /// A boundary face in its cell: the places of its corners, and the cell's functions that do not vanish on it.
  struct Face {
    CellKind kind;
    std::vector<Vec3> corners;
    std::vector<LocalMode> modes;
    std::vector<Vec3> coefficients;  ///< multiplied by their signs
  };
  struct Frame {
    Vec3 position, normal;
  };
  Face make_face(const HighOrderMesh& mesh, Index f) const;
  ShapeFunctions shapes(const Face& face) const { return {face.kind, basis_, max_order_}; }
  Frame evaluate(const Face& face, ShapeFunctions& shapes, const Vec3& point, bool with_normal) const;
  bool is_sharp(const Face& face, int corner, const Face& other, int other_corner, double least_cosine) const;

  Basis basis_;
  int max_order_;
  std::vector<Face> faces_;
  SurfaceTopology quads_;
  PatchLayout layout_;
};

}  // namespace subvol
