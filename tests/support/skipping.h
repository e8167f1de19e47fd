// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string_view>

namespace subvol::test {

/// Exit status of tests, and of scripts that they run, in which nothing failed but something could not be run here. The
/// same as in tests/CMakeLists.txt, the scripts, and Automake.
inline constexpr int kSkippedStatus = 77;

/// Whether a warning says that a test, or part of it, was left out.
inline bool says_skipped(std::string_view warning) { return warning.starts_with("SKIPPED: "); }

/// result  of Catch's session: how many assertions failed (at most 255), or of tests that it listed.
inline int status_of_tests(int result, bool any_skipped) {
  if (result != 0) return result == kSkippedStatus ? 1 : result;
  return any_skipped ? kSkippedStatus : 0;
}

}  // namespace subvol::test
