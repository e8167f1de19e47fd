// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/run_options.h"
#include "subvol/fit/stages/fit_report.h"

#include <filesystem>
#include <string>

namespace subvol::cli {

/// The stages of a fit, with every iteration.
Json stages_json(const FitReport& report);

/// How a fit went: why it stopped, its stages, and the initial distance of its template.
Json fit_json(const FitReport& report);

/// Seconds by part.
Json seconds_json(const FitReport& report);

/// JSON text of a report, with the command line if it is known. std::runtime_error, naming the entry, if a number is
/// not finite, which JSON cannot express.
std::string json_text(const Json& report);

/// Stores the words of the command line; every report written from now on holds them as "command_line".
void remember_command_line(int argc, const char* const* argv);

/// Writes a report, the whole text or nothing. IoError: the file cannot be written.
void write_report(const std::filesystem::path& path, const Json& report);

}  // namespace subvol::cli
