// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/atomic_file.h"

#include "subvol/base/error.h"
#include "tests/support/temporary_folder.h"

#include <catch2/catch.hpp>

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <thread>
#include <vector>

using namespace subvol;
using namespace subvol::test;
namespace fs = std::filesystem;

namespace {

std::size_t num_files(const TemporaryFolder& folder) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder.path()), {}));
}

}  // namespace

TEST_CASE("a file written atomically holds exactly the bytes and leaves nothing beside it") {
  const TemporaryFolder folder;
  const std::string bytes("a\0b\r\n\xff", 6);
  write_file_atomically(folder / "f", bytes);
  CHECK(content_of(folder / "f") == bytes);
  write_file_atomically(folder / "f", "");
  CHECK(content_of(folder / "f").empty());
  CHECK(num_files(folder) == 1);
}

TEST_CASE("a process that ends within a write can delete what it was writing") {
  const TemporaryFolder folder;
  folder.file("f", "old");
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    std::signal(SIGUSR1, [](int) {
      delete_temporaries();
      _exit(7);
    });
    const std::string bytes(1 << 26, 'x');
    for (;;) write_file_atomically(folder / "g", bytes);
  }
  const auto is_writing = [&] {
    return std::any_of(fs::directory_iterator(folder.path()), {},
                       [](const fs::directory_entry& entry) { return entry.path().extension() == ".tmp"; });
  };
  while (!is_writing()) std::this_thread::yield();
  kill(child, SIGUSR1);
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  CHECK(WEXITSTATUS(status) == 7);
  CHECK(!is_writing());
  CHECK(content_of(folder / "f") == "old");
}

TEST_CASE("replacing a file keeps its permissions, and a symbolic link stays one") {
  const TemporaryFolder folder;
  folder.file("f", "old");
  fs::permissions(folder / "f", fs::perms::owner_read | fs::perms::owner_write);
  fs::create_symlink("f", folder / "link");
  write_file_atomically(folder / "link", "new");
  CHECK(fs::is_symlink(folder / "link"));
  CHECK(content_of(folder / "f") == "new");
  CHECK(fs::status(folder / "f").permissions() == (fs::perms::owner_read | fs::perms::owner_write));
}

TEST_CASE("a symbolic link that leads nowhere yet is followed, one that leads to itself is an IoError") {
  const TemporaryFolder folder;
  fs::create_directory(folder / "sub");
  fs::create_symlink("sub/second", folder / "first");
  fs::create_symlink("f", folder / "sub/second");
  write_file_atomically(folder / "first", "new");
  CHECK(fs::is_symlink(folder / "first"));
  CHECK(fs::is_symlink(folder / "sub/second"));
  CHECK(content_of(folder / "sub/f") == "new");
  fs::create_symlink("circle", folder / "circle");
  CHECK_THROWS_AS(write_file_atomically(folder / "circle", "x"), IoError);
}

TEST_CASE("a new file has the permissions the umask grants, not those of a private temporary") {
  const TemporaryFolder folder;
  write_file_atomically(folder / "f", "x");
  folder.file("plain", "x");
  CHECK(fs::status(folder / "f").permissions() == fs::status(folder / "plain").permissions());
}

TEST_CASE("what cannot be written is an IoError that names the path and leaves no temporary") {
  const TemporaryFolder folder;
  CHECK_THROWS_AS(write_file_atomically(folder / "missing/f", "x"), IoError);
  CHECK_THROWS_AS(write_file_atomically(folder.path(), "x"), IoError);
  CHECK_THROWS_WITH(write_file_atomically(folder / "missing/f", "x"), Catch::Contains("missing/f"));
  CHECK_THROWS_AS(write_file_atomically("", "x"), IoError);
  CHECK(num_files(folder) == 0);
}

TEST_CASE("a full device is an IoError and a device can be written to") {
  if (!fs::exists("/dev/full")) {
    WARN("SKIPPED: no /dev/full here");
    return;
  }
  CHECK_THROWS_AS(write_file_atomically("/dev/full", "x"), IoError);
  CHECK_NOTHROW(write_file_atomically("/dev/null", "x"));
  CHECK(fs::is_character_file("/dev/null"));
}

TEST_CASE("writers at the same time leave one whole file") {
  const TemporaryFolder folder;
  std::vector<std::thread> threads;
  for (char c = 'a'; c < 'i'; ++c)
    threads.emplace_back([&, c] { write_file_atomically(folder / "f", std::string(100000, c)); });
  for (std::thread& thread : threads) thread.join();
  const std::string content = content_of(folder / "f");
  CHECK(content == std::string(100000, content.front()));
  CHECK(num_files(folder) == 1);
}
