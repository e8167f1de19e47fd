// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/target/surface_diagnosis.h"
#include "subvol/surface/solid_topology.h"
#include "subvol/surface/triangle_mesh.h"

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace subvol {

/// A surface made ready to be filled, and what was done to it.
struct SurfaceRepair {
  TriangleMesh surface;
  std::vector<std::string> done;   ///< a sentence for each repair; empty: the surface is as it was given
  std::vector<std::string> notes;  ///< a sentence for each fault that was left: contacts, pinholes, crossings
};

/// Unites the parts of a surface that cross or overlap, and turns parts whose orientation disagrees with their nesting.
///
/// Closed parts that cross or share stretches of faces are united (`united`); if one of them is the wall of a void, its
/// inside is taken out of the others (`without`). A wall of a void that points outward is turned, and so is a part that
/// points inward beside others that do not. A solid part in a void stays a part of its own.
///
/// surface    in any state; a surface that needs no repair is returned bit by bit.
/// cancelled  asked now and then, from the calling thread; if it returns true, the surface is returned as it was given.
/// InputError: as `diagnose`; sheets that divide the inside into several regions; parts that cross and cannot be united,
/// with the place.
/// Cost: that of `diagnose`, and again if parts are united.
SurfaceRepair repair_surface(const TriangleMesh& surface, const std::function<bool()>& cancelled = {});

/// Returns why grids with up to 20 times a number of cells do not have the topology of a surface's solid: that they have
/// not, and each cause that a diagnosis finds, with its place.
std::string why_no_grid(const TriangleMesh& surface, std::size_t cells, const BettiNumbers& wanted);

}  // namespace subvol
