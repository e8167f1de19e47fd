// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

namespace subvol::internal {

/// Returns the name that a group of faces or a region has in a file of this format, before a number is put behind it
/// because another group has it already: see `inp_name` and `gmsh_name`; in .obj, blanks, # and backslashes become
/// underscores; other formats have the name as it is. Empty if the file has the group's number in its place.
///
/// extension  lower case, with its dot.
std::string name_in_file(const std::string& extension, std::string name);

}  // namespace subvol::internal
