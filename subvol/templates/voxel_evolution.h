// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/templates/voxel_topology.h"

#include <optional>
#include <span>

namespace subvol {

/// What a voxel solid is to become: filled where the fraction is above the threshold, as far as its topology allows.
struct VoxelGoal {
  std::span<const double> fractions;  ///< of each cell that lies in the shape, in [0, 1]
  double threshold = 0.5;             ///< in (0, 1)
  BettiNumbers topology;

  bool wants(Index cell) const { return fractions[cell] > threshold; }
  /// What flipping a cell gains, in [-1, 1]: positive where it is not as wanted.
  double gain(const VoxelSolid& solid, Index cell) const {
    return solid.filled(cell) ? threshold - fractions[cell] : fractions[cell] - threshold;
  }
};

/// Flips cells that are not as wanted, most certain ones first, while the topology stays as it is.
void evolve(VoxelSolid& solid, const VoxelGoal& goal);

/// Flips single cells until all points are good, each time where most is won. False where that does not end.
bool make_points_good(VoxelSolid& solid, const VoxelGoal& goal);

/// Empties the components and fills the cavities that are too many, smallest first. False where there are too few.
bool drop_surplus(VoxelSolid& solid, const VoxelGoal& goal);

/// Adds or removes handles one by one until their number is right, large ones first and small ones first respectively,
/// evolving after each. False where that is not possible. Points must be good.
bool match_handles(VoxelSolid& solid, const VoxelGoal& goal);

/// Grows towards parts of the shape that no filled cell is near: tails and fingers thinner than a cell. The topology
/// stays.
void reach_thin_parts(VoxelSolid& solid, const VoxelGoal& goal);

/// Starts a solid of the goal's topology in one of three ways; empty where it cannot be reached.
///
///   cut     the cells above the threshold, with bad points repaired
///   grown   from the fullest cell             } for one component without cavities
///   shrunk  from all cells the grid may fill  }
enum class VoxelStart { cut, grown, shrunk };
std::optional<VoxelSolid> start_solid(VoxelStart start, const std::array<int, 3>& cells, VertexRule rule,
                                      const VoxelGoal& goal);

}  // namespace subvol
