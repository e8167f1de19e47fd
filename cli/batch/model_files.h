// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/batch/batch_model.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <unordered_map>

namespace subvol::cli {

/// Fingerprints of the files that a model reads.
struct ModelFiles {
  std::string hash;  ///< of their contents
  /// A hash of the sizes and times of change. It is empty if a file changed so lately that its time may not tell a
  /// later change.
  std::string stamp;
};

/// Finds the files that models read: the input, and every value of an option that names a file.
///
/// The contents of files are read at most once if many models share them.
class FileHasher {
 public:
  /// folders: those of the manifest.
  explicit FileHasher(const std::vector<std::filesystem::path>& folders) : folders_(folders) {}

  /// Reads the files of a model. A file that is missing or cannot be read counts as such: the verb will complain.
  ModelFiles hash(const BatchModel& model);
  /// Returns the stamp alone, which does not read the files.
  std::string stamp(const BatchModel& model) const;
  /// Returns a word with an absolute path in place of a file's name; other words are returned as they are. The input
  /// counts as a file even if it does not exist.
  std::string absolute(const BatchModel& model, const std::string& word) const;

 private:
  struct Content {
    std::uint64_t size = 0;
    std::int64_t changed = 0;  ///< nanoseconds
    std::uint64_t hash = 0;
  };

  const std::vector<std::filesystem::path>& folders_;
  std::unordered_map<std::string, Content> shared_;  ///< files that options name
};

}  // namespace subvol::cli
