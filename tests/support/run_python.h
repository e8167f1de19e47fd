// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "tests/support/data.h"
#include "tests/support/skipping.h"
#include "tests/support/temporary_folder.h"

#include <catch2/catch.hpp>

#include <cstdlib>
#include <filesystem>
#include <string>

#include <sys/wait.h>

namespace subvol::test {

/// Runs tests/SCRIPT MESH QUERIES under the first Python that has what it needs. Returns the exit status;
/// kSkippedStatus if none has.
inline int run_python(const std::string& script, const std::filesystem::path& mesh,
                      const std::filesystem::path& queries) {
  constexpr int kNoSuchProgram = 127;  // as shells say
  for (const std::string python : {"python3", "/usr/bin/python3"}) {
    const int status = std::system((python + " \"" + source_dir() + "/tests/" + script + "\" \"" + mesh.string() +
                                    "\" \"" + queries.string() + "\" > \"" + queries.string() + ".out\" 2>&1")
                                       .c_str());
    const int exit_status = WIFEXITED(status) ? WEXITSTATUS(status) : 1;
    if (exit_status == 0) return 0;
    if (exit_status == kSkippedStatus || exit_status == kNoSuchProgram) continue;
    UNSCOPED_INFO(content_of(queries.string() + ".out"));
    return exit_status;
  }
  return kSkippedStatus;
}

}  // namespace subvol::test
