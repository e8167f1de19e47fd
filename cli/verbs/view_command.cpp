// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/exit_status.h"
#include "cli/runs/loading.h"
#include "cli/runs/open_page.h"
#include "cli/runs/outputs.h"
#include "cli/runs/progress.h"
#include "cli/runs/report_meshes.h"
#include "cli/runs/report_page.h"
#include "cli/runs/report_pictures.h"
#include "cli/runs/viewing.h"
#include "cli/verbs/commands.h"
#include "cli/verbs/verb_options.h"
#include "subvol/base/atomic_file.h"
#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/base/version.h"
#include "subvol/export/viewer_page.h"
#include "subvol/io/surface_io.h"
#include "subvol/surface/boundary.h"

#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>

namespace subvol::cli {

using namespace internal;
namespace {

struct ViewArguments {
  RunOptions run;
  ViewingOptions viewing;
  std::string input, output, target;
  bool open = false;
};

bool is_report(const std::string& path) {
  return lower_case(std::filesystem::path(path).extension().string()) == ".json";
}

/// The page's file: the given one, or the input's name with the extension .html in the current folder.
std::filesystem::path page_path(const ViewArguments& arguments) {
  if (arguments.output.empty()) return std::filesystem::path(arguments.input).filename().replace_extension(".html");
  std::filesystem::path path = arguments.output;
  if (lower_case(path.extension().string()) != ".html")
    throw UsageError("-o " + arguments.output + ": the extension must be .html");
  return path;
}

/// The meshes to show, and a report about them. The content is made without the viewer, too, so that the same inputs
/// are refused.
struct Subject {
  Json report;
  ReportMeshes meshes;
  std::optional<ViewerContent> content;
};

Subject subject_of_report(const ViewArguments& arguments, const WorkProgress& progress,
                          std::vector<std::string>& warnings) {
  if (!arguments.target.empty() || arguments.viewing.limit)
    throw UsageError("--target and --limit are for meshes; a report names its target and its cage");
  Subject subject{parse_report(read_file(arguments.input), arguments.input), {}, {}};
  subject.meshes = load_report_meshes(subject.report, std::filesystem::path(arguments.input).parent_path(), warnings);
  subject.content = report_content(subject.report, subject.meshes, warnings, progress);
  if (subject.content) return subject;
  std::string reasons;
  for (const std::string& warning : warnings) reasons += "; " + warning;
  throw InputError(arguments.input + ": none of the meshes that the report names can be shown" + reasons);
}

Subject subject_of_mesh(const ViewArguments& arguments, const WorkProgress& progress,
                        std::vector<std::string>& warnings) {
  require_known_file(arguments.input);
  require_choice_of_references(arguments.input, arguments.run.references);
  ViewingOptions options = arguments.viewing;
  Subject subject{
      {{"subvol", version()}, {"command", "view"}, {"input", {{"mesh", {{"path", arguments.input}}}}}}, {}, {}};
  subject.meshes.result = load_shown_mesh(arguments.input, warnings, arguments.run.references);
  TriangleMesh target;
  if (!arguments.target.empty()) {
    target = load_surface(arguments.target, warnings);
    options.target = &target;
    subject.meshes.target = as_polygons(target);
  }
  const std::filesystem::path path = arguments.input;
  subject.content = mesh_content(path.filename().string(), *subject.meshes.result, options, warnings, path, progress);
  return subject;
}

/// The page with pictures only, for programs without the viewer.
std::string picture_page(const Subject& subject, std::vector<std::string>& warnings) {
  warnings.push_back(
      "this program was built without the viewer, which needs node and the npm packages three and esbuild "
      "(docs/viewer.md); the page shows pictures");
  std::vector<std::string> notes;
  const std::vector<ReportPicture> pictures = report_pictures(subject.report, subject.meshes, notes);
  return report_page(subject.report, {}, pictures, notes);
}

int run_view(const ViewArguments& arguments) {
  const std::filesystem::path page = page_path(arguments);
  require_free(page, arguments.run.force);
  apply_resources(arguments.run);
  std::vector<std::string> warnings;
  ProgressTeller teller(arguments.run.progress, arguments.run.quiet);
  try {
    const Subject subject = is_report(arguments.input) ? subject_of_report(arguments, teller.work(), warnings)
                                                       : subject_of_mesh(arguments, teller.work(), warnings);
    teller.finish();
    write_file_atomically(page, has_viewer() ? viewer_page(*subject.content) : picture_page(subject, warnings));
  } catch (const Json::exception& error) {
    throw InputError(arguments.input + ": expected the entries of a report as subvol writes it: " + error.what());
  }
  if (!arguments.run.quiet) {
    for (const std::string& warning : warnings) std::cerr << "subvol: warning: " << warning << '\n';
    std::cerr << "wrote " << page.string() << '\n';
  }
  if (arguments.open) open_in_browser(page);
  return kDone;
}

}  // namespace

void add_view_command(CLI::App& app, Action& action) {
  CLI::App* verb = app.add_subcommand("view", "Make a page in which a mesh can be turned, cut and filtered");
  const auto arguments = std::make_shared<ViewArguments>();
  verb->add_option("MESH|REPORT", arguments->input,
                   "Volume mesh: " + cell_formats() + "; or surface: " + surface_formats() + "; or report: .json")
      ->required()
      ->type_name("FILE");
  verb->add_option("-o,--output", arguments->output,
                   "The page: one file that needs nothing else (default: the name of the input, in the current folder)")
      ->type_name("FILE.html");
  verb->add_flag("--open", arguments->open, "Show the page in the browser");
  verb->add_option("--target", arguments->target,
                   "Surface to show as a ghost, and to color the mesh by its distance from: " + surface_formats())
      ->type_name("SURFACE");
  verb->add_flag("--limit", arguments->viewing.limit, "The mesh is a control cage: show its limit surface, too");
  verb->add_option("--chord", arguments->viewing.chord_percent,
                   "Largest distance of the drawn limit surface from the true one, in percent of its box's diagonal")
      ->check(number_in(1e-4, 100.0))
      ->type_name("PERCENT")
      ->capture_default_str();
  add_references_option(*verb, arguments->run);
  verb->add_flag("--force", arguments->run.force, "Replace an existing file");
  verb->add_flag("--quiet", arguments->run.quiet, "Print nothing");
  add_resource_options(*verb, arguments->run);
  verb->footer(R"(The page works without network. Curved cells are drawn curved, inverted ones are marked.

Examples:
  subvol view bone.mesh --open
  subvol view bone.mesh --target bone.off -o bone_view.html
  subvol view bone_cage.mesh --limit -o cage.html)");
  verb->callback([arguments, &action] { action = [arguments] { return run_view(*arguments); }; });
}

}  // namespace subvol::cli
