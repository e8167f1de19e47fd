// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/written_names.h"

#include "subvol/export/cell_text.h"
#include "subvol/io/nodal_writers.h"

#include <algorithm>

namespace subvol::internal {

std::string name_in_file(const std::string& extension, std::string name) {
  if (extension == ".inp") return inp_name(name);
  if (extension == ".msh") return gmsh_name(std::move(name));
  if (extension == ".obj")
    std::replace_if(
        name.begin(), name.end(), [](unsigned char c) { return c <= ' ' || c == '#' || c == '\\'; }, '_');
  return name;
}

}  // namespace subvol::internal
