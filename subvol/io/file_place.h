// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <string>

namespace subvol::internal {

/// A place in a file, for messages.
struct FilePlace {
  const std::string* file = nullptr;
  std::size_t line = 0;
};
[[noreturn]] void fail_at(const FilePlace& place, const std::string& what);

/// Reads the files that a text file includes.
class IncludedFiles {
 public:
  struct File {
    std::string name, bytes;
  };
  /// main  path of the file that is read.
  explicit IncludedFiles(const std::string& main) : main_(main) {}

  /// Reads a file that is beside the one that includes it, or beside the main file.
  ///
  /// place  of the line that includes it.
  /// input  its path as written there, with separators of either kind.
  /// depth  1 for files that the main file includes, 2 for those that these include, and so on.
  /// InputError, with the place: the file cannot be read, or there are too many.
  File read(const FilePlace& place, std::string input, int depth);

 private:
  std::string main_;
  int num_files_ = 0;
};

}  // namespace subvol::internal
