// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/export/export.h"
#include "subvol/mesh/fit_state.h"

#include <span>

namespace subvol {

/// Returns a scene of the course of a fit: its node "surface" passes through the states one after another and ends as
/// the result, the limit surface of a control cage. The cage is refined at least once and at most 4 times, as long as
/// it stays below 20,000 quads.
///
/// Each state is a shape (`SceneNode::shapes`) with its own normals; an edge at which faces of the result meet at more
/// than `crease_angle_degrees` is shaded sharp in all shapes. There is no wireframe: viewers fail at animated lines.
/// InputError: a state whose number of positions differs from the mesh's; options out of range.
Scene animation_scene(const VolumeMesh& cage, std::span<const FitState> states,
                      const SurfaceSceneOptions& options = {});

/// Does the same for the boundary of a high-order mesh, each face cut into 2 * (largest order) intervals per side. The
/// positions of states are coefficients.
Scene animation_scene(const HighOrderMesh& mesh, std::span<const FitState> states,
                      const SurfaceSceneOptions& options = {});

}  // namespace subvol
