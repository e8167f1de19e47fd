// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/support/data.h"

#include <cstdlib>

namespace subvol::test {

// The only file that is compiled with paths: all others are the same for every folder that the project lies in.
std::string source_dir() { return SUBVOL_SOURCE_DIR; }

std::string program() { return SUBVOL_PROGRAM; }

std::optional<std::filesystem::path> data_dir() {
  const char* variable = std::getenv("SUBVOL_DATA");
  const std::filesystem::path folder = variable && *variable
                                           ? std::filesystem::path(variable)
                                           : std::filesystem::path(source_dir()) / ".." / "shared" / "data";
  if (!std::filesystem::is_directory(folder)) return std::nullopt;
  return folder;
}

}  // namespace subvol::test
