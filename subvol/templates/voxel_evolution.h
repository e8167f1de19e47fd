// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/templates/search_stop.h"
#include "subvol/templates/voxel_topology.h"

#include <optional>
#include <span>

namespace subvol::internal {

/// Target of a voxel solid: cells are filled if their fraction is above the threshold, as far as the topology allows.
struct VoxelGoal {
  std::span<const double> fractions;  ///< share of each cell that lies in the shape, in [0, 1]
  double threshold = 0.5;             ///< in (0, 1)
  BettiNumbers topology;
  SearchStop* stop = nullptr;  ///< if it is stopped, the functions below end early; null: they do not

  bool is_stopped() const { return stop && stop->is_stopped(); }
  bool is_stopped_at(std::size_t count) const { return stop && stop->is_stopped_at(count); }
  bool wants(Index cell) const { return fractions[cell] > threshold; }
  /// Gain of flipping a cell, in [-1, 1]: positive if the cell is not as wanted.
  double gain(const VoxelSolid& solid, Index cell) const {
    return solid.filled(cell) ? threshold - fractions[cell] : fractions[cell] - threshold;
  }
};

/// Flips cells that are not as wanted, in order of decreasing gain, as long as the topology does not change.
void evolve(VoxelSolid& solid, const VoxelGoal& goal);

/// Flips single cells, each time the one that improves most, until all points are good. Returns false if it does not
/// reach that.
bool make_points_good(VoxelSolid& solid, const VoxelGoal& goal);

/// Empties surplus components and fills surplus cavities, smallest first. Returns false if there are too few of either.
bool drop_surplus(VoxelSolid& solid, const VoxelGoal& goal);

/// Adds or removes handles one by one until their number is right; it prefers large handles when adding and small ones
/// when removing, and calls `evolve` after each. Returns false if that is not possible. All points must be good.
bool match_handles(VoxelSolid& solid, const VoxelGoal& goal);

/// Grows toward parts of the shape that no filled cell is near, such as tails and fingers thinner than a cell. The
/// topology does not change.
void reach_thin_parts(VoxelSolid& solid, const VoxelGoal& goal);

/// Creates a solid of the goal's topology in one of three ways; returns nothing if that topology cannot be reached.
///
///   cut     from the cells above the threshold: bad points repaired, surplus components and cavities dropped
///   grown   from the fullest cell             } for one component without cavities
///   shrunk  from all cells the grid may fill  }
enum class VoxelStart { cut, grown, shrunk };
std::optional<VoxelSolid> start_solid(VoxelStart start, const std::array<int, 3>& cells, VertexRule rule,
                                      const VoxelGoal& goal);

}  // namespace subvol::internal
