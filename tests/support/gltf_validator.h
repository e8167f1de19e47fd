// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tests/support/data.h"
#include "tests/support/skipping.h"

#include <catch2/catch.hpp>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

namespace subvol::test {

/// Checks that the Khronos validator has nothing to say about files; warns where it is not there.
inline void check_with_validator(const std::vector<std::filesystem::path>& files) {
  int status = kSkippedStatus;
  if (std::getenv("SUBVOL_NODE_MODULES") && std::system("node --version > /dev/null 2>&1") == 0) {
    std::string command = "node \"" + source_dir() + "/tests/gltf_validator.mjs\"";
    for (const auto& file : files) command += " \"" + file.string() + '"';
    const int code = std::system(command.c_str());
    status = code == 0 ? 0 : code >> 8;
  }
  if (status == kSkippedStatus)
    WARN("SKIPPED: needs node and the npm package gltf-validator under SUBVOL_NODE_MODULES");
  else
    CHECK(status == 0);
}

}  // namespace subvol::test
