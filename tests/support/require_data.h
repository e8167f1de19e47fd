// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tests/support/data.h"

#include <catch2/catch.hpp>

#include <filesystem>
#include <optional>

namespace subvol::test {

/// Returns the folder of the real inputs (`data_dir`). If there is none, reports the test as skipped; the test then
/// returns: `if (!data) return;`.
inline std::optional<std::filesystem::path> require_data() {
  std::optional<std::filesystem::path> data = data_dir();
  if (!data) WARN("SKIPPED: needs the folder of real inputs; set SUBVOL_DATA");
  return data;
}

}  // namespace subvol::test
