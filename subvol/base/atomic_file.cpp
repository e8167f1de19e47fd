// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/atomic_file.h"

#include "subvol/base/error.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <random>
#include <string>
#include <utility>

namespace subvol {

namespace fs = std::filesystem;

namespace {

[[noreturn]] void fail(const fs::path& path, const char* step, int error) {
  throw IoError(path.string() + ": cannot " + step + ": " + std::strerror(error));
}

/// Owns an open file descriptor and closes it.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() { close(); }
  int get() const { return fd_; }
  bool close() { return fd_ < 0 || ::close(std::exchange(fd_, -1)) == 0; }

 private:
  int fd_;
};

/// Name of a temporary file that exists or is about to be created, kept where a signal handler finds it.
struct Slot {
  std::atomic<bool> is_taken{false}, is_named{false};
  std::array<char, 4096> name{};
};
static_assert(std::atomic<bool>::is_always_lock_free);
std::array<Slot, 16> slots;

/// Deletes a temporary file on destruction, unless it has been forgotten (after its rename).
class Temporary {
 public:
  Temporary() = default;
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;
  ~Temporary() {
    if (!path_.empty()) ::unlink(path_.c_str());
    forget();
  }
  const fs::path& path() const { return path_; }
  /// To be called before the file is created.
  void set(fs::path path) {
    forget();
    path_ = std::move(path);
    const std::string_view name = path_.native();
    for (Slot& slot : slots) {
      if (name.size() >= slot.name.size() || slot.is_taken.exchange(true)) continue;
      std::copy(name.begin(), name.end(), slot.name.begin());
      slot.name[name.size()] = 0;
      slot.is_named = true;
      slot_ = &slot;
      break;
    }
  }
  /// To be called if the file no longer exists or belongs to someone else.
  void forget() {
    path_.clear();
    if (slot_ == nullptr) return;
    slot_->is_named = false;
    slot_->is_taken = false;
    slot_ = nullptr;
  }

 private:
  fs::path path_;
  Slot* slot_ = nullptr;
};

void write_all(int fd, std::string_view bytes, const fs::path& path) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd, bytes.data(), bytes.size());
    if (written < 0) {
      if (errno == EINTR) continue;
      fail(path, "write", errno);
    }
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
}

/// Number of writes under way to something that may have no reader, such as a pipe.
std::atomic<int> num_waiting{0};
static_assert(std::atomic<int>::is_always_lock_free);

struct Waiting {
  Waiting() { ++num_waiting; }
  Waiting(const Waiting&) = delete;
  Waiting& operator=(const Waiting&) = delete;
  ~Waiting() { --num_waiting; }
};

/// Writes to `target` in place; messages call it `path`.
void write_directly(const fs::path& target, const fs::path& path, std::string_view bytes) {
  const Waiting waiting;
  Descriptor file(::open(target.c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC));
  if (file.get() < 0) fail(path, "open for writing", errno);
  write_all(file.get(), bytes, path);
  if (!file.close()) fail(path, "close", errno);
}

/// Creates an empty file under a fresh name. It does not use mkstemp, whose mode 0600 would override the user's umask.
int create_temporary(const fs::path& target, const fs::path& path, Temporary& temporary) {
  std::random_device random;
  for (int attempt = 0; attempt < 100; ++attempt) {
    fs::path candidate = target.parent_path() / (".subvol-" + std::to_string(random()) + ".tmp");
    temporary.set(std::move(candidate));
    const int fd = ::open(temporary.path().c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (fd >= 0) return fd;
    const int error = errno;
    temporary.forget();
    if (error != EEXIST) fail(path, "create a temporary file in its folder", error);
  }
  fail(path, "create a temporary file in its folder", EEXIST);
}

/// Flushes the folder of `target`: a rename reaches the disk only with its folder. It is not an error if the file
/// system cannot flush folders.
void flush_folder(const fs::path& target) {
  const fs::path folder = target.has_parent_path() ? target.parent_path() : fs::path(".");
  Descriptor descriptor(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (descriptor.get() >= 0) (void)::fsync(descriptor.get());
}

}  // namespace

fs::path behind_links(const fs::path& path) {
  constexpr int kMostLinks = 40;  // as many as Linux follows
  fs::path target = path;
  std::error_code ignored;
  for (int i = 0; i < kMostLinks; ++i) {
    if (!fs::is_symlink(target, ignored)) return target;
    // The folder may be a link, too: /dev/fd leads to a folder in /proc.
    const fs::path folder = fs::canonical(target.has_parent_path() ? target.parent_path() : ".", ignored);
    if (folder.native().starts_with("/proc/")) return folder / target.filename();
    target = target.parent_path() / fs::read_symlink(target, ignored);  // an absolute target replaces the folder
  }
  fail(path, "write", ELOOP);
}

bool waits_for_reader() noexcept { return num_waiting > 0; }

void write_file_atomically(const fs::path& path, std::string_view bytes) {
  std::error_code ignored;
  const fs::path target = behind_links(path);
  struct stat status = {};
  const bool exists = ::stat(target.c_str(), &status) == 0;
  if (exists && S_ISDIR(status.st_mode)) fail(path, "write", EISDIR);
  if (exists && (!S_ISREG(status.st_mode) || fs::is_symlink(target, ignored)))
    return write_directly(target, path, bytes);
  // A rename would replace a write-protected file without asking.
  if (exists && ::access(target.c_str(), W_OK) != 0) fail(path, "replace", errno);

  Temporary temporary;
  Descriptor file(create_temporary(target, path, temporary));
  if (exists) (void)::fchmod(file.get(), status.st_mode & 07777);
  write_all(file.get(), bytes, path);
  if (::fsync(file.get()) != 0) fail(path, "flush to the disk", errno);
  if (!file.close()) fail(path, "close", errno);
  if (::rename(temporary.path().c_str(), target.c_str()) != 0) fail(path, "rename the temporary file", errno);
  temporary.forget();
  flush_folder(target);
}

// Signal handlers call this: it uses async-signal-safe functions only.
void delete_temporaries() noexcept {
  for (const Slot& slot : slots)
    if (slot.is_named) (void)::unlink(slot.name.data());
}

}  // namespace subvol
