// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <vector>

namespace subvol::internal {

/// Returns orientations in which a grid may suit a surface: the coordinate axes, the principal axes of its area, and a
/// frame of the two perpendicular directions that most of its area faces. Each is a rotation; frames with the same axes
/// are given once.
/// surface  a surface with at least one triangle of non-zero area. Cost: linear in the triangles, plus a sort of the
///          facing directions.
std::vector<Mat3> template_frames(const TriangleMesh& surface);

}  // namespace subvol::internal
