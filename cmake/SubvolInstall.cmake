# SPDX-License-Identifier: GPL-3.0-or-later
# Installs the library, its public headers, the program and a package config that find_package(subvol) understands.

include(CMakePackageConfigHelpers)
set(SUBVOL_CONFIG_DIR "${CMAKE_INSTALL_LIBDIR}/cmake/subvol")

install(TARGETS subvol EXPORT subvol-targets
  ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}"
  LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}")
install(FILES "${SUBVOL_INCLUDE_DIR}/subvol/version_macros.h" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/subvol")
foreach(header ${SUBVOL_PUBLIC_HEADERS})
  get_filename_component(folder "${header}" DIRECTORY)
  string(REGEX REPLACE "^subvol/" "" folder "${folder}")
  install(FILES "${PROJECT_SOURCE_DIR}/${header}" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/subvol/${folder}")
endforeach()
if(TARGET subvol_cli)
  install(TARGETS subvol_cli RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}")
endif()

install(EXPORT subvol-targets NAMESPACE subvol:: DESTINATION "${SUBVOL_CONFIG_DIR}")
configure_package_config_file("${PROJECT_SOURCE_DIR}/cmake/subvol-config.cmake.in"
  "${PROJECT_BINARY_DIR}/subvol-config.cmake" INSTALL_DESTINATION "${SUBVOL_CONFIG_DIR}")
write_basic_package_version_file("${PROJECT_BINARY_DIR}/subvol-config-version.cmake" COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/subvol-config.cmake" "${PROJECT_BINARY_DIR}/subvol-config-version.cmake"
  "${PROJECT_SOURCE_DIR}/cmake/FindOpenSubdiv.cmake" DESTINATION "${SUBVOL_CONFIG_DIR}")
install(FILES "${PROJECT_SOURCE_DIR}/LICENSE" DESTINATION "${CMAKE_INSTALL_DOCDIR}")
