// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/automatic_attempts.h"
#include "subvol/fit/energies/quality_energy.h"
#include "subvol/fit/features/followed_creases.h"
#include "subvol/fit/features/signed_features.h"
#include "subvol/fit/fits/local_cells.h"
#include "subvol/surface/triangle_mesh.h"

#include <cstddef>
#include <vector>

namespace subvol::internal {

/// The state of the sharp edges of a target.
struct Edges {
  TriangleMesh mesh;        ///< the target's triangles, oriented outward, in normalized coordinates
  SignedFeatures features;  ///< no curves: there is nothing to follow
};

/// Tells what a trial was made from, and where it is not as good as aimed at.
struct TrialStart {
  AutomaticAttempt::Kind kind = AutomaticAttempt::Kind::smooth;
  VolumeMesh grid;                  ///< if edges are followed; else without cells
  std::vector<Vec3> fitted;         ///< positions of the grid's vertices near the target
  std::vector<double> sizes;        ///< of the cells of the trial's mesh (`SizedMesh`)
  std::vector<Index> far, poor;     ///< cells of the trial's mesh that are too far from the target, or below the goal
  std::vector<std::size_t> stages;  ///< that brought the grid near the target, by their numbers in the report
};

/// This is what a level needs of an edge layout. The layout belongs to a mesh; if that mesh is a cage, the faces and
/// edges here are the parts of its own on the mesh that it is subdivided to.
struct LevelLayout {
  std::vector<Index> group_of_face;
  QualityCaps caps;
  FollowedCreases creases;
};

/// Tells which curves of the target a fit follows.
struct EdgeChoice {
  bool sharp = false, borders = false;  ///< sharp edges; borders of groups
  bool any() const { return sharp || borders; }
};

}  // namespace subvol::internal
