// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/process_memory.h"

#include <fstream>

#include <sys/resource.h>
#include <unistd.h>

namespace subvol::internal {

std::size_t held_memory_bytes() {
  std::ifstream file("/proc/self/statm");
  std::size_t all = 0, resident = 0;
  if (!(file >> all >> resident)) return 0;
  return resident * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

std::size_t peak_memory_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::size_t>(usage.ru_maxrss) * 1024;  // Linux counts in KiB
}

}  // namespace subvol::internal
