// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/mending/surface_repair.h"
#include "subvol/fit/target/surface_diagnosis.h"
#include "subvol/surface/triangle_mesh.h"

#include <functional>
#include <optional>

namespace subvol::internal {

/// Returns true if no template can be made for a surface that could not be repaired: it bounds no solid, or its parts
/// cross and would count as several solids. False if sheets are meant to divide its inside, which would vanish in a
/// wrap: they meet along edges that are longer, together, than the rim of a pinhole; shorter ones are accidents, and so
/// are those of a surface that crosses itself ten times as often.
///
/// repaired   the surface as far as it could be repaired; null if that ended with an error.
/// diagnosis  of the given surface.
bool needs_wrap(const TriangleMesh* repaired, const SurfaceDiagnosis& diagnosis);

/// Wraps a surface that bounds no solid, with voxels of the usual size (`wrap_surface`). A surface that points inward
/// as a whole is turned before.
///
/// The sentence in `done` tells how far the wrap is from the surface: covers of holes count, parts that the wrap hides
/// inside do not.
/// returns  nothing if the wrap is empty, or in more pieces than the surface has parts; it does not follow it then.
/// InputError: the wrap is more than half a voxel off the surface on average, which is that of no solid.
std::optional<SurfaceRepair> wrapped_to_fill(const TriangleMesh& given, const SurfaceDiagnosis& diagnosis,
                                             const std::function<bool()>& cancelled);

}  // namespace subvol::internal
