// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <stdexcept>
#include <string>

namespace subvol::cli {

/// Meaning of the program's exit status; scripts rely on it.
enum ExitStatus : int {
  kDone = 0,
  kFailed = 1,         ///< something could not be done, or the mesh is not valid
  kUsage = 2,          ///< the command line makes no sense
  kRejected = 3,       ///< an input cannot be used
  kNotConverged = 4,   ///< the best result so far has been written, if there was any
  kInterrupted = 130,  ///< by Ctrl-C; the best result so far has been written, if there was any
};

/// What the program says last, with status kFailed, if an allocation fails.
inline constexpr const char* kOutOfMemory = "out of memory";

/// Thrown if the command line makes no sense in a way that the parser cannot see. Exit status kUsage.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Thrown if the work was ended, by Ctrl-C or a limit, before there was anything to write.
class EndedEarly : public std::runtime_error {
 public:
  EndedEarly(const std::string& what, ExitStatus its_status) : std::runtime_error(what), status(its_status) {}
  ExitStatus status;
};

}  // namespace subvol::cli
