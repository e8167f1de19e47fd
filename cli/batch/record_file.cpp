// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/batch/record_file.h"

#include "cli/batch/batch_model.h"
#include "subvol/base/error.h"

#include <cerrno>
#include <cstring>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace subvol::cli {
namespace {

namespace fs = std::filesystem;

/// The byte of the claims that is locked while a record is appended. Models lock bytes below it.
constexpr std::int64_t kAppendByte = std::int64_t{1} << 62;
constexpr std::size_t kRecordBlockBytes = std::size_t{1} << 22;
constexpr std::chrono::seconds kFlushInterval{1};

std::int64_t byte_of(std::string_view id) { return static_cast<std::int64_t>(id_hash(id) >> 2); }

[[noreturn]] void fail(const fs::path& path, const char* step) {
  throw IoError(path.string() + ": cannot " + step + ": " + std::strerror(errno));
}

std::uint64_t size_of(int file, const fs::path& path) {
  struct stat status {};
  if (fstat(file, &status) != 0) fail(path, "look at");
  return static_cast<std::uint64_t>(status.st_size);
}

std::uint64_t for_each_line(int file, const fs::path& path, std::uint64_t from,
                            const std::function<void(std::string_view)>& use) {
  std::vector<char> block(kRecordBlockBytes);
  std::size_t filled = 0;
  for (std::uint64_t at = from;;) {
    if (filled == block.size()) block.resize(2 * block.size());  // a line longer than the block
    const ssize_t read = pread(file, block.data() + filled, block.size() - filled, static_cast<off_t>(at));
    if (read < 0 && errno == EINTR) continue;
    if (read < 0) fail(path, "read");
    if (read == 0) return at - filled;
    at += static_cast<std::uint64_t>(read);
    filled += static_cast<std::size_t>(read);
    std::string_view rest(block.data(), filled);
    for (std::size_t end; (end = rest.find('\n')) != std::string_view::npos; rest.remove_prefix(end + 1))
      use(rest.substr(0, end));
    std::memmove(block.data(), rest.data(), rest.size());
    filled = rest.size();
  }
}

fs::path with_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw IoError(folder.string() + ": cannot create the folder: " + error.message());
  return folder;
}

}  // namespace

RecordFile::File::File(const fs::path& path, int flags) : descriptor_(open(path.c_str(), flags | O_CREAT, 0666)) {
  if (descriptor_ < 0) fail(path, "open");
}

RecordFile::File::~File() { close(descriptor_); }

// The claims stay open in the processes that this one starts, so that a claim lasts until these are gone as well.
RecordFile::RecordFile(const fs::path& folder)
    : path_(with_folder(folder) / kRecordsName),
      records_(path_, O_RDWR | O_APPEND | O_CLOEXEC),
      claims_(folder / "claims", O_RDWR) {}

RecordFile::~RecordFile() {
  if (!is_flushed_) (void)fdatasync(records_.get());
}

bool RecordFile::lock(std::int64_t byte, short kind, bool wait) {
  struct flock range {};
  range.l_type = kind;
  range.l_whence = SEEK_SET;
  range.l_start = byte;
  range.l_len = 1;
  while (fcntl(claims_.get(), wait ? F_OFD_SETLKW : F_OFD_SETLK, &range) != 0) {
    if (errno == EINTR) continue;
    if (!wait && (errno == EAGAIN || errno == EACCES)) return false;
    throw IoError(path_.parent_path().string() + ": cannot lock a file there: " + std::strerror(errno) +
                  "; use a folder on another file system for each shard");
  }
  return true;
}

bool RecordFile::claim(std::string_view id) { return lock(byte_of(id), F_WRLCK, false); }
void RecordFile::release(std::string_view id) { lock(byte_of(id), F_UNLCK, false); }

void RecordFile::read_new(const std::function<void(std::string_view)>& use) {
  if (size_of(records_.get(), path_) == read_to_) return;
  read_to_ = for_each_line(records_.get(), path_, read_to_, use);
}

void RecordFile::append(std::string_view line) {
  lock(kAppendByte, F_WRLCK, true);
  const std::uint64_t before = size_of(records_.get(), path_);
  // A machine that failed in the middle of a line left it without an end.
  char last = '\n';
  if (before > 0 && pread(records_.get(), &last, 1, static_cast<off_t>(before - 1)) != 1) fail(path_, "read");
  std::string text = last == '\n' ? "" : "\n";
  text.append(line).append("\n");
  ssize_t written;
  do written = write(records_.get(), text.data(), text.size());
  while (written < 0 && errno == EINTR);
  const bool is_whole = written == static_cast<ssize_t>(text.size());
  const int error = written < 0 ? errno : ENOSPC;
  if (!is_whole) (void)!ftruncate(records_.get(), static_cast<off_t>(before));
  lock(kAppendByte, F_UNLCK, false);
  if (!is_whole) {
    errno = error;
    fail(path_, "append a record");
  }
  if (before == read_to_) read_to_ += text.size();
  if (is_flushed_) first_unflushed_ = std::chrono::steady_clock::now();
  is_flushed_ = false;
  flush_if_due();
}

void RecordFile::flush_if_due() {
  if (is_flushed_ || std::chrono::steady_clock::now() - first_unflushed_ < kFlushInterval) return;
  if (fdatasync(records_.get()) != 0) fail(path_, "flush to the disk");
  is_flushed_ = true;
}

}  // namespace subvol::cli
