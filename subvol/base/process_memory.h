// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

namespace subvol {

/// Bytes of memory that this process holds now, and the most it has held. 0 where the system does not tell.
std::size_t held_memory_bytes();
std::size_t peak_memory_bytes();

}  // namespace subvol
