// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/file_place.h"

#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"

#include <algorithm>
#include <filesystem>

namespace subvol::internal {

void fail_at(const FilePlace& place, const std::string& what) {
  throw InputError(*place.file + ":" + std::to_string(place.line) + ": " + what);
}

IncludedFiles::File IncludedFiles::read(const FilePlace& place, std::string input, int depth) {
  constexpr int kMostIncludeDepth = 8, kMostIncludedFiles = 256;  // beyond any model; a file may include itself
  if (depth > kMostIncludeDepth || ++num_files_ > kMostIncludedFiles)
    fail_at(place, "more than " + std::to_string(kMostIncludeDepth) + " files in one another, or more than " +
                       std::to_string(kMostIncludedFiles) + " in all");
  std::replace(input.begin(), input.end(), '\\', '/');
  namespace fs = std::filesystem;
  fs::path path = fs::path(*place.file).parent_path() / input;
  std::error_code error;
  if (const fs::path other = fs::path(main_).parent_path() / input;
      !fs::exists(path, error) && fs::exists(other, error))
    path = other;
  try {
    return {path.string(), read_file(path)};
  } catch (const InputError& failure) {
    fail_at(place, std::string("the included file: ") + failure.what());
  }
}

}  // namespace subvol::internal
