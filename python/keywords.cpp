// SPDX-License-Identifier: GPL-3.0-or-later
#include "python/keywords.h"

#include "subvol/base/error.h"

#include <algorithm>
#include <cctype>
#include <limits>

namespace subvol::python {

std::string in_keywords(const std::string& message) {
  const auto is_of_word = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-'; };
  std::string result;
  for (std::size_t i = 0; i < message.size();) {
    const bool begins = message.compare(i, 2, "--") == 0 && i + 2 < message.size() &&
                        std::islower(static_cast<unsigned char>(message[i + 2])) != 0 &&
                        (i == 0 || !is_of_word(message[i - 1]));
    if (!begins) {
      result += message[i++];
      continue;
    }
    std::string name;
    for (i += 2; i < message.size() && is_of_word(message[i]); ++i) name += message[i] == '-' ? '_' : message[i];
    result += name == "lambda" ? "lambda_" : name;  // a word of Python
  }
  return result;
}

std::optional<bool> truth_of(const py::object& object) {
  const bool is_truth =
      py::isinstance<py::bool_>(object) || py::isinstance(object, py::module_::import("numpy").attr("bool_"));
  if (!is_truth) return std::nullopt;
  return object.cast<bool>();
}

std::optional<double> number_of(const py::object& object) {
  const bool is_number = PyIndex_Check(object.ptr()) || py::hasattr(object, "__float__");
  // Arrays have all that numbers have, and lists are no numbers.
  const bool is_array = py::hasattr(object, "ndim") && object.attr("ndim").cast<int>() != 0;
  if (!is_number || is_array || truth_of(object)) return std::nullopt;
  const double value = PyFloat_AsDouble(object.ptr());
  if (value == -1 && PyErr_Occurred()) throw py::error_already_set();
  return value;
}

py::object Keywords::find(const char* name) {
  taken_.emplace_back(name);
  return given_.contains(name) ? py::object(given_[name]) : py::none();
}

py::object Keywords::object(const char* name) { return find(name); }

void Keywords::refuse(std::initializer_list<const char*> names, const char* why) {
  for (const char* name : names) {
    taken_.emplace_back(name);
    if (has(name)) throw InputError(call_ + ": " + name + ' ' + why);
  }
}

void Keywords::finish() const {
  std::string list;
  for (const std::string& name : taken_) list += (list.empty() ? "" : ", ") + name;
  for (const auto& [key, value] : given_) {
    const auto name = key.cast<std::string>();
    if (std::find(taken_.begin(), taken_.end(), name) == taken_.end())
      throw py::type_error(call_ + ": there is no option '" + name + "'; there are " + list);
  }
}

void Keywords::refuse_type(const char* name, const py::handle& value, const char* wanted) const {
  throw py::type_error(call_ + ": " + name + " must be " + wanted + ", not " + py::repr(value).cast<std::string>());
}

void Keywords::refuse_word(const char* name, const py::handle& value, const std::vector<const char*>& words) const {
  std::string list;
  for (std::size_t i = 0; i < words.size(); ++i)
    list += std::string(i == 0 ? "" : i + 1 == words.size() ? " or " : ", ") + '\'' + words[i] + '\'';
  throw InputError(call_ + ": " + name + " must be " + list + ", not " + py::repr(value).cast<std::string>());
}

void Keywords::read(const char* name, const py::object& given, bool& value) const {
  const std::optional<bool> truth = truth_of(given);
  if (!truth) refuse_type(name, given, "True or False");
  value = *truth;
}

long long Keywords::whole_number(const char* name, const py::object& given) const {
  if (py::isinstance<py::bool_>(given) || !PyIndex_Check(given.ptr())) refuse_type(name, given, "a whole number");
  const auto number = py::reinterpret_steal<py::object>(PyNumber_Index(given.ptr()));
  if (!number) throw py::error_already_set();
  int overflow = 0;
  const long long value = PyLong_AsLongLongAndOverflow(number.ptr(), &overflow);
  using Limits = std::numeric_limits<long long>;
  return overflow == 0 ? value : overflow > 0 ? Limits::max() : Limits::min();
}

void Keywords::read(const char* name, const py::object& given, int& value) const {
  const long long number = whole_number(name, given);
  if (number < std::numeric_limits<int>::min() || number > std::numeric_limits<int>::max())
    throw InputError(call_ + ": " + name + " is far too large: " + py::repr(given).cast<std::string>());
  value = static_cast<int>(number);
}

void Keywords::read(const char* name, const py::object& given, std::size_t& value) const {
  const long long number = whole_number(name, given);
  if (number < 0) throw InputError(call_ + ": " + name + " must not be negative, got " + std::to_string(number));
  value = static_cast<std::size_t>(number);
}

void Keywords::read(const char* name, const py::object& given, double& value) const {
  const std::optional<double> number = number_of(given);
  if (!number) refuse_type(name, given, "a number");
  value = *number;
}

void Keywords::read(const char* name, const py::object& given, std::map<std::string, double>& values) const {
  if (!py::isinstance<py::dict>(given)) refuse_type(name, given, "a dictionary of numbers");
  for (const auto& [key, value] : given.cast<py::dict>()) {
    std::string word;
    read(name, py::reinterpret_borrow<py::object>(key), word);
    read(name, py::reinterpret_borrow<py::object>(value), values[word]);
  }
}

void Keywords::read(const char* name, const py::object& given, std::string& value) const {
  if (!py::isinstance<py::str>(given)) refuse_type(name, given, "a word");
  value = given.cast<std::string>();
}

}  // namespace subvol::python
