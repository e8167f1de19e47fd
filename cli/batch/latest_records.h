// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace subvol::cli {

/// The last record of each id in the folders of batches, as they are on the disk at the time of construction. The files
/// are mapped into memory, not copied.
class LatestRecords {
 public:
  /// InputError, naming the folder: it is no folder of a batch.
  explicit LatestRecords(std::span<const std::filesystem::path> folders);
  ~LatestRecords();

  /// A record: its line, and the number of the folder it is in.
  struct Entry {
    std::string_view line;
    std::size_t folder = 0;
  };
  std::size_t size() const { return entries_.size(); }
  /// Calls use(entry) for all records, ordered by the bytes of their ids.
  void for_each(const std::function<void(const Entry&)>& use) const;
  /// Returns the line of an id; empty if there is none.
  std::string_view find(const std::string& id) const;
  /// Lines that are no records.
  std::size_t num_damaged() const { return num_damaged_; }

 private:
  class Mapping;
  std::vector<std::unique_ptr<Mapping>> files_;
  std::unordered_map<std::string_view, Entry> entries_;  ///< by `quoted_id`
  std::size_t num_damaged_ = 0;
};

}  // namespace subvol::cli
