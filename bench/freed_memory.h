// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdlib>  // tells the C library

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace subvol {

/// Keeps freed memory, as the program does: else times are partly those of fresh pages.
inline void keep_freed_memory() {
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, 1 << 25);
  mallopt(M_TRIM_THRESHOLD, 1 << 27);
#endif
}

}  // namespace subvol
