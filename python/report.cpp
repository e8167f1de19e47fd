// SPDX-License-Identifier: GPL-3.0-or-later
#include "python/report.h"

#include "cli/runs/report.h"
#include "subvol/base/process_memory.h"
#include "subvol/base/version.h"

namespace subvol::python {

using namespace internal;

py::object to_python(const Json& json) {
  switch (json.type()) {
    case Json::value_t::object: {
      py::dict dict;
      for (const auto& [key, value] : json.items()) dict[py::str(key)] = to_python(value);
      return dict;
    }
    case Json::value_t::array: {
      py::list list;
      for (const Json& value : json) list.append(to_python(value));
      return list;
    }
    case Json::value_t::string: return py::str(cli::as_utf8(json.get<std::string>()));
    case Json::value_t::boolean: return py::bool_(json.get<bool>());
    case Json::value_t::number_integer: return py::int_(json.get<long long>());
    case Json::value_t::number_unsigned: return py::int_(json.get<unsigned long long>());
    case Json::value_t::number_float: return py::float_(json.get<double>());
    default: return py::none();
  }
}

Json to_json(const py::dict& options) {
  Json json = Json::object();
  for (const auto& [key, value] : options) {
    const auto name = key.cast<std::string>();
    if (value.is_none()) continue;
    if (py::isinstance<py::bool_>(value)) {
      json[name] = value.cast<bool>();
    } else if (py::isinstance<py::int_>(value) || py::isinstance<py::float_>(value)) {
      json[name] = value.cast<double>();
    } else {
      json[name] = py::str(value).cast<std::string>();
    }
  }
  return json;
}

py::dict make_report(const char* command, const Json& found, const Keywords& keywords, const Work& work,
                     const std::vector<std::string>& warnings) {
  py::dict report;
  report["subvol"] = version();
  report["command"] = command;
  report["options"] = keywords.in_force();
  for (const auto& [key, value] : found.items()) report[py::str(key)] = to_python(value);
  py::list told;
  for (const std::string& warning : warnings) told.append(cli::as_utf8(in_keywords(warning)));
  report["warnings"] = told;
  py::dict seconds;
  for (const auto& [part, value] : work.seconds_by_part()) seconds[py::str(part)] = value;
  seconds["total"] = work.seconds();
  report["seconds"] = seconds;
  report["peak_memory_bytes"] = peak_memory_bytes();
  warn(warnings);
  return report;
}

}  // namespace subvol::python
