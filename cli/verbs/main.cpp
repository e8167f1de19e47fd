// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/exit_status.h"
#include "cli/runs/interrupt.h"
#include "cli/runs/standard_output.h"
#include "cli/verbs/command_line.h"
#include "subvol/base/atomic_file.h"
#include "subvol/base/error.h"

#include <array>
#include <atomic>
#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <iostream>
#include <new>

#ifdef __GLIBC__
#include <malloc.h>
#endif
#ifdef __linux__
#include <sys/auxv.h>
#endif
#include <unistd.h>

namespace subvol::cli {
namespace {

int complain(const char* what, int status) {
  std::cerr << "subvol: " << what << '\n';
  return status;
}

/// True if an allocation has failed.
std::atomic<bool> has_run_out{false};

[[noreturn]] void run_out() {
  has_run_out = true;
  throw std::bad_alloc();
}

/// Ends the program in order if an exception leaves a parallel loop, so that nothing is left half-written. In the
/// program's first thread the language does not say which exception it was.
[[noreturn]] void end_in_order() {
  const char* what = has_run_out ? kOutOfMemory : "an error in a parallel loop";
  try {
    if (const std::exception_ptr error = std::current_exception()) std::rethrow_exception(error);
  } catch (const std::bad_alloc&) {  // thrown by Eigen, which allocates in another way
    what = kOutOfMemory;
  } catch (...) {
  }
  // Nothing is allocated any more and nothing is unwound: other threads are still running.
  delete_temporaries();
  (void)!write(STDERR_FILENO, "subvol: ", 8);
  (void)!write(STDERR_FILENO, what, std::strlen(what));
  (void)!write(STDERR_FILENO, "\n", 1);
  std::_Exit(kFailed);
}

/// Keeps freed memory in the process: a step allocates the arrays of the previous one again, and the system would have
/// to clear their pages each time (a tenth of the time of `optimize`).
void keep_freed_memory() {
#ifdef __GLIBC__
  constexpr int kMegabyte = 1 << 20;
  mallopt(M_MMAP_THRESHOLD, 32 * kMegabyte);
  mallopt(M_TRIM_THRESHOLD, 128 * kMegabyte);
#endif
}

/// Blocks (SIG_BLOCK) or delivers (SIG_UNBLOCK) the signals that end a run in order. A program that is started again
/// inherits which ones are blocked.
void hold_signals(int how) {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  sigprocmask(how, &signals, nullptr);
}

/// Starts the program again with settings that runtime libraries read when they are loaded, unless the user has set
/// them.
///
/// * A thread of OpenMP that waits for others spins first. By default it does so for milliseconds; if another program
///   keeps a processor busy, this one then takes ten and more times as long. Spinning 1,000 times, a few microseconds,
///   is as fast on an idle machine.
/// * The C library asks the system for huge pages. Where the system gives them only to programs that ask, fits take a
///   sixth to a quarter less time with them.
void restart_with_settings(char** argv) {
#ifdef __linux__
  bool is_new = false;
  const auto set = [&is_new](const char* name, const char* value) {
    if (!std::getenv(name) && setenv(name, value, 1) == 0) is_new = true;
  };
  if (!std::getenv("OMP_WAIT_POLICY")) set("GOMP_SPINCOUNT", "1000");
  set("GLIBC_TUNABLES", "glibc.malloc.hugetlb=1");
  // Without an interpreter, the program was started as an argument of the loader, which /proc/self/exe names then.
  if (!is_new || getauxval(AT_BASE) == 0) return;
  std::array<char, 4096> program{};  // longer paths are not followed
  const ssize_t length = readlink("/proc/self/exe", program.data(), program.size());
  if (length <= 0 || static_cast<std::size_t>(length) == program.size()) return;
  hold_signals(SIG_BLOCK);      // until they can be answered
  execv(program.data(), argv);  // returns if the system refuses; then all goes on as it is
#endif
}

/// Returns the result of the command line, or the status of the error that it ends with.
int run_to_status(int argc, char** argv) {
  try {
    return run_command_line(argc, argv);
  } catch (const UsageError& error) {
    return complain(error.what(), kUsage);
  } catch (const EndedEarly& error) {
    return complain(error.what(), error.status);
  } catch (const InputError& error) {
    return complain(error.what(), kRejected);
  } catch (const std::bad_alloc&) {
    return complain(kOutOfMemory, kFailed);
  } catch (const std::exception& error) {
    return complain(error.what(), kFailed);
  }
}

}  // namespace
}  // namespace subvol::cli

int main(int argc, char** argv) {
  using namespace subvol::cli;
  restart_with_settings(argv);
  keep_freed_memory();
  std::set_new_handler(run_out);
  std::set_terminate(end_in_order);
  std::signal(SIGXFSZ, SIG_IGN);  // reaching the limit on file sizes becomes a write error, like a full disk
  subvol::cli::end_on_interrupt();
  hold_signals(SIG_UNBLOCK);
  prepare_standard_output();
  return finished_standard_output(run_to_status(argc, argv));
}
