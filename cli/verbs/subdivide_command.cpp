// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/check_report.h"
#include "cli/runs/exit_status.h"
#include "cli/runs/loading.h"
#include "cli/runs/losses.h"
#include "cli/runs/outputs.h"
#include "cli/runs/writing.h"
#include "cli/runs/written_result.h"
#include "cli/verbs/commands.h"
#include "cli/verbs/verb_options.h"
#include "subvol/fit/quality/region_quality.h"
#include "subvol/io/mesh_io.h"
#include "subvol/mesh/features.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/subdivision/repeated_subdivision.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace subvol::cli {

using namespace internal;
namespace {

struct SubdivideArguments {
  RunOptions run;
  WritingOptions writing;
  std::string mesh, boundary = "auto";
  int levels = 1;
  std::optional<double> crease_angle_degrees;
};

/// Warns of regions that subdivision makes smaller or larger, as it rounds their corners off.
void warn_of_volumes(const VolumeMesh& cage, const VolumeMesh& fine, std::vector<std::string>& warnings) {
  if (region_references(cage).size() < 2) return;
  for (const std::string& warning :
       warnings_of_volumes(measure_regions(fine, nullptr), measure_regions(cage, nullptr), "control mesh"))
    warnings.push_back(warning +
                       "; creases (--crease-angle) keep the shape of edges, --boundary linear that of all faces");
}

/// Returns the rule that --boundary stands for. Meshes of several regions without creases are meshes to compute on,
/// rather than cages: rounding would change the volumes of materials.
std::string boundary_rule(const SubdivideArguments& arguments, const VolumeMesh& cage,
                          std::vector<std::string>& warnings) {
  if (arguments.boundary != "auto") return arguments.boundary;
  if (region_references(cage).size() < 2 || !cage.tags.empty() || arguments.crease_angle_degrees)
    return "catmull-clark";
  warnings.push_back(
      "cells of several references, and no creases: cells are only split, so that regions keep their shape; "
      "--boundary catmull-clark rounds the boundary and the interfaces");
  return "linear";
}

int run_subdivide(const SubdivideArguments& arguments, const CLI::App& verb) {
  if (arguments.run.outputs.empty()) throw UsageError("subdivide: nothing to write; give -o FILE");
  std::vector<Output> outputs =
      checked_outputs(arguments.run, {Part::cage, Part::cutaway, Part::boundary, Part::region});
  apply_resources(arguments.run);
  std::vector<std::string> warnings = unused_output_options(verb, outputs);
  VolumeMesh cage = load_volume(arguments.mesh, warnings, true, arguments.run.references);
  require_regions(outputs, regions_of(cage));
  const Marks read = marks_of(cage);
  const Json input{{"mesh", describe(arguments.mesh, cage)}};
  if (arguments.crease_angle_degrees) {
    cage.tags = merge_tags(cage.tags, features_by_angle(cage, *arguments.crease_angle_degrees));
  }
  const std::string rule = boundary_rule(arguments, cage, warnings);
  const bool has_limit = rule == "catmull-clark";  // the others converge to other surfaces
  const VolumeMesh fine = rule == "linear"
                              ? split_repeatedly(cage, arguments.levels)
                              : subdivide_repeatedly(cage, arguments.levels,
                                                     has_limit ? BoundaryRule::catmull_clark : BoundaryRule::averaging);

  const Marks result = marks_of(fine);
  warn_of_losses(read, result, outputs, warnings);
  warn_of_names(result, outputs, warnings);
  warn_of_volumes(cage, fine, warnings);
  WritingOptions writing = arguments.writing;
  writing.source = arguments.mesh;
  writing.options = options_of_result(verb);
  TessellatedSurface limit;
  if (has_limit && std::any_of(outputs.begin(), outputs.end(), shows_surface)) limit = tessellated_limit(cage, writing);
  return write_checked(arguments.run, std::move(outputs), fine,
                       [&](const Output& output) {
                         if (has_limit || output.part == Part::cage)
                           write_output(output, cage, fine, &limit, writing);
                         else
                           write_output(output, fine, writing);
                       },
                       warnings,
                       {{"command", "subdivide"},
                        {"options", options_in_force(verb)},
                        {"input", input},
                        {"result", describe("", fine)}});
}

}  // namespace

void add_subdivide_command(CLI::App& app, Action& action) {
  CLI::App* verb = app.add_subcommand("subdivide", "Refine a control mesh");
  const auto arguments = std::make_shared<SubdivideArguments>();
  verb->add_option("MESH", arguments->mesh, "Control mesh: " + volume_mesh_formats())->required()->type_name("FILE");
  verb->add_option("--levels", arguments->levels, "Times it is subdivided")
      ->check(whole_number_in(1, 8))
      ->type_name("L")
      ->capture_default_str();
  verb->add_option("--boundary", arguments->boundary,
                   "How boundary vertices are subdivided; linear: cells are only split, and no vertex moves; auto:\n"
                   "linear for cells of several references without creases, else catmull-clark")
      ->check(CLI::IsMember({"auto", "catmull-clark", "averaging", "linear"}))
      ->type_name("auto|catmull-clark|averaging|linear")
      ->capture_default_str();
  verb->add_option("--crease-angle", arguments->crease_angle_degrees,
                   "Boundary edges sharper than this become creases (default: only those the file tags)")
      ->check(number_in(0.0, 180.0))
      ->type_name("DEGREES");
  add_references_option(*verb, arguments->run);
  add_output_options(
      *verb, arguments->run,
      "Refined mesh, or its surface, by extension: " + output_formats() +
          "; cage:FILE for the control mesh, cutaway:FILE.glb for the cells inside, boundary:FILE.vtu for\n"
          "the faces of the boundary with their groups, region:NAME:FILE for the cells of one region; may be\n"
          "given several times");
  add_writing_options(*verb, arguments->writing);
  verb->add_option("--report", arguments->run.report, "Write what was done and what is true of the result")
      ->type_name("FILE.json");
  verb->footer(R"(Example:
  subvol subdivide cage.mesh --levels 2 --crease-angle 40 -o fine.mesh -o fine.glb)");
  verb->callback(
      [arguments, verb, &action] { action = [arguments, verb] { return run_subdivide(*arguments, *verb); }; });
}

}  // namespace subvol::cli
