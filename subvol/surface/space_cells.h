// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <Eigen/Geometry>

#include <cstddef>
#include <optional>
#include <vector>

namespace subvol::internal {

/// A component of the space around one part of a surface, as if there were no other parts. A triangle t has two sides:
/// 2t is behind it, 2t + 1 in front.
struct SpaceCell {
  std::size_t part = 0;
  double volume = 0;  ///< signed: negative for the one around the part
  double area = 0;
  std::vector<Index> sides;

  /// Returns true if the cell encloses more than rounding.
  bool has_volume() const;
};

/// Triangles of a surface that edges connect, and the cells into which they divide space.
struct PartWithCells {
  std::vector<std::size_t> cells;  ///< places in `SpaceCells::cells`
  std::size_t outer = 0;           ///< of these, the one around the part
  std::vector<Index> triangles;
  bool has_curves = false;  ///< edges of more than two triangles
  double own_volume = 0;    ///< sum over its triangles as they are oriented
  /// Place in `SpaceCells::cells` of the smallest cell of another part that contains this one; nothing: there is none.
  std::optional<std::size_t> inside;
  Eigen::AlignedBox3d box;
};

/// The cells that the parts of a surface divide space into.
struct SpaceCells {
  std::vector<SpaceCell> cells;
  std::vector<PartWithCells> parts;

  /// Returns how a part faces: 1 if all of it faces outward, -1 inward.
  double facing(std::size_t part) const;
};

/// Finds the cells of a surface's parts, and the smallest one around each part that lies in others.
///
/// mesh     welded, without copies of triangles.
/// returns  nothing if an edge has only one triangle, or if triangles lie on each other there (`contacts_at_edge`).
/// Cost: a sort of the edges; of parts inside others, that of winding numbers.
std::optional<SpaceCells> find_space_cells(const TriangleMesh& mesh);

}  // namespace subvol::internal
