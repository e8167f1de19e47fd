// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include <unistd.h>

namespace subvol::fuzz {

/// Of the files that the target reads; extension.cpp, compiled for each.
extern const std::string_view kExtension;

/// A finding unless it holds.
inline void require(bool holds) {
  if (!holds) std::abort();
}

/// The bytes in a file of this process, written over by the next call; for readers that take a name.
inline const std::filesystem::path& as_file(const std::uint8_t* data, std::size_t size) {
  static const std::filesystem::path file =
      std::filesystem::temp_directory_path() / ("subvol-fuzz-" + std::to_string(getpid()) + std::string(kExtension));
  std::ofstream(file, std::ios::binary).write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  return file;
}

}  // namespace subvol::fuzz
