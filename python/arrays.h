// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace subvol::python {

namespace py = pybind11;

/// An array over memory of `owner`, which it keeps alive: nothing is copied.
/// strides  in bytes; empty: consecutive rows. The array can be written only if `writeable`.
template <class T>
py::array shown(const T* data, std::vector<py::ssize_t> shape, py::handle owner, bool writeable = false,
                std::vector<py::ssize_t> strides = {}) {
  static const T nothing{};  // an empty vector has no address, and NumPy would make an array of its own
  py::array array(py::dtype::of<T>(), std::move(shape), std::move(strides), data ? data : &nothing, owner);
  if (!writeable) array.attr("setflags")(py::arg("write") = false);
  return array;
}

/// Points as (n, 3) float64, which can be written.
inline py::array shown_points(const std::vector<Vec3>& points, py::handle owner) {
  const auto rows = static_cast<py::ssize_t>(points.size());
  return shown(reinterpret_cast<const double*>(points.data()), {rows, 3}, owner, true);
}

/// Offsets as int64, which SciPy and VTK expect.
inline py::array shown_offsets(const std::vector<std::size_t>& offsets, py::handle owner) {
  static_assert(sizeof(std::size_t) == sizeof(std::int64_t));
  const auto size = static_cast<py::ssize_t>(offsets.size());
  return shown(reinterpret_cast<const std::int64_t*>(offsets.data()), {size}, owner);
}

/// An array that owns the content of a vector: nothing is copied.
template <class T>
py::array moved(std::vector<T> values) {
  const auto size = static_cast<py::ssize_t>(values.size());
  auto* kept = new std::vector<T>(std::move(values));
  const py::capsule owner(kept, [](void* p) { delete static_cast<std::vector<T>*>(p); });
  return py::array(py::dtype::of<T>(), {size}, {}, kept->data(), owner);
}

/// Points as the rows of an array that owns them.
py::array moved_points(std::vector<Vec3> points);

/// Reads (n, 3) numbers. TypeError: not numbers; InputError: another shape. `name` is the argument's name, for
/// messages.
std::vector<Vec3> points_from(const py::object& object, const char* name);

/// Reads any number of values in one dimension. Errors as above.
std::vector<double> values_from(const py::object& object, const char* name);

/// Reads (n, columns) integers in [0, bound), row by row; columns 0: one dimension. None gives nothing. Errors as
/// above.
std::vector<Index> indices_from(const py::object& object, const char* name, std::size_t columns, std::size_t bound);

/// Reads n integers of any sign. None gives nothing. Errors as above, and InputError for another length.
std::vector<int> integers_from(const py::object& object, const char* name, std::size_t size);

}  // namespace subvol::python
