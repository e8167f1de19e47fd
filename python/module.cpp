// SPDX-License-Identifier: GPL-3.0-or-later
#include "python/module.h"

#include "cli/runs/exit_status.h"
#include "cli/runs/run_options.h"
#include "python/work.h"
#include "subvol/base/error.h"
#include "subvol/base/version.h"

namespace subvol::python {
namespace {

/// The exceptions of the module; they live as long as the process.
struct Errors {
  PyObject *any, *input, *io;
};
Errors errors;

PyObject* new_error(py::module_& module, const char* name, const char* help, std::initializer_list<PyObject*> bases) {
  py::tuple all(bases.size());
  std::size_t i = 0;
  for (PyObject* base : bases) all[i++] = py::reinterpret_borrow<py::object>(base);
  PyObject* error = PyErr_NewExceptionWithDoc((std::string("subvol.") + name).c_str(), help, all.ptr(), nullptr);
  if (error == nullptr) throw py::error_already_set();
  module.attr(name) = py::reinterpret_borrow<py::object>(error);
  return error;
}

// File names need not be UTF-8.
void set_error(PyObject* error, const char* text) { PyErr_SetString(error, cli::as_utf8(in_keywords(text)).c_str()); }

void add_errors(py::module_& module) {
  errors.any = new_error(module, "Error", "What subvol raises, but for TypeError and what Python itself raises.",
                         {PyExc_Exception});
  errors.input = new_error(module, "InputError",
                           "An argument or a file that cannot be used; the message names it and what was expected.",
                           {errors.any, PyExc_ValueError});
  errors.io = new_error(module, "IoError", "The system refused: a file that cannot be written, a full disk.",
                        {errors.any, PyExc_OSError});
  // NOLINTNEXTLINE(performance-unnecessary-value-param): pybind11 calls it with a value
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const InputError& error) {
      set_error(errors.input, error.what());
    } catch (const cli::UsageError& error) {
      set_error(errors.input, error.what());
    } catch (const IoError& error) {
      set_error(errors.io, error.what());
    }
  });
}

void add_progress(py::module_& module) {
  py::class_<Progress>(module, "Progress", "A step of a long work.")
      .def_readonly("stage", &Progress::stage, "What is being done: str.")
      .def_readonly("level", &Progress::level, "Level of subdivision; 0: there are none.")
      .def_readonly("iteration", &Progress::iteration, "Step of the stage.")
      .def_readonly("energy", &Progress::energy, "What is minimized, after the step.")
      .def_readonly("fraction", &Progress::fraction, "Estimate of the share done, in [0, 1].");
}

}  // namespace
}  // namespace subvol::python

PYBIND11_MODULE(_subvol, module) {
  using namespace subvol::python;
  py::options options;
  options.disable_function_signatures();  // docstrings begin with signatures that `inspect` understands
  const pybind11::object own_name = module.attr("__name__");
  module.attr("__name__") = "subvol";  // the module that classes and functions report as theirs
  module.attr("__version__") = subvol::version();
  add_errors(module);
  add_progress(module);
  add_meshes(module);
  add_high_order_mesh(module);
  add_maps(module);
  add_fits(module);
  add_fill(module);
  add_optimize(module);
  add_shell(module);
  add_templates(module);
  add_checks(module);
  add_viewing(module);
  add_files(module);
  module.attr("__name__") = own_name;
}
