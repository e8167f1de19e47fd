// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/triangle_mesh.h"
#include "subvol/types.h"

#include <array>
#include <vector>

namespace subvol {

struct TargetSurfaceOptions {
  /// Triangles with longer edges are sampled more than once; > 0, in the mesh's unit. 0: one sample per triangle.
  double sample_spacing = 0;
};

/// How the enclosed volume was found.
enum class VolumeSource {
  signed_sum,    ///< sum of the triangles' signed tetrahedra: the surface is (nearly) closed and oriented
  flood,         ///< cells of a grid that the outside does not reach: not oriented, holes smaller than a cell
  isoperimetric  ///< half the volume of the sphere of equal area: the surface encloses nothing
};

/// The surface to fit, as the energies need it: triangles with normals, area A, enclosed volume V, samples.
///
/// A soup is welcome: neither connectivity nor orientation nor closedness matters, but for V (see `VolumeSource`).
class TargetSurface {
 public:
  /// mesh   finite positions of its triangles' corners, corner numbers in range, at least one triangle with an area,
  /// else
  ///        InputError. Triangles without area are dropped; the others keep their order.
  explicit TargetSurface(const TriangleMesh& mesh, const TargetSurfaceOptions& options = {});

  const std::vector<Vec3>& positions() const { return positions_; }
  const std::vector<std::array<Index, 3>>& triangles() const { return triangles_; }
  /// Of each triangle: unit normal, by its corners' order; and area.
  const std::vector<Vec3>& normals() const { return normals_; }
  const std::vector<double>& areas() const { return areas_; }

  double area() const { return area_; }      ///< A > 0
  double volume() const { return volume_; }  ///< V > 0
  VolumeSource volume_source() const { return volume_source_; }
  /// L = V / A, the length that makes the surface energy dimensionless.           Paper: Eq. 9
  double length() const { return volume_ / area_; }
  double diagonal() const { return diagonal_; }  ///< of the bounding box
  Vec3 centre() const { return centre_; }        ///< of the bounding box

  /// Points on the surface and the triangle each lies in: the triangles' barycentres, or, where an edge is longer than
  /// the spacing, those of the parts that halving its longest edges leads to.
  const std::vector<Vec3>& samples() const { return samples_; }
  const std::vector<Index>& sample_triangles() const { return sample_triangles_; }

 private:
  void add_samples(const std::array<Vec3, 3>& corners, Index triangle, double spacing);

  std::vector<Vec3> positions_, normals_, samples_;
  std::vector<std::array<Index, 3>> triangles_;
  std::vector<double> areas_;
  std::vector<Index> sample_triangles_;
  double area_ = 0, volume_ = 0, diagonal_ = 0;
  VolumeSource volume_source_ = VolumeSource::signed_sum;
  Vec3 centre_ = Vec3::Zero();
};

}  // namespace subvol
