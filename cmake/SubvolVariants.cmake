# SPDX-License-Identifier: GPL-3.0-or-later
# The shared library once more for newer processors. Each variant lies in glibc-hwcaps/<level> beside the library, where
# glibc's loader takes the best one that the processor can run: programs that are linked with the library need not care.

set(SUBVOL_VARIANTS "" CACHE STRING
  "Levels of x86-64 for which the shared library is built as well, for example x86-64-v3;x86-64-v4")

# Makes the variants of a shared library whose sources, definitions and libraries are all known.
function(add_variants library)
  foreach(level ${SUBVOL_VARIANTS})
    set(variant "${library}_${level}")
    get_target_property(sources ${library} SOURCES)
    add_library(${variant} SHARED ${sources})
    make_relocatable(${variant})
    foreach(property LINK_LIBRARIES INCLUDE_DIRECTORIES COMPILE_DEFINITIONS COMPILE_FEATURES COMPILE_OPTIONS
        VERSION SOVERSION UNITY_BUILD UNITY_BUILD_MODE)
      get_target_property(value ${library} ${property})
      if(value)
        set_target_properties(${variant} PROPERTIES ${property} "${value}")
      endif()
    endforeach()
    target_compile_options(${variant} PRIVATE "-march=${level}")
    set_target_properties(${variant} PROPERTIES OUTPUT_NAME ${library}
      LIBRARY_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/glibc-hwcaps/${level}")
    install(TARGETS ${variant} LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}/glibc-hwcaps/${level}" NAMELINK_SKIP)
  endforeach()
endfunction()

if(SUBVOL_VARIANTS AND NOT BUILD_SHARED_LIBS)
  message(FATAL_ERROR "SUBVOL_VARIANTS needs BUILD_SHARED_LIBS=ON: the loader chooses among shared libraries")
endif()
if(SUBVOL_VARIANTS AND SUBVOL_NATIVE)
  message(FATAL_ERROR "SUBVOL_VARIANTS needs SUBVOL_NATIVE=OFF: the library itself must run on every processor")
endif()
