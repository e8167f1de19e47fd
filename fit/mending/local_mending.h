// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/mending/mending_goal.h"
#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <vector>

namespace subvol::internal {

/// Returns true if every edge has one triangle or two that run along it in opposite directions, and every vertex one
/// fan of triangles.
bool is_manifold(std::span<const std::array<Index, 3>> triangles, std::size_t num_vertices);

/// Moves vertices toward the middle of the triangles around them, by half the distance, or by a tenth of their shortest
/// edge if that is less. Vertices whose neighbors lie all around stay.
void move_toward_fans(TriangleMesh& mesh, std::span<const Index> vertices, double distance);

/// The changes that `mend_locally` has made.
struct LocalMending {
  std::vector<char> is_dropped;  ///< per triangle of the mesh
  std::size_t flipped_edges = 0, moved_vertices = 0;
  bool is_cancelled = false;
};

/// Removes faults (`find_faults`) of a manifold surface one by one, each by the change of the triangles around it that
/// leaves the fewest faults; see `mend_surface`.
///
/// mesh      changed in place; dropped triangles keep some numbers.
/// distance  largest change, in the mesh's unit: length of edges that collapse, distance of the diagonals of a flip,
///           way of a vertex from where it was.
/// goal      decides what is a fault.
/// Faults for which no change helps are left, and if there are more than a thousand, all are. At a fault among hundreds
/// of triangles that are all near each other, only the first changes are tried.
LocalMending mend_locally(TriangleMesh& mesh, double distance, MendingGoal goal,
                          const std::function<bool()>& cancelled);

}  // namespace subvol::internal
