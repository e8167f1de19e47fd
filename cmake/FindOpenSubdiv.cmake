# Finds OpenSubdiv's CPU library (Debian's own package config names a static library that is not shipped).
# Defines OpenSubdiv::OpenSubdiv, OpenSubdiv_FOUND and OpenSubdiv_VERSION.
find_path(OpenSubdiv_INCLUDE_DIR opensubdiv/version.h)
find_library(OpenSubdiv_LIBRARY osdCPU)
if(OpenSubdiv_INCLUDE_DIR)
  file(STRINGS "${OpenSubdiv_INCLUDE_DIR}/opensubdiv/version.h" _line REGEX "define OPENSUBDIV_VERSION_NUMBER ")
  string(REGEX MATCH "[0-9]+" _number "${_line}")
  if(_number)
    math(EXPR _major "${_number} / 10000")
    math(EXPR _minor "${_number} / 100 % 100")
    math(EXPR _patch "${_number} % 100")
    set(OpenSubdiv_VERSION "${_major}.${_minor}.${_patch}")
  endif()
endif()
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(OpenSubdiv REQUIRED_VARS OpenSubdiv_LIBRARY OpenSubdiv_INCLUDE_DIR
  VERSION_VAR OpenSubdiv_VERSION)
if(OpenSubdiv_FOUND AND NOT TARGET OpenSubdiv::OpenSubdiv)
  add_library(OpenSubdiv::OpenSubdiv UNKNOWN IMPORTED)
  set_target_properties(OpenSubdiv::OpenSubdiv PROPERTIES
    IMPORTED_LOCATION "${OpenSubdiv_LIBRARY}" INTERFACE_INCLUDE_DIRECTORIES "${OpenSubdiv_INCLUDE_DIR}")
endif()
mark_as_advanced(OpenSubdiv_INCLUDE_DIR OpenSubdiv_LIBRARY)
