# SPDX-License-Identifier: GPL-3.0-or-later
# Finds what the Python module is built with: pybind11, Python's development files, and an interpreter that has NumPy.
# -DPython_EXECUTABLE=... names another one. Sets SUBVOL_PYTHON_MISSING where something is not there.

set(PYBIND11_FINDPYTHON ON)
find_package(Python 3.9 QUIET COMPONENTS Interpreter Development.Module NumPy)
if(NOT Python_FOUND AND NOT DEFINED CACHE{Python_EXECUTABLE} AND EXISTS /usr/bin/python3)
  # The first one of the PATH may be one without packages; the system's has those that cmake/packages.txt lists.
  set(Python_EXECUTABLE /usr/bin/python3)
  find_package(Python 3.9 QUIET COMPONENTS Interpreter Development.Module NumPy)
endif()
find_package(pybind11 2.10 QUIET CONFIG)

set(SUBVOL_PYTHON_MISSING "")
if(NOT Python_FOUND)
  set(SUBVOL_PYTHON_MISSING "Python 3.9 with development files and NumPy")
elseif(NOT pybind11_FOUND)
  set(SUBVOL_PYTHON_MISSING "pybind11 2.10")
endif()
