# SPDX-License-Identifier: GPL-3.0-or-later
# Compiles the sources of a folder as one: most of a file's compilation is its headers. Names in unnamed namespaces are
# unique within a folder for this reason.

option(SUBVOL_UNITY "Compile the files of each folder as one: a whole build takes half the time, a change more" OFF)

# Makes one unit of each folder of a target whose sources are all known.
function(compile_folders_as_one)
  if(NOT SUBVOL_UNITY)
    return()
  endif()
  foreach(target ${ARGV})
    get_target_property(sources ${target} SOURCES)
    foreach(source ${sources})
      if(source MATCHES "\\.cpp$")
        cmake_path(ABSOLUTE_PATH source BASE_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}")
        cmake_path(IS_PREFIX PROJECT_BINARY_DIR "${source}" is_made)
        if(is_made)  # only the rule of a single file makes sure that it exists
          set_source_files_properties("${source}" PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
          continue()
        endif()
        cmake_path(GET source PARENT_PATH folder)
        cmake_path(RELATIVE_PATH folder BASE_DIRECTORY "${PROJECT_SOURCE_DIR}")
        string(REPLACE "/" "_" group "${folder}")
        set_source_files_properties("${source}" PROPERTIES UNITY_GROUP "${group}")
      endif()
    endforeach()
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage -Wno-stringop-overflow>)
  endforeach()
endfunction()
