// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <stdexcept>
#include <string>

namespace subvol {

/// The caller gave something wrong: an argument out of range, a file that cannot be used.
///
/// The message names the argument, or the file and line (or byte), and what was expected. Command line: exit status 3.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The outside world refused: a file that cannot be written, a full disk. Command line: exit status 1.
class IoError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace subvol
