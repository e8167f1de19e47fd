// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/fits/fitted_cage.h"
#include "subvol/mesh/volume_mesh.h"

#include <span>

namespace subvol::internal {

/// Moves the sheets of a mesh, its boundary and its interfaces, a little so that every region gets a given volume:
/// straight cells between points on a curved surface have less volume inside it and more outside.
///
///   d_v = P_v sum_r mu_r g_r(v) / a_v,   V_r(x + d) = V_r wanted to first order
///
/// g_r(v): gradient of the volume of region r;  a_v: third of the area around v;  P_v: projector that keeps v in the
/// planes of faces around it which are flat up to rounding. Each sheet thus moves along its normals, by the difference
/// of its two regions' factors. This is repeated until all volumes are right up to 1e-6, or no longer come nearer.
///
/// wanted   volumes, ascending by reference (`region_volumes`), > 0.
/// returns  false, with the mesh as it was, if a cell would lose its certificate, or a cell that is poorer than
///          `least_jacobian` would become poorer. True if there is no such move; the mesh is then as it was, too.
bool restore_volumes(VolumeMesh& mesh, std::span<const double> wanted, double least_jacobian);

/// Does the same for the mesh of a cage. Each vertex of the cage makes the move d_v of the mesh's vertex of the same
/// number, which lies beside it. If d is smooth, the mesh moves by about d.
bool restore_volumes(FittedCage& cage, std::span<const double> wanted, double least_jacobian);

}  // namespace subvol::internal
