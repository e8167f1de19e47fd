# SPDX-License-Identifier: GPL-3.0-or-later
# Flags of our own targets (target subvol_defaults), the build type, ccache, and where programs are put.

if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Debug, Release, RelWithDebInfo or MinSizeRel" FORCE)
endif()

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}")
if(NOT DEFINED BUILD_SHARED_LIBS)
  set(BUILD_SHARED_LIBS OFF)
endif()

if(SUBVOL_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  find_program(SUBVOL_CCACHE_PROGRAM ccache)
  if(SUBVOL_CCACHE_PROGRAM)
    set(CMAKE_CXX_COMPILER_LAUNCHER "${SUBVOL_CCACHE_PROGRAM}")
  endif()
endif()

add_library(subvol_defaults INTERFACE)
target_compile_options(subvol_defaults INTERFACE -Wall -Wextra -Wpedantic -Wshadow)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  # GCC 12 sees std::sort of a few elements run past the end of a small array, and its own AVX-512 headers read what
  # they have not set, and a string put before another overlap it.
  target_compile_options(subvol_defaults INTERFACE -Wno-array-bounds -Wno-maybe-uninitialized -Wno-restrict)
endif()
if(SUBVOL_NATIVE)
  target_compile_options(subvol_defaults INTERFACE -march=native)
endif()
