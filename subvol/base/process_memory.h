// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

namespace subvol::internal {

/// Return the bytes of memory that this process holds now, and the most that it has held; 0 if the system does not
/// report them.
std::size_t held_memory_bytes();
std::size_t peak_memory_bytes();

}  // namespace subvol::internal
