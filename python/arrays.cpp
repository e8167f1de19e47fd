// SPDX-License-Identifier: GPL-3.0-or-later
#include "python/arrays.h"

#include "subvol/base/error.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <string>

namespace subvol::python {
namespace {

std::string shape_text(const py::array& array) {
  std::string text = "(";
  for (py::ssize_t a = 0; a < array.ndim(); ++a) text += (a ? ", " : "") + std::to_string(array.shape(a));
  return text + (array.ndim() == 1 ? ",)" : ")");
}

/// Converts the object to an array of numbers whose kind is in `kinds`: "f", "i", "u".
py::array numbers_from(const py::object& object, const char* name, const char* kinds, const char* wanted) {
  py::array array = py::array::ensure(object);
  if (!array) {
    PyErr_Clear();
    throw py::type_error(std::string(name) + " must be an array of " + wanted);
  }
  const bool nothing = array.size() == 0;  // an empty list has a type, although it holds no numbers
  if (!nothing && std::strchr(kinds, array.dtype().kind()) == nullptr)
    throw py::type_error(std::string(name) + " must be an array of " + wanted + ", not of " +
                         py::str(array.dtype()).cast<std::string>());
  return array;
}

void require_shape(const py::array& array, const char* name, std::size_t columns) {
  const bool fits =
      columns == 0 ? array.ndim() == 1 : array.ndim() == 2 && static_cast<std::size_t>(array.shape(1)) == columns;
  if (fits || (array.size() == 0 && array.ndim() == 1)) return;
  throw InputError(std::string(name) + " must have the shape (n," + (columns ? " " + std::to_string(columns) : "") +
                   "), not " + shape_text(array));
}

using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Longs = py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>;

Longs longs_from(const py::object& object, const char* name, std::size_t columns) {
  const py::array array = numbers_from(object, name, "iu", "whole numbers");
  require_shape(array, name, columns);
  return Longs(array);
}

/// "cells[3, 2]", or "cells[3]" for columns 0.
std::string place_text(const char* name, std::size_t i, std::size_t columns) {
  const std::string text = std::string(name) + '[';
  if (columns == 0) return text + std::to_string(i) + ']';
  return text + std::to_string(i / columns) + ", " + std::to_string(i % columns) + ']';
}

}  // namespace

py::array moved_points(std::vector<Vec3> points) {
  auto* kept = new std::vector<Vec3>(std::move(points));
  const py::capsule owner(kept, [](void* p) { delete static_cast<std::vector<Vec3>*>(p); });
  return shown_points(*kept, owner);
}

std::vector<Vec3> points_from(const py::object& object, const char* name) {
  const py::array array = numbers_from(object, name, "fiu", "numbers");
  require_shape(array, name, 3);
  const Doubles values(array);
  std::vector<Vec3> points(static_cast<std::size_t>(values.size()) / 3);
  if (!points.empty()) std::memcpy(points.data()->data(), values.data(), sizeof(Vec3) * points.size());
  return points;
}

std::vector<double> values_from(const py::object& object, const char* name) {
  const py::array array = numbers_from(object, name, "fiu", "numbers");
  require_shape(array, name, 0);
  const Doubles values(array);
  return {values.data(), values.data() + values.size()};
}

std::vector<Index> indices_from(const py::object& object, const char* name, std::size_t columns, std::size_t bound) {
  if (object.is_none()) return {};
  const Longs values = longs_from(object, name, columns);
  const auto size = static_cast<std::size_t>(values.size());
  std::vector<Index> indices(size);
  for (std::size_t i = 0; i < size; ++i) {
    const std::int64_t value = values.data()[i];
    if (value < 0 || static_cast<std::size_t>(value) >= bound)
      throw InputError(place_text(name, i, columns) + " is " + std::to_string(value) + ", but must be in [0, " +
                       std::to_string(bound) + ')');
    indices[i] = static_cast<Index>(value);
  }
  return indices;
}

std::vector<int> integers_from(const py::object& object, const char* name, std::size_t size) {
  if (object.is_none()) return {};
  const Longs values = longs_from(object, name, 0);
  if (static_cast<std::size_t>(values.size()) != size)
    throw InputError(std::string(name) + " must have " + std::to_string(size) + " entries, not " +
                     std::to_string(values.size()));
  std::vector<int> integers(size);
  for (std::size_t i = 0; i < size; ++i) {
    const std::int64_t value = values.data()[i];
    if (value < std::numeric_limits<int>::min() || value > std::numeric_limits<int>::max())
      throw InputError(place_text(name, i, 0) + " is " + std::to_string(value) + ", which does not fit 32 bits");
    integers[i] = static_cast<int>(value);
  }
  return integers;
}

}  // namespace subvol::python
