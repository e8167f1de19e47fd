// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace subvol::internal {

/// Values of one name in a file of cells: one number for each cell, or for each point.
struct CellValues {
  std::string name;
  bool is_on_points = false;
  std::vector<double> values;  ///< in the file's order of cells of three dimensions, or of points; may be NaN
};

/// Returns the data of one component that a .vtu holds about its cells and points, for those that `read_nodal_mesh`
/// reads; nothing for other formats. Ghost arrays are left out. InputError: as `read_nodal_mesh`.
std::vector<CellValues> read_cell_values(const std::filesystem::path& path);

}  // namespace subvol::internal
