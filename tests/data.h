// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdlib>
#include <filesystem>
#include <optional>

namespace subvol::test {

/// Folder of the real inputs: the environment variable SUBVOL_DATA, or shared/data beside the source folder. Nothing where
/// neither is there; tests then WARN("SKIPPED: ..."), which ctest counts as skipped, and return.
inline std::optional<std::filesystem::path> data_dir() {
  const char* variable = std::getenv("SUBVOL_DATA");
  const std::filesystem::path folder =
      variable && *variable ? std::filesystem::path(variable)
                            : std::filesystem::path(SUBVOL_SOURCE_DIR) / ".." / "shared" / "data";
  if (!std::filesystem::is_directory(folder)) return std::nullopt;
  return folder;
}

}  // namespace subvol::test
