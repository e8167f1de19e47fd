// SPDX-License-Identifier: GPL-3.0-or-later
// Preloaded (LD_PRELOAD) into the program, makes chosen calls of the C library fail, from the beginning of main() on:
//
//   FAIL=memory:K  or  FAIL=files:K    the K-th call of that kind fails, from 1; with K+ that one and all after it
//   FAIL_COUNT=FILE                    at the end, "MEMORY FILES" is written there: how many calls there were
//
// Memory: malloc and its kin have none (ENOMEM). Files: what opens, reads, writes, flushes, closes and renames files
// says EIO; of these, calls on the standard streams do not count, so that a program can say what happened.
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/uio.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>

// The functions of glibc have these names.
// NOLINTBEGIN(bugprone-reserved-identifier,readability-identifier-naming)
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
}
// NOLINTEND(bugprone-reserved-identifier,readability-identifier-naming)

namespace {

struct Kind {
  std::atomic<long> calls{0};
  long first = 0;
  bool all = false;

  /// Counts a call; whether it fails.
  bool fails() {
    const long number = ++calls;
    return first > 0 && (all ? number >= first : number == first);
  }
};
Kind memory, files;
std::atomic<bool> is_on{false};

bool memory_fails() {
  if (!is_on || !memory.fails()) return false;
  errno = ENOMEM;
  return true;
}

bool files_fail(int descriptor) {
  if (!is_on || (descriptor >= 0 && descriptor <= 2) || !files.fails()) return false;
  errno = EIO;
  return true;
}
constexpr int kNotOpenYet = -1;

/// The C library's own function of that name.
template <class Function>
Function* real(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

void read_settings() {
  const char* text = std::getenv("FAIL");
  const char* number = text ? std::strchr(text, ':') : nullptr;
  if (!number) return;
  Kind& kind = std::strncmp(text, "memory", 6) == 0 ? memory : files;
  kind.first = std::atol(number + 1);
  kind.all = text[std::strlen(text) - 1] == '+';
}

void write_counts() {
  is_on = false;
  const char* file = std::getenv("FAIL_COUNT");
  if (!file) return;
  char text[64];
  const int length = std::snprintf(text, sizeof text, "%ld %ld\n", memory.calls.load(), files.calls.load());
  const int descriptor = open(file, O_WRONLY | O_CREAT | O_TRUNC, 0666);
  if (descriptor < 0) return;
  (void)!write(descriptor, text, static_cast<std::size_t>(length));
  close(descriptor);
}

int (*program)(int, char**, char**);
int counted_program(int argc, char** argv, char** environment) {
  read_settings();
  std::atexit(write_counts);
  is_on = true;
  return program(argc, argv, environment);
}

}  // namespace

extern "C" {

// NOLINTNEXTLINE(bugprone-reserved-identifier,readability-identifier-naming)
int __libc_start_main(int (*main)(int, char**, char**), int argc, char** argv, void (*init)(), void (*fini)(),
                      void (*loader_fini)(), void* stack_end) {
  program = main;
  return real<decltype(__libc_start_main)>("__libc_start_main")(counted_program, argc, argv, init, fini, loader_fini,
                                                                stack_end);
}

void* malloc(std::size_t size) { return memory_fails() ? nullptr : __libc_malloc(size); }
void* calloc(std::size_t count, std::size_t size) { return memory_fails() ? nullptr : __libc_calloc(count, size); }
void* realloc(void* old, std::size_t size) { return memory_fails() ? nullptr : __libc_realloc(old, size); }
void* memalign(std::size_t alignment, std::size_t size) {
  return memory_fails() ? nullptr : __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) { return memalign(alignment, size); }
int posix_memalign(void** result, std::size_t alignment, std::size_t size) {
  void* const memory_or_none = memalign(alignment, size);
  if (!memory_or_none) return ENOMEM;
  *result = memory_or_none;
  return 0;
}

int open(const char* path, int flags, ...) {
  va_list more;
  va_start(more, flags);
  const mode_t mode = flags & O_CREAT ? va_arg(more, mode_t) : 0;
  va_end(more);
  return files_fail(kNotOpenYet) ? -1 : real<int(const char*, int, ...)>("open")(path, flags, mode);
}
int open64(const char* path, int flags, ...) {
  va_list more;
  va_start(more, flags);
  const mode_t mode = flags & O_CREAT ? va_arg(more, mode_t) : 0;
  va_end(more);
  return files_fail(kNotOpenYet) ? -1 : real<int(const char*, int, ...)>("open64")(path, flags, mode);
}
std::FILE* fopen(const char* path, const char* mode) {
  return files_fail(kNotOpenYet) ? nullptr : real<std::FILE*(const char*, const char*)>("fopen")(path, mode);
}
std::FILE* fopen64(const char* path, const char* mode) {
  return files_fail(kNotOpenYet) ? nullptr : real<std::FILE*(const char*, const char*)>("fopen64")(path, mode);
}
int mkstemp(char* name) { return files_fail(kNotOpenYet) ? -1 : real<int(char*)>("mkstemp")(name); }
int mkstemp64(char* name) { return files_fail(kNotOpenYet) ? -1 : real<int(char*)>("mkstemp64")(name); }
ssize_t read(int descriptor, void* to, std::size_t size) {
  return files_fail(descriptor) ? -1 : real<ssize_t(int, void*, std::size_t)>("read")(descriptor, to, size);
}
ssize_t write(int descriptor, const void* from, std::size_t size) {
  return files_fail(descriptor) ? -1 : real<ssize_t(int, const void*, std::size_t)>("write")(descriptor, from, size);
}
ssize_t writev(int descriptor, const iovec* parts, int count) {
  return files_fail(descriptor) ? -1 : real<ssize_t(int, const iovec*, int)>("writev")(descriptor, parts, count);
}
int fsync(int descriptor) { return files_fail(descriptor) ? -1 : real<int(int)>("fsync")(descriptor); }
int close(int descriptor) {
  const bool fails = files_fail(descriptor);
  const int result = real<int(int)>("close")(descriptor);  // a descriptor is free after an error, too
  if (fails) errno = EIO;
  return fails ? -1 : result;
}
int rename(const char* from, const char* to) {
  return files_fail(kNotOpenYet) ? -1 : real<int(const char*, const char*)>("rename")(from, to);
}

}  // extern "C"
