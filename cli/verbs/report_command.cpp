// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/exit_status.h"
#include "cli/runs/outputs.h"
#include "cli/runs/progress.h"
#include "cli/runs/report_meshes.h"
#include "cli/runs/report_page.h"
#include "cli/runs/report_pictures.h"
#include "cli/runs/viewing.h"
#include "cli/verbs/commands.h"
#include "subvol/base/atomic_file.h"
#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/export/viewer_page.h"

#include <iostream>
#include <memory>
#include <optional>

namespace subvol::cli {

using namespace internal;
namespace {

struct ReportArguments {
  std::string report, output;
  bool force = false, quiet = false, no_pictures = false, no_viewer = false;
};

int run_report(const ReportArguments& arguments) {
  if (std::filesystem::path(arguments.output).extension() != ".html")
    throw UsageError("-o " + arguments.output + ": the extension must be .html");
  require_free(arguments.output, arguments.force);
  const Json report = parse_report(read_file(arguments.report), arguments.report);
  try {
    std::vector<std::string> notes;
    std::vector<ReportPicture> pictures;
    std::string viewer;
    if (!arguments.no_pictures) {
      ProgressTeller teller("", arguments.quiet);
      const ReportMeshes meshes =
          load_report_meshes(report, std::filesystem::path(arguments.report).parent_path(), notes);
      if (has_viewer() && !arguments.no_viewer)
        if (const std::optional<ViewerContent> content = report_content(report, meshes, notes, teller.work()))
          viewer = viewer_element(*content);
      pictures = report_pictures(report, meshes, notes);
      teller.finish();
    }
    write_file_atomically(arguments.output, report_page(report, viewer, pictures, notes));
    if (arguments.quiet) return kDone;
    for (const std::string& note : notes) std::cerr << "subvol: warning: " << note << '\n';
    std::cerr << "wrote " << arguments.output << '\n';
  } catch (const Json::exception& error) {
    throw InputError(arguments.report + ": expected the entries of a report as subvol writes it: " + error.what());
  }
  return kDone;
}

}  // namespace

void add_report_command(CLI::App& app, Action& action) {
  CLI::App* verb = app.add_subcommand("report", "Show a report as a page with a viewer, pictures and plots");
  const auto arguments = std::make_shared<ReportArguments>();
  verb->add_option("REPORT", arguments->report, "Report that --report has written")->required()->type_name("FILE.json");
  verb->add_option("-o,--output", arguments->output, "The page: one file that needs nothing else")
      ->required()
      ->type_name("FILE.html");
  verb->add_flag("--no-pictures", arguments->no_pictures,
                 "Leave out the viewer and the pictures: the meshes need not be there");
  verb->add_flag("--no-viewer", arguments->no_viewer, "Leave out the viewer: a page without scripts, of pictures only");
  verb->add_flag("--force", arguments->force, "Replace an existing file");
  verb->add_flag("--quiet", arguments->quiet, "Print nothing");
  verb->footer(R"(Example:
  subvol fit bone.off --template bone.mesh -o bone.mesh --report bone.json
  subvol report bone.json -o bone.html

The meshes are those of the files that the report names, as they are now; those that are gone are left out.)");
  verb->callback([arguments, &action] { action = [arguments] { return run_report(*arguments); }; });
}

}  // namespace subvol::cli
