// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/high_order_mesh.h"
#include "subvol/mesh/volume_mesh.h"

#include <vector>

namespace subvol::internal {

/// Returns, for each node of a curved mesh, the projector on the directions in which it may move while the boundary and
/// the interfaces between regions keep their shape:
///
///   inside the cells    all directions
///   on flat faces       those in the planes of all these faces
///   on borders          along the edge if it is straight; these are edges between faces of different groups or regions
///   elsewhere           none
///
/// The borders of flat faces with curved ones are on both, so they stay.
///
/// labels  the cells of the mesh with their references and groups; its positions are not read.
/// fixed   true: all nodes of these faces stay.
/// A face is flat if its nodes are within 1e-7 of its size of a plane, and an edge is straight likewise: coordinates in
/// files often have eight digits. Normals that differ by less than 1e-5 are the same. Cost: linear.
std::vector<Mat3> sheet_projectors(const HighOrderMesh& mesh, const VolumeMesh& labels, bool fixed);

}  // namespace subvol::internal
