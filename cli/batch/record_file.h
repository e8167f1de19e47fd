// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace subvol::cli {

/// The records of a batch in its folder, shared by all processes that work on it, also on several machines.
///
/// Records are lines of "records.jsonl", each appended with one write. A record is never changed; the last one of an id
/// counts. Workers claim a model by locking a byte of the file "claims", which holds nothing. The system releases locks
/// if a process dies in any way, and only when the processes that it has started are gone as well.
class RecordFile {
 public:
  /// Opens the files, and creates them and the folder if need be. IoError: that cannot be done.
  explicit RecordFile(const std::filesystem::path& folder);
  RecordFile(const RecordFile&) = delete;
  RecordFile& operator=(const RecordFile&) = delete;
  /// Flushes records to the disk.
  ~RecordFile();

  /// Claims a model; returns false if another process has claimed it. IoError: the file system has no locks.
  bool claim(std::string_view id);
  void release(std::string_view id);

  /// Calls use(line) for each whole line that has been appended since the last call, by any process; of this process
  /// possibly not those whose lines nobody else has interrupted.
  void read_new(const std::function<void(std::string_view line)>& use);

  /// Appends a line. It is with the system when the function returns, and survives the end of this process; it is on
  /// the disk about a second later. IoError: it cannot be written (a full disk); the file then has no part of it.
  void append(std::string_view line);

  /// Flushes what was appended more than a second ago.
  void flush_if_due();

 private:
  /// An open file.
  class File {
   public:
    File(const std::filesystem::path& path, int flags);
    ~File();
    File(const File&) = delete;
    File& operator=(const File&) = delete;
    int get() const { return descriptor_; }

   private:
    int descriptor_;
  };
  bool lock(std::int64_t byte, short kind, bool wait);

  std::filesystem::path path_;
  File records_, claims_;
  std::uint64_t read_to_ = 0;  ///< bytes of the file that have been read, or written by this process
  bool is_flushed_ = true;
  std::chrono::steady_clock::time_point first_unflushed_{};
};

/// Name of the file of records in a batch's folder.
inline constexpr const char* kRecordsName = "records.jsonl";

}  // namespace subvol::cli
