// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdlib>  // tells the C library

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace subvol {

/// Arrays of one step are asked for again in the next: they are not handed back to the system each time, which would
/// have to clear their pages anew (a tenth of the time of `optimize`). Of programs, not of the library; benches
/// measure with it too.
inline void keep_freed_memory() {
#ifdef __GLIBC__
  constexpr int kMegabyte = 1 << 20;
  mallopt(M_MMAP_THRESHOLD, 32 * kMegabyte);
  mallopt(M_TRIM_THRESHOLD, 128 * kMegabyte);
#endif
}

}  // namespace subvol
