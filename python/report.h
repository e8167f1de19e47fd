// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/run_options.h"
#include "python/keywords.h"
#include "python/work.h"

#include <string>
#include <vector>

namespace subvol::python {

using cli::Json;

/// The same as dict, list, str, bool, int, float and None.
py::object to_python(const Json& json);
/// Options in force as JSON, for files. Lists become text.
Json to_json(const py::dict& options);

/// A report as the program writes it, without what concerns files: `found` between the options and the times. Tells the
/// warnings.
py::dict make_report(const char* command, const Json& found, const Keywords& keywords, const Work& work,
                     const std::vector<std::string>& warnings);

}  // namespace subvol::python
