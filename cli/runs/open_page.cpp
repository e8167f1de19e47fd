// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/open_page.h"

#include "subvol/base/error.h"

#include <spawn.h>
#include <cerrno>
#include <cstring>
#include <string>

extern char** environ;

namespace subvol::cli {

void open_in_browser(const std::filesystem::path& page) {
#ifdef __APPLE__
  std::string program = "open";
#else
  std::string program = "xdg-open";
#endif
  std::string path = std::filesystem::absolute(page).string();
  char* arguments[] = {program.data(), path.data(), nullptr};
  pid_t child = 0;
  const int status = posix_spawnp(&child, program.c_str(), nullptr, nullptr, arguments, environ);
  if (status != 0)
    throw IoError(page.string() + " was written, but " + program +
                  " cannot be started to open it: " + std::strerror(status));
}

}  // namespace subvol::cli
