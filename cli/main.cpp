// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/commands.h"
#include "cli/config_file.h"
#include "cli/exit_status.h"
#include "cli/report.h"
#include "subvol/error.h"
#include "subvol/version.h"

#include <csignal>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <iostream>
#include <memory>
#include <new>

#include <unistd.h>

namespace subvol::cli {
namespace {

constexpr const char* kFooter = R"(Examples:
  subvol fit bone.off --template bone.mesh -o bone.glb -o cage:bone_cage.mesh --report bone.json
  subvol optimize tangled.mesh -o valid.mesh
  subvol shell bone.off --thickness 2% --layers 2 --side both -o bone_shell.vtu -o bone_shell.glb
  subvol template auto bone.off --cells 300 -o bone_template.mesh
  subvol check bone_fine.mesh --target bone.off
  subvol convert cage.mesh -o cage.usda
  subvol report bone.json -o bone.html

Exit status: 0 done; 1 failed or not valid; 2 usage; 3 input rejected; 4 not converged (best result written);
             130 interrupted (best result written).
"subvol VERB --help" tells more.)";

constexpr const char* kOutOfMemory = "out of memory";

int complain(const char* what, int status) {
  std::cerr << "subvol: " << what << '\n';
  return status;
}

// The parser would only say that a verb is missing.
void require_known_verb(const CLI::App& app, int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-') return;
  std::string verbs;
  for (const CLI::App* verb : app.get_subcommands({})) {
    if (verb->get_name() == argv[1]) return;
    verbs += ' ' + verb->get_name();
  }
  throw UsageError(std::string("there is no verb '") + argv[1] + "'; there are:" + verbs);
}

/// An exception that leaves a parallel loop ends the program here: in order, and with nothing half-written.
[[noreturn]] void end_in_order() {
  const char* what = "an error in a parallel loop";
  try {
    if (const std::exception_ptr error = std::current_exception()) std::rethrow_exception(error);
  } catch (const std::bad_alloc&) {
    what = kOutOfMemory;
  } catch (...) {
  }
  // Nothing is allocated any more, nothing unwound: other threads still run.
  (void)!write(STDERR_FILENO, "subvol: ", 8);
  (void)!write(STDERR_FILENO, what, std::strlen(what));
  (void)!write(STDERR_FILENO, "\n", 1);
  std::_Exit(kFailed);
}

int run(int argc, char** argv) {
  remember_command_line(argc, argv);
  CLI::App app{"Fits volume meshes to surfaces: subdivision volumes and shells.", "subvol"};
  app.footer(kFooter);
  app.set_version_flag("--version", std::string("subvol ") + version());
  app.require_subcommand(1);
  app.fallthrough();  // --config may stand after the verb
  app.set_config("--config", "", "Read options from FILE.toml");
  app.get_config_ptr()->type_name("FILE.toml");
  app.config_formatter(std::make_shared<VerbConfig>(app));
  app.allow_config_extras(CLI::config_extras_mode::error);

  Action action;
  add_fit_command(app, action);
  add_optimize_command(app, action);
  add_shell_command(app, action);
  add_subdivide_command(app, action);
  add_template_command(app, action);
  add_check_command(app, action);
  add_convert_command(app, action);
  add_report_command(app, action);
  require_known_verb(app, argc, argv);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kUsage;
  }
  return action();
}

}  // namespace
}  // namespace subvol::cli

int main(int argc, char** argv) {
  using namespace subvol::cli;
  std::set_terminate(end_in_order);
  std::signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is an error like a full disk
  try {
    return run(argc, argv);
  } catch (const UsageError& error) {
    return complain(error.what(), kUsage);
  } catch (const subvol::InputError& error) {
    return complain(error.what(), kRejected);
  } catch (const std::bad_alloc&) {
    return complain(kOutOfMemory, kFailed);
  } catch (const std::exception& error) {
    return complain(error.what(), kFailed);
  }
}
