// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <array>
#include <cstddef>
#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace subvol::python {

namespace py = pybind11;

/// The words that an option accepts, with their meanings.
template <class Value>
using Choices = std::vector<std::pair<const char*, Value>>;

/// Converts True or False of Python or NumPy; nothing for other objects.
std::optional<bool> truth_of(const py::object& object);

/// Converts a number of Python or NumPy; nothing for other objects: True, False, texts, arrays and lists.
std::optional<double> number_of(const py::object& object);

/// Returns a message of the library with options of the command line named as keywords: "--time-limit" as "time_limit".
std::string in_keywords(const std::string& message);

/// Keyword arguments of one call, taken one by one under the names of the command line (with "_" for "-").
///
/// The library checks the values; only their types are checked here. None stands for the default.
class Keywords {
 public:
  /// call  the function's name, for messages.
  Keywords(std::string call, const py::kwargs& given) : call_(std::move(call)), given_(given) {}

  /// Takes an option if it is given. TypeError: a value of another type; InputError: a word that is not a choice.
  template <class Value>
  void take(const char* name, Value& value);
  template <class Value>
  void take(const char* name, Value& value, const Choices<Value>& choices);

  /// The object given, or None.
  py::object object(const char* name);
  /// True if something other than None is given.
  bool has(const char* name) const { return given_.contains(name) && !given_[name].is_none(); }
  /// Throws InputError with the reason if one of these is given.
  void refuse(std::initializer_list<const char*> names, const char* why);
  /// Throws TypeError, listing the available options, if an option has not been taken.
  void finish() const;

  /// Options by name with their values, given or default.
  const py::dict& in_force() const { return in_force_; }

 private:
  py::object find(const char* name);
  [[noreturn]] void refuse_type(const char* name, const py::handle& value, const char* wanted) const;
  [[noreturn]] void refuse_word(const char* name, const py::handle& value, const std::vector<const char*>& words) const;
  void read(const char* name, const py::object& given, bool& value) const;
  void read(const char* name, const py::object& given, int& value) const;
  void read(const char* name, const py::object& given, std::size_t& value) const;
  void read(const char* name, const py::object& given, double& value) const;
  void read(const char* name, const py::object& given, std::string& value) const;
  void read(const char* name, const py::object& given, std::map<std::string, double>& values) const;
  template <class Value>
  void read(const char* name, const py::object& given, std::optional<Value>& value) const {
    read(name, given, value.emplace());
  }
  template <class Value, std::size_t N>
  void read(const char* name, const py::object& given, std::array<Value, N>& value) const;
  long long whole_number(const char* name, const py::object& given) const;

  std::string call_;
  py::kwargs given_;
  std::vector<std::string> taken_;
  py::dict in_force_;
};

template <class Value>
void Keywords::take(const char* name, Value& value) {
  const py::object given = find(name);
  if (!given.is_none()) read(name, given, value);
  in_force_[name] = py::cast(value);
}

template <class Value>
void Keywords::take(const char* name, Value& value, const Choices<Value>& choices) {
  const py::object given = find(name);
  if (!given.is_none()) {
    std::string word;
    read(name, given, word);
    bool known = false;
    std::vector<const char*> words;
    for (const auto& [choice, meaning] : choices) {
      words.push_back(choice);
      if (word != choice) continue;
      value = meaning;
      known = true;
    }
    if (!known) refuse_word(name, given, words);
  }
  for (const auto& [choice, meaning] : choices)
    if (value == meaning) in_force_[name] = choice;
}

template <class Value, std::size_t N>
void Keywords::read(const char* name, const py::object& given, std::array<Value, N>& value) const {
  const std::string wanted = std::to_string(N) + " numbers";
  if (!py::isinstance<py::sequence>(given) && !py::hasattr(given, "__array__"))
    refuse_type(name, given, wanted.c_str());
  const py::list items(given);
  if (items.size() != N) refuse_type(name, given, wanted.c_str());
  for (std::size_t i = 0; i < N; ++i) read(name, items[i], value[i]);
}

}  // namespace subvol::python
