// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/verbs/commands.h"

#include "cli/verbs/config_file.h"
#include "subvol/base/version.h"

#include <memory>
#include <string>

namespace subvol::cli {
namespace {

constexpr const char* kProgramFooter = R"(Examples:
  subvol fit bone.off --template bone.mesh -o bone.glb -o cage:bone_cage.mesh --report bone.json
  subvol optimize tangled.mesh -o valid.mesh
  subvol shell bone.off --thickness 2% --layers 2 --side both -o bone_shell.vtu -o bone_shell.glb
  subvol template auto bone.off --cells 300 -o bone_template.mesh
  subvol check bone_fine.mesh --target bone.off
  subvol convert cage.mesh -o cage.usda
  subvol view bone.mesh --open
  subvol report bone.json -o bone.html
  subvol batch parts/*.stl -o out -- --cells 300

Exit status: 0 done; 1 failed or not valid; 2 usage; 3 input rejected; 4 not converged (best result written);
             130 interrupted (best result written).
"subvol VERB --help" tells more.)";

}  // namespace

void describe_program(CLI::App& app, Action& action) {
  app.footer(kProgramFooter);
  app.set_version_flag("--version", std::string("subvol ") + version() + "\nwith " SUBVOL_DEPENDENCIES);
  app.require_subcommand(1);
  app.fallthrough();  // --config may stand after the verb
  app.set_config("--config", "", "Read options from FILE.toml");
  app.get_config_ptr()->type_name("FILE.toml")->check(regular_file());
  app.config_formatter(std::make_shared<VerbConfig>(app));
  app.allow_config_extras(CLI::config_extras_mode::error);
  add_fit_command(app, action);
  add_optimize_command(app, action);
  add_shell_command(app, action);
  add_subdivide_command(app, action);
  add_template_command(app, action);
  add_check_command(app, action);
  add_convert_command(app, action);
  add_view_command(app, action);
  add_report_command(app, action);
  add_batch_command(app, action);
  add_formats_command(app, action);
  add_completion_command(app, action);
}

}  // namespace subvol::cli
