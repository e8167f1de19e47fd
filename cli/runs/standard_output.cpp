// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/standard_output.h"

#include "cli/runs/exit_status.h"

#include <cerrno>
#include <csignal>
#include <cstring>
#include <iostream>

#include <fcntl.h>
#include <unistd.h>

namespace subvol::cli {
namespace {

int first_error = 0;

void flush() {
  errno = 0;
  std::cout.flush();
  if (!std::cout && first_error == 0) first_error = errno != 0 ? errno : EIO;
}

}  // namespace

void prepare_standard_output() {
  std::signal(SIGPIPE, SIG_IGN);
  // Opened with the opposite access, so that writing to a closed stdout still fails.
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (fcntl(descriptor, F_GETFD) < 0) (void)!open("/dev/null", descriptor == STDIN_FILENO ? O_WRONLY : O_RDONLY);
}

void print(std::string_view text) {
  errno = 0;
  std::cout << text;
  if (!std::cout && first_error == 0) first_error = errno;
  flush();
}

int finished_standard_output(int status) {
  flush();
  if (first_error == 0) return status;
  std::cerr << "subvol: standard output: cannot write: " << std::strerror(first_error) << '\n';
  return status == kDone ? kFailed : status;
}

}  // namespace subvol::cli
