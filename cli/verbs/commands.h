// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <CLI/CLI.hpp>

#include <functional>

namespace subvol::cli {

/// The work to do once the command line has been parsed; returns an ExitStatus. Set by the verb on the command line.
using Action = std::function<int()>;

/// Tells the parser everything that the program accepts: every verb, --version, --config. Parsing then throws CLI's
/// ParseError or UsageError, or sets `action`.
void describe_program(CLI::App& app, Action& action);

/// Each adds one verb: its options, its help, and its action.
void add_fit_command(CLI::App& app, Action& action);
void add_optimize_command(CLI::App& app, Action& action);
void add_shell_command(CLI::App& app, Action& action);
void add_subdivide_command(CLI::App& app, Action& action);
void add_template_command(CLI::App& app, Action& action);
void add_check_command(CLI::App& app, Action& action);
void add_convert_command(CLI::App& app, Action& action);
void add_view_command(CLI::App& app, Action& action);
void add_report_command(CLI::App& app, Action& action);
void add_batch_command(CLI::App& app, Action& action);
void add_completion_command(CLI::App& app, Action& action);
void add_formats_command(CLI::App& app, Action& action);

}  // namespace subvol::cli
