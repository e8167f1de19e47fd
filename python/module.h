// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>

namespace subvol::python {

// Each adds the content of one .cpp file to the module.
void add_meshes(pybind11::module_& module);
void add_high_order_mesh(pybind11::module_& module);
void add_maps(pybind11::module_& module);
void add_files(pybind11::module_& module);
void add_fits(pybind11::module_& module);
void add_fill(pybind11::module_& module);
void add_optimize(pybind11::module_& module);
void add_shell(pybind11::module_& module);
void add_templates(pybind11::module_& module);
void add_checks(pybind11::module_& module);
void add_viewing(pybind11::module_& module);

}  // namespace subvol::python
