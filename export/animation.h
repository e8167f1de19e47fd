// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/export.h"
#include "subvol/mesh/fit_state.h"

#include <span>

namespace subvol {

/// A fit as it went: one node "surface" that passes through the states one after the other and ends as the result.
///
/// Each state is a shape (`SceneNode::shapes`) with normals of its own; faces that meet at more than
/// `crease_angle_degrees` in the result are shaded apart in all. There is no wireframe: viewers fail at such lines.
/// InputError: states of another number of positions than the mesh; options out of range.

/// The limit surface of a control cage, refined as often as it stays below 20 000 quads, but once at least.
Scene animation_scene(const VolumeMesh& cage, std::span<const FitState> states,
                      const SurfaceSceneOptions& options = {});

/// The boundary of a high-order mesh, two quads to an interval of the order. Positions of states are coefficients.
Scene animation_scene(const HighOrderMesh& mesh, std::span<const FitState> states,
                      const SurfaceSceneOptions& options = {});

}  // namespace subvol
