// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/cell_topology.h"

#include <cstddef>
#include <mutex>
#include <string_view>
#include <vector>

namespace subvol::internal {

// These constants and functions serve both the reader and the writer of Exodus files.

inline constexpr const char* kNoNetcdf =
    "Exodus: this program was built without netCDF; install libnetcdf-dev and build it again, or take another format";

/// To be held during calls of netCDF, which keeps a list of open files and must not be called by two threads at once.
std::mutex& netcdf_lock();

/// The name that a second block of a reference has after that of the first: Exodus has one kind of cell in a block.
const char* kind_suffix(CellKind kind);

/// The name of the block of a reference without a name begins so.
inline constexpr std::string_view kReferenceBlock = "reference ";

/// Places in an element of Exodus of the nodes of `NodeOrdering::vtk`: Exodus has upright edges before those of the
/// top, and of a hex the nodes of the cell, the bottom and the top before those of the other faces.
std::vector<std::size_t> exodus_places(CellKind kind, std::size_t num_nodes);

}  // namespace subvol::internal
