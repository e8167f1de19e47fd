// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/mesh/cell_topology.h"
#include "subvol/mesh/face_groups.h"
#include "subvol/mesh/feature_tags.h"

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace subvol {

/// A mesh of linear hexes, prisms, tets and pyramids as a plain value: flat arrays, no derived data.
///
/// The corners of a cell follow `CellKind`'s numbering. Anything may be stored; `validate` says what is wrong with it.
struct VolumeMesh {
  std::vector<Vec3> positions;
  std::vector<CellKind> kinds;               ///< one per cell
  std::vector<std::size_t> cell_offsets{0};  ///< num_cells() + 1 entries into cell_vertices
  std::vector<Index> cell_vertices;
  std::vector<int> references;  ///< one group number per cell, or empty (all 0)
  FeatureTags tags;
  VolumeFaceGroups face_groups;  ///< named faces; empty: none
  std::vector<Group> regions;    ///< names of references, where there are any; dimension 3

  std::size_t num_vertices() const { return positions.size(); }
  std::size_t num_cells() const { return kinds.size(); }
  std::span<const Index> cell(std::size_t c) const {
    return {cell_vertices.data() + cell_offsets[c], cell_offsets[c + 1] - cell_offsets[c]};
  }
  /// Appends one cell; vertices.size() must be the kind's number of corners.
  void add_cell(CellKind kind, std::span<const Index> vertices);
};

}  // namespace subvol
