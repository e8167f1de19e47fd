// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <sys/types.h>

namespace subvol::cli {

/// A program to run in a process of its own.
struct ChildCommand {
  std::filesystem::path program;         ///< a file, not to be looked up
  std::vector<std::string> words;        ///< its arguments, without its name
  std::filesystem::path folder;          ///< the current folder of the process
  std::string messages;                  ///< file in that folder for its standard output and error
  std::vector<std::string> environment;  ///< NAME=VALUE, on top of the environment of this process
  std::size_t memory_limit = 0;          ///< bytes of data that each of its processes may have; 0: no limit
};

/// How a process ended, and what it took together with the processes that it waited for.
struct ChildEnd {
  int exit_code = -1;  ///< -1: ended by a signal
  int signal = 0;      ///< 0: none
  double wall_seconds = 0, cpu_seconds = 0;
  std::size_t peak_memory_bytes = 0;  ///< of the largest process
};

/// A process that is the leader of a process group. The system kills it if this process dies.
class ChildProcess {
 public:
  using Clock = std::chrono::steady_clock;

  /// Starts a program. IoError: the system refuses, with the reason.
  explicit ChildProcess(const ChildCommand& command);
  /// Kills the process and its group if it has not ended.
  ~ChildProcess();
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&& other) noexcept;
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// Returns how the process ended; nothing if it is running. What is left of its group is then killed.
  std::optional<ChildEnd> poll();
  /// Sends a signal to the process and its group.
  void signal(int number) const;
  Clock::time_point start() const { return start_; }

 private:
  std::optional<ChildEnd> collect(bool wait);

  pid_t pid_ = 0;  ///< 0: it has been waited for
  Clock::time_point start_{};
};

/// Lets `wait_for_child` see ends of processes: blocks SIGCHLD in this thread, to be called before the first start.
void watch_children();
/// Sleeps until a process ends, a signal is caught, or the time is over.
void wait_for_child(std::chrono::milliseconds most);

/// Returns the file that a program's name stands for: the name itself if it contains a '/', or else the first
/// executable file of this name in the folders of PATH. UsageError: there is none.
std::filesystem::path find_program(const std::string& name);

/// Path of the program that this process runs.
std::filesystem::path this_program();

}  // namespace subvol::cli
