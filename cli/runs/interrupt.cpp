// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/interrupt.h"

#include "cli/runs/exit_status.h"
#include "subvol/base/atomic_file.h"

#include <atomic>
#include <csignal>

#include <time.h>
#include <unistd.h>

namespace subvol::cli {
namespace {

constexpr long long kOneSignalNanoseconds = 200'000'000;

/// Time of the first signal; 0: none yet.
std::atomic<long long> first{0};
/// True: a signal ends the program at once.
std::atomic<bool> ends_at_once{true};
static_assert(std::atomic<long long>::is_always_lock_free && std::atomic<bool>::is_always_lock_free);

// Calls only functions that are allowed in a signal handler.
void note(int) {
  if (ends_at_once) {
    constexpr char kInterruptedMessage[] = "subvol: interrupted\n";
    (void)!write(STDERR_FILENO, kInterruptedMessage, sizeof kInterruptedMessage - 1);
    delete_temporaries();
    _exit(kInterrupted);
  }
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  const long long now = time.tv_sec * 1'000'000'000LL + time.tv_nsec + 1;
  long long before = 0;
  const bool is_first = first.compare_exchange_strong(before, now);
  // A thread that waits for the reader of a pipe does not check the flag.
  if (!waits_for_reader() && (is_first || now - before <= kOneSignalNanoseconds)) return;
  delete_temporaries();
  _exit(kInterrupted);
}

void handle_signals() {
  struct sigaction action {};
  action.sa_handler = note;
  action.sa_flags = SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

}  // namespace

void end_on_interrupt() {
  ends_at_once = true;
  handle_signals();
}

void catch_interrupt() {
  ends_at_once = false;
  handle_signals();
}

bool interrupted() { return first != 0; }

}  // namespace subvol::cli
