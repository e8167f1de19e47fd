// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/batch/child_process.h"

#include "cli/runs/exit_status.h"
#include "subvol/base/error.h"

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <string_view>
#include <utility>

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace subvol::cli {
namespace {

namespace fs = std::filesystem;

/// The environment of this process with some variables replaced.
class Environment {
 public:
  explicit Environment(const std::vector<std::string>& replaced) {
    const auto is_replaced = [&](std::string_view entry) {
      for (const std::string& other : replaced)
        if (entry.starts_with(std::string_view(other).substr(0, other.find('=') + 1))) return true;
      return false;
    };
    for (char** entry = environ; *entry != nullptr; ++entry)
      if (!is_replaced(*entry)) entries_.push_back(*entry);
    for (const std::string& entry : replaced) entries_.push_back(const_cast<char*>(entry.c_str()));
    entries_.push_back(nullptr);
  }
  char* const* data() const { return entries_.data(); }

 private:
  std::vector<char*> entries_;
};

/// The data that the new process needs until it runs its program. The old process prepares them: the two share their
/// memory, so the new one must not allocate.
struct Launch {
  const char *program, *folder, *messages;
  char* const* words;
  char* const* environment;
  std::size_t memory_limit;
  sigset_t signals;  ///< mask to run the program with
  pid_t parent;
  volatile int error = 0;
};

void reset_signals(const Launch& launch) {
  struct sigaction plain {};
  plain.sa_handler = SIG_DFL;
  for (const int number : {SIGINT, SIGTERM, SIGXFSZ, SIGPIPE}) sigaction(number, &plain, nullptr);
  sigprocmask(SIG_SETMASK, &launch.signals, nullptr);
}

/// Runs in the new process; returns only if the system refuses something.
void become(Launch& launch) {
  // The death of the parent may come before the request to be told of it.
  if (setpgid(0, 0) != 0 || prctl(PR_SET_PDEATHSIG, SIGKILL) != 0 || getppid() != launch.parent) return;
  if (chdir(launch.folder) != 0) return;
  const int nothing = open("/dev/null", O_RDONLY);
  const int messages = open(launch.messages, O_WRONLY | O_CREAT | O_TRUNC | O_APPEND, 0666);
  if (nothing < 0 || messages < 0) return;
  if (dup2(nothing, STDIN_FILENO) < 0 || dup2(messages, STDOUT_FILENO) < 0 || dup2(messages, STDERR_FILENO) < 0) return;
  for (const int file : {nothing, messages})
    if (file > STDERR_FILENO) close(file);
  if (launch.memory_limit > 0) {
    rlimit limit{};
    getrlimit(RLIMIT_DATA, &limit);
    limit.rlim_cur = limit.rlim_max = std::min<rlim_t>(launch.memory_limit, limit.rlim_max);
    if (setrlimit(RLIMIT_DATA, &limit) != 0) return;
  }
  reset_signals(launch);
  execve(launch.program, launch.words, launch.environment);
}

double seconds_of(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

}  // namespace

ChildProcess::ChildProcess(const ChildCommand& command) {
  const std::string program = command.program.string();
  std::vector<char*> words{const_cast<char*>(program.c_str())};
  for (const std::string& word : command.words) words.push_back(const_cast<char*>(word.c_str()));
  words.push_back(nullptr);
  const Environment environment(command.environment);
  Launch launch{.program = program.c_str(),
                .folder = command.folder.c_str(),
                .messages = command.messages.c_str(),
                .words = words.data(),
                .environment = environment.data(),
                .memory_limit = command.memory_limit,
                .signals = {},
                .parent = getpid()};
  // No handler of this process may run in the new one, which shares its memory.
  sigset_t all, before;
  sigfillset(&all);
  sigprocmask(SIG_SETMASK, &all, &before);
  launch.signals = before;
  sigdelset(&launch.signals, SIGCHLD);
  start_ = Clock::now();
  // Unlike fork, this takes the same short time whatever the size of this process is: a batch may have a million rows.
  pid_ = vfork();
  if (pid_ == 0) {
    become(launch);
    launch.error = errno;
    _exit(127);
  }
  const int error = pid_ < 0 ? errno : int{launch.error};
  sigprocmask(SIG_SETMASK, &before, nullptr);
  if (pid_ > 0 && error == 0) return;
  if (pid_ > 0) waitpid(pid_, nullptr, 0);
  pid_ = 0;
  throw IoError(program + ": cannot be started: " + std::strerror(error));
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept : pid_(std::exchange(other.pid_, 0)), start_(other.start_) {}

ChildProcess& ChildProcess::operator=(ChildProcess&& other) noexcept {
  std::swap(pid_, other.pid_);
  std::swap(start_, other.start_);
  return *this;
}

ChildProcess::~ChildProcess() {
  if (pid_ == 0) return;
  signal(SIGKILL);
  collect(true);
}

void ChildProcess::signal(int number) const {
  if (pid_ > 0) kill(-pid_, number);
}

std::optional<ChildEnd> ChildProcess::poll() { return collect(false); }

std::optional<ChildEnd> ChildProcess::collect(bool wait) {
  siginfo_t info{};
  while (waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOWAIT | (wait ? 0 : WNOHANG)) != 0)
    if (errno != EINTR) return {};
  if (info.si_pid == 0) return {};
  // As long as its leader has not been waited for, the number of the group belongs to nobody else.
  signal(SIGKILL);
  int status = 0;
  rusage usage{};
  while (wait4(pid_, &status, 0, &usage) < 0 && errno == EINTR) {
  }
  pid_ = 0;
  ChildEnd end;
  if (WIFEXITED(status))
    end.exit_code = WEXITSTATUS(status);
  else
    end.signal = WTERMSIG(status);
  end.wall_seconds = std::chrono::duration<double>(Clock::now() - start_).count();
  end.cpu_seconds = seconds_of(usage.ru_utime) + seconds_of(usage.ru_stime);
  end.peak_memory_bytes = static_cast<std::size_t>(usage.ru_maxrss) * 1024;
  return end;
}

void watch_children() {
  sigset_t ends;
  sigemptyset(&ends);
  sigaddset(&ends, SIGCHLD);
  sigprocmask(SIG_BLOCK, &ends, nullptr);
}

void wait_for_child(std::chrono::milliseconds most) {
  sigset_t ends;
  sigemptyset(&ends);
  sigaddset(&ends, SIGCHLD);
  const timespec time{most.count() / 1000, most.count() % 1000 * 1'000'000};
  (void)sigtimedwait(&ends, nullptr, &time);
}

fs::path find_program(const std::string& name) {
  const auto is_program = [](const fs::path& path) {
    std::error_code ignored;
    return fs::is_regular_file(path, ignored) && access(path.c_str(), X_OK) == 0;
  };
  if (name.find('/') != std::string::npos) {
    if (is_program(name)) return fs::absolute(name);
  } else if (const char* folders = std::getenv("PATH")) {
    std::istringstream stream(folders);
    for (std::string folder; std::getline(stream, folder, ':');)
      if (is_program(fs::path(folder) / name)) return fs::absolute(fs::path(folder) / name);
  }
  throw UsageError("--program " + name + ": there is no such executable file");
}

fs::path this_program() { return fs::read_symlink("/proc/self/exe"); }

}  // namespace subvol::cli
