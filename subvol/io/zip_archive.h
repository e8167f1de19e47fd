// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>

namespace subvol::internal {

/// The files of a ZIP archive in memory, which must outlive it: stored or deflated, not encrypted. ZIP64, which
/// programs also write for small files, is read.
class ZipArchive {
 public:
  /// name: the archive's, for messages. InputError: no archive, or one that is damaged or encrypted.
  ZipArchive(std::string name, std::string_view bytes);

  bool has(const std::string& path) const { return entries_.contains(path); }
  /// Names of all files, in ascending order.
  const auto& entries() const { return entries_; }
  /// Returns the content of a file. InputError: there is none of that name, it is packed in another way or damaged, or
  /// it claims to be larger than its packed bytes can be.
  std::string read(const std::string& path) const;

 private:
  struct Entry {
    std::size_t method, checksum, packed_size, size, header;
  };
  std::string name_;
  std::string_view bytes_;
  std::map<std::string, Entry> entries_;
};

/// Makes a ZIP archive of deflated files. Equal contents give equal bytes: all have the same date.
class ZipWriter {
 public:
  void add(const std::string& path, std::string_view content);
  std::string take();

 private:
  std::string bytes_, directory_;
  std::size_t count_ = 0;
};

}  // namespace subvol::internal
