# SPDX-License-Identifier: GPL-3.0-or-later
# The target `docs`: a reference of the library's headers, made by Doxygen, in the build folder.

find_program(SUBVOL_DOXYGEN doxygen DOC "Doxygen, for the target docs")
if(SUBVOL_DOXYGEN)
  set(reference "${PROJECT_BINARY_DIR}/reference")
  file(CONFIGURE OUTPUT "${reference}/Doxyfile" CONTENT [[
PROJECT_NAME = subvol
PROJECT_NUMBER = @PROJECT_VERSION@
PROJECT_BRIEF = "@PROJECT_DESCRIPTION@"
OUTPUT_DIRECTORY = "@reference@"
INPUT = "@PROJECT_SOURCE_DIR@/README.md" "@PROJECT_SOURCE_DIR@/docs" "@PROJECT_SOURCE_DIR@/subvol" \
        "@PROJECT_SOURCE_DIR@/fit" "@PROJECT_SOURCE_DIR@/shell" "@PROJECT_SOURCE_DIR@/export" \
        "@PROJECT_SOURCE_DIR@/samples"
FILE_PATTERNS = *.h *.md
EXAMPLE_PATH = "@PROJECT_SOURCE_DIR@/samples"
IMAGE_PATH = "@PROJECT_SOURCE_DIR@/docs/pictures"
STRIP_FROM_PATH = "@PROJECT_SOURCE_DIR@"
USE_MDFILE_AS_MAINPAGE = "@PROJECT_SOURCE_DIR@/README.md"
RECURSIVE = YES
EXTRACT_ALL = YES
JAVADOC_AUTOBRIEF = YES
MARKDOWN_SUPPORT = YES
AUTOLINK_SUPPORT = YES
GENERATE_LATEX = NO
HAVE_DOT = NO
QUIET = YES
WARN_IF_UNDOCUMENTED = NO
WARN_LOGFILE = "@reference@/warnings.txt"
WARN_AS_ERROR = NO
]] @ONLY)
  add_custom_target(docs COMMAND ${SUBVOL_DOXYGEN} "${reference}/Doxyfile" WORKING_DIRECTORY "${reference}"
    COMMENT "Reference: ${reference}/html/index.html; what Doxygen says of it: warnings.txt" VERBATIM)
else()
  add_custom_target(docs COMMAND ${CMAKE_COMMAND} -E echo "no Doxygen; cmake/install_packages docs"
    COMMAND ${CMAKE_COMMAND} -E false)
endif()
