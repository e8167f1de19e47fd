// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/quality_caps.h"
#include "subvol/fit/fits/fit_level.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/subdivision/limit_surface.h"
#include "subvol/surface/triangle_mesh.h"

#include <cstddef>
#include <span>
#include <vector>

namespace subvol::internal {

/// Number of hexes that a hex is subdivided into; they follow each other (`subdivide`).
inline constexpr std::size_t kChildren = 8;

/// A subdivision volume while it is fitted: the vertices of a cage of hexes are the unknowns, and the mesh that it is
/// subdivided to once, its boundary vertices at limit positions, is what is judged.
class FittedCage {
 public:
  /// cage  hexes with their tags; as for `subdivide`.
  explicit FittedCage(VolumeMesh cage, const Tuning& tuning = {});

  VolumeMesh cage;  ///< only its positions may change
  const FitLevel& level() const { return level_; }
  const BoundaryRefinement& limit() const { return limit_; }

  /// Returns where the present cage puts the mesh's vertices.
  std::vector<Vec3> nodes() const { return level_.nodes.apply(cage.positions); }
  /// Returns the mesh at these positions.
  VolumeMesh mesh() const;
  /// Returns the limit surface of the present cage.
  TriangleMesh limit_surface() const { return limit_triangles(level_, limit_, cage.positions); }

  /// Returns for each cell of the mesh what the cell of the cage that it is a part of has. values: of the cage's cells,
  /// or empty.
  std::vector<double> of_children(std::span<const double> values) const;
  /// Returns for each cell of the cage the sum over its parts. values: of the mesh's cells.
  std::vector<double> sums_of_parts(std::span<const double> values) const;
  /// Returns the group of each face of the mesh: that of the face of the cage that it is a part of; 0 for faces inside
  /// cells of the cage. groups: of the cage's faces, by `MeshTopology`.
  std::vector<Index> groups_of_parts(std::span<const Index> groups) const;
  /// Returns the caps on the parts of the cage's edges, and at its vertices.
  QualityCaps caps_of_parts(const QualityCaps& caps) const;

 private:
  FitLevel level_;
  BoundaryRefinement limit_;
};

}  // namespace subvol::internal
