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
    # Paths count relative to the build folder, so that all checkouts share what one of them has compiled.
    set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env "CCACHE_BASEDIR=${PROJECT_SOURCE_DIR}" CCACHE_NOHASHDIR=1
      "${SUBVOL_CCACHE_PROGRAM}")
  endif()
endif()

add_library(subvol_defaults INTERFACE)
# Headers that are no part of the library are named from the root of the project.
target_include_directories(subvol_defaults INTERFACE "${PROJECT_SOURCE_DIR}")
# Options are set by designated initializers; what is left out has its default.
target_compile_options(subvol_defaults INTERFACE -Wall -Wextra -Wpedantic -Wno-missing-field-initializers)
if(NOT SUBVOL_UNITY)  # in a unit of several files, names of one hide those of another
  target_compile_options(subvol_defaults INTERFACE -Wshadow)
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  # GCC 12 sees std::sort of a few elements run past the end of a small array, and its own AVX-512 headers read what
  # they have not set, and a string put before another overlap it.
  target_compile_options(subvol_defaults INTERFACE -Wno-array-bounds -Wno-maybe-uninitialized
    -Wno-uninitialized -Wno-restrict)
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # How wide vectors are passed depends on the processor; none of ours leaves the library.
  target_compile_options(subvol_defaults INTERFACE -Wno-psabi)
endif()
# No code of ours reads errno after a square root or traps on floating-point exceptions; with either, loops over lanes
# do not vectorise. Neither changes a value.
target_compile_options(subvol_defaults INTERFACE -fno-math-errno -fno-trapping-math)
if(SUBVOL_NATIVE)
  target_compile_options(subvol_defaults INTERFACE -march=native)
endif()

# Code that can be put into a shared library: ours, or the Python module. GCC is told that no other library replaces its
# functions, so that it may inline them as ever: it is as fast as without, and gives the same bits.
function(make_relocatable target)
  set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-fno-semantic-interposition>)
endfunction()
