// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace subvol::test {

/// Folder of the project's sources.
std::string source_dir();

/// The program that belongs to these tests; empty where it is not built.
std::string program();

/// Folder of the real inputs: the environment variable SUBVOL_DATA, or shared/data beside the source folder. Nothing
/// where neither is there; tests then WARN("SKIPPED: ...") and return (tests/support/skipping.h).
std::optional<std::filesystem::path> data_dir();

}  // namespace subvol::test
