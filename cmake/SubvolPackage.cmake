# SPDX-License-Identifier: GPL-3.0-or-later
# The target `package`: a Debian package of all that is installed. Also installs what only packages need: a file for
# pkg-config, completions of shells, man pages.

configure_file("${PROJECT_SOURCE_DIR}/cmake/subvol.pc.in" "${PROJECT_BINARY_DIR}/subvol.pc" @ONLY)
install(FILES "${PROJECT_BINARY_DIR}/subvol.pc" DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig")

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
    # A verb's manual is subvol-VERB(1); that of the program comes first.
    set(manuals "")
    foreach(verb "" fit optimize shell subdivide template check convert view report batch formats)
      set(name subvol)
      set(command "$<TARGET_FILE:subvol_cli>")
      if(verb)
        string(APPEND name "-${verb}")
        string(APPEND command " ${verb}")
      endif()
      add_custom_command(OUTPUT "${made}/${name}.1" DEPENDS subvol_cli COMMENT "Manual: ${name}(1)" VERBATIM
        COMMAND ${SUBVOL_HELP2MAN} --no-info --name "volume meshes from surfaces"
          --version-string "subvol ${PROJECT_VERSION}" --output "${made}/${name}.1" "${command}")
      list(APPEND manuals "${made}/${name}.1")
    endforeach()
    add_custom_target(subvol_manual ALL DEPENDS ${manuals})
    install(FILES ${manuals} DESTINATION "${CMAKE_INSTALL_MANDIR}/man1")
  endif()

  # The add-on for Blender runs the program.
  set(addon "${made}/subvol_cage.zip")
  file(GLOB addon_files CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/export/blender/subvol_cage/*.py")
  add_custom_command(OUTPUT "${addon}" DEPENDS ${addon_files} COMMENT "Add-on for Blender" VERBATIM
    COMMAND ${CMAKE_COMMAND} -E make_directory "${made}"
    COMMAND ${CMAKE_COMMAND} -E tar cf "${addon}" --format=zip subvol_cage
    WORKING_DIRECTORY "${PROJECT_SOURCE_DIR}/export/blender")
  add_custom_target(subvol_addon ALL DEPENDS "${addon}")
  install(FILES "${addon}" DESTINATION "${CMAKE_INSTALL_DATADIR}/subvol")
endif()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME subvol)
set(CPACK_PACKAGE_CONTACT "the subvol project <subvol@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "volume meshes of hexahedra from surfaces, with cages, shells and curved cells")
set(CPACK_PACKAGE_DESCRIPTION "${CPACK_PACKAGE_DESCRIPTION_SUMMARY}")
set(CPACK_PACKAGING_INSTALL_PREFIX "${CMAKE_INSTALL_PREFIX}")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS "${PROJECT_BINARY_DIR}")
# The headers include Eigen's; the Python module needs NumPy.
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "libeigen3-dev, python3-numpy")
set(CPACK_STRIP_FILES ON)
include(CPack)
