# SPDX-License-Identifier: GPL-3.0-or-later
# Included by CTest: adds a test for each file with tests that are not tagged [slow]. --filenames-as-tags gives a test the
# tag #FILE. Inputs: program (the tests), properties (of each test).
if(EXISTS "${program}")  # the test "subvol_tests_NOT_BUILT" fails otherwise
  execute_process(COMMAND "${program}" --filenames-as-tags --list-tags "~[slow]" OUTPUT_VARIABLE listed)
  string(REGEX MATCHALL "\\[#[A-Za-z0-9_]+\\]" tags "${listed}")
  if(NOT tags)
    message(FATAL_ERROR "${program} lists no quick tests:\n${listed}")
  endif()
  foreach(tag ${tags})
    string(REGEX REPLACE "[^A-Za-z0-9_]" "" file "${tag}")
    add_test("${file}" "${program}" --filenames-as-tags "${tag}~[slow]")
    set_tests_properties("${file}" PROPERTIES ${properties})
  endforeach()
endif()
