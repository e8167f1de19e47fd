# SPDX-License-Identifier: GPL-3.0-or-later
# The target `package`: a Debian package of all that is installed. Also installs what only packages need: a file for
# pkg-config, completions of shells, man pages, the program that writes the samples, and what Debian asks of a package.

# `cmake --install --prefix` may name another prefix than this one, so the file finds it from its own place.
set(SUBVOL_PC_PREFIX "${CMAKE_INSTALL_PREFIX}")
if(NOT CMAKE_INSTALL_PREFIX STREQUAL "/usr")
  string(REGEX REPLACE "[^/]+" ".." SUBVOL_PC_PREFIX "${CMAKE_INSTALL_LIBDIR}/pkgconfig")
  string(PREPEND SUBVOL_PC_PREFIX "\${pcfiledir}/")
endif()
set(SUBVOL_PC_LIBRARIES "")
if(NOT BUILD_SHARED_LIBS)  # the static library does not carry these along
  set(SUBVOL_PC_LIBRARIES " -ltinygltf -losdCPU -lpugixml -lz -lmpfr -lgmp")
  foreach(library LZ4 NETCDF CGNS ASSIMP)
    if(SUBVOL_${library})
      string(TOLOWER " -l${library}" flag)
      string(APPEND SUBVOL_PC_LIBRARIES "${flag}")
    endif()
  endforeach()
  string(APPEND SUBVOL_PC_LIBRARIES " ${OpenMP_CXX_FLAGS}")
endif()
configure_file("${PROJECT_SOURCE_DIR}/cmake/subvol.pc.in" "${PROJECT_BINARY_DIR}/subvol.pc" @ONLY)
install(FILES "${PROJECT_BINARY_DIR}/subvol.pc" DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig")

if(TARGET subvol_samples)
  install(TARGETS subvol_samples RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}")
endif()

if(TARGET subvol_cli)
  # The program writes its own completions; help2man makes the manual of a verb from its help.
  set(made "${PROJECT_BINARY_DIR}/made")
  set(completions "${made}/subvol.bash" "${made}/_subvol" "${made}/subvol.fish")
  add_custom_command(OUTPUT ${completions} DEPENDS subvol_cli COMMENT "Completions of shells" VERBATIM
    COMMAND ${CMAKE_COMMAND} -E make_directory "${made}"
    COMMAND sh -c "\"$1\" completion bash > \"$2\"" sh "$<TARGET_FILE:subvol_cli>" "${made}/subvol.bash"
    COMMAND sh -c "\"$1\" completion zsh > \"$2\"" sh "$<TARGET_FILE:subvol_cli>" "${made}/_subvol"
    COMMAND sh -c "\"$1\" completion fish > \"$2\"" sh "$<TARGET_FILE:subvol_cli>" "${made}/subvol.fish")
  add_custom_target(subvol_completions ALL DEPENDS ${completions})
  install(FILES "${made}/subvol.bash" RENAME subvol DESTINATION "${CMAKE_INSTALL_DATADIR}/bash-completion/completions")
  install(FILES "${made}/_subvol" DESTINATION "${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions")
  install(FILES "${made}/subvol.fish" DESTINATION "${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d")

  find_program(SUBVOL_HELP2MAN help2man DOC "help2man, which makes the manual of the program from its help")
  if(SUBVOL_HELP2MAN)
    set(manuals "")
    macro(add_manual name target command summary)
      add_custom_command(OUTPUT "${made}/${name}.1.gz" DEPENDS ${target} COMMENT "Manual: ${name}(1)" VERBATIM
        COMMAND ${SUBVOL_HELP2MAN} --no-info --name "${summary}" --version-string "${name} ${PROJECT_VERSION}"
          --output "${made}/${name}.1" "${command}"
        COMMAND gzip -9nf "${made}/${name}.1")
      list(APPEND manuals "${made}/${name}.1.gz")
    endmacro()
    add_manual(subvol subvol_cli "$<TARGET_FILE:subvol_cli>" "volume meshes from surfaces")
    foreach(verb fit optimize shell subdivide template check convert view report batch formats)
      add_manual("subvol-${verb}" subvol_cli "$<TARGET_FILE:subvol_cli> ${verb}" "volume meshes from surfaces")
    endforeach()
    if(TARGET subvol_samples)
      add_manual(subvol_samples subvol_samples "$<TARGET_FILE:subvol_samples>" "writes the samples of subvol")
    endif()
    add_custom_target(subvol_manual ALL DEPENDS ${manuals})
    install(FILES ${manuals} DESTINATION "${CMAKE_INSTALL_MANDIR}/man1")
  endif()

  # The add-on for Blender runs the program.
  set(addon "${made}/subvol_cage.zip")
  file(GLOB addon_files CONFIGURE_DEPENDS RELATIVE "${PROJECT_SOURCE_DIR}/export/blender"
    "${PROJECT_SOURCE_DIR}/export/blender/subvol_cage/*.py")
  set(addon_sources ${addon_files})
  list(TRANSFORM addon_sources PREPEND "${PROJECT_SOURCE_DIR}/export/blender/")
  add_custom_command(OUTPUT "${addon}" DEPENDS ${addon_sources} COMMENT "Add-on for Blender" VERBATIM
    COMMAND ${CMAKE_COMMAND} -E make_directory "${made}"
    COMMAND ${CMAKE_COMMAND} -E tar cf "${addon}" --format=zip ${addon_files}
    WORKING_DIRECTORY "${PROJECT_SOURCE_DIR}/export/blender")
  add_custom_target(subvol_addon ALL DEPENDS "${addon}")
  install(FILES "${addon}" DESTINATION "${CMAKE_INSTALL_DATADIR}/subvol")
endif()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME subvol)
set(CPACK_PACKAGE_CONTACT "the subvol project <subvol@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "volume meshes of hexahedra from surfaces, with cages, shells and curved cells")
set(CPACK_PACKAGE_DESCRIPTION "subvol fills surfaces with hexahedra, fits subdivision volumes and curved
cells to them, grows layers on them, and improves meshes. It proves of each
cell that it is nowhere inverted.
.
The package holds the program, the shared library and its headers, the
Python module, and an add-on for Blender.")
set(CPACK_PACKAGING_INSTALL_PREFIX "${CMAKE_INSTALL_PREFIX}")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS "${PROJECT_BINARY_DIR}")
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ${BUILD_SHARED_LIBS})  # packages that link the library depend on this one
# The headers include Eigen's; the Python module needs NumPy.
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "libeigen3-dev, python3-numpy")

# What Debian asks of each package.
string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC)
configure_file("${PROJECT_SOURCE_DIR}/cmake/debian/changelog.in" "${PROJECT_BINARY_DIR}/debian/changelog" @ONLY)
file(ARCHIVE_CREATE OUTPUT "${PROJECT_BINARY_DIR}/debian/changelog.gz" PATHS "${PROJECT_BINARY_DIR}/debian/changelog"
  FORMAT raw COMPRESSION GZip COMPRESSION_LEVEL 9)
install(FILES "${PROJECT_BINARY_DIR}/debian/changelog.gz" "${PROJECT_SOURCE_DIR}/cmake/debian/copyright"
  DESTINATION "${CMAKE_INSTALL_DOCDIR}")
if(TARGET subvol_python)
  configure_file("${PROJECT_SOURCE_DIR}/cmake/debian/prerm.in" "${PROJECT_BINARY_DIR}/debian/prerm" @ONLY
    FILE_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
  set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA "${PROJECT_BINARY_DIR}/debian/prerm")
endif()
set(CPACK_STRIP_FILES ON)
include(CPack)
