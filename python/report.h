// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/run_options.h"
#include "python/keywords.h"
#include "python/work.h"

#include <string>
#include <vector>

namespace subvol::python {

using cli::Json;

/// Converts JSON to dict, list, str, bool, int, float and None.
py::object to_python(const Json& json);
/// Converts options in force to JSON, for files. Lists become text.
Json to_json(const py::dict& options);

/// Makes a report like the program's, without the entries on files: `found` stands between the options and the times.
/// Issues the warnings.
py::dict make_report(const char* command, const Json& found, const Keywords& keywords, const Work& work,
                     const std::vector<std::string>& warnings);

}  // namespace subvol::python
