// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/commands.h"
#include "cli/exit_status.h"
#include "cli/loading.h"
#include "cli/outputs.h"
#include "cli/report.h"
#include "cli/writing.h"
#include "fit/quality.h"
#include "subvol/features.h"
#include "subvol/mesh_io.h"
#include "subvol/repeated_subdivision.h"
#include "subvol/version.h"

#include <algorithm>
#include <iostream>
#include <memory>
#include <optional>

namespace subvol::cli {
namespace {

struct SubdivideArguments {
  RunOptions run;
  WritingOptions writing;
  std::string mesh, boundary = "catmull-clark";
  int levels = 1;
  std::optional<double> crease_angle_degrees;
};

int run_subdivide(const SubdivideArguments& arguments, const CLI::App& verb) {
  if (arguments.run.outputs.empty()) throw UsageError("subdivide: nothing to write; give -o FILE");
  std::vector<Output> outputs = checked_outputs(arguments.run, {Part::cage, Part::cutaway});
  apply_resources(arguments.run);
  std::vector<std::string> warnings;
  VolumeMesh cage = load_volume(arguments.mesh, warnings);
  if (arguments.crease_angle_degrees) {
    cage.tags = merge_tags(cage.tags, features_by_angle(cage, *arguments.crease_angle_degrees));
  }
  const BoundaryRule rule =
      arguments.boundary == "averaging" ? BoundaryRule::averaging : BoundaryRule::catmull_clark;
  const VolumeMesh fine = subdivide_repeatedly(cage, arguments.levels, rule);

  WritingOptions writing = arguments.writing;
  writing.source = arguments.mesh;
  writing.options = options_of_result(verb);
  TessellatedSurface limit;
  if (std::any_of(outputs.begin(), outputs.end(), shows_surface)) limit = tessellated_limit(cage, writing);
  const std::vector<std::string> failures =
      write_each(outputs, [&](const Output& output) { write_output(output, cage, fine, &limit, writing); });

  const QualityReport quality = measure_quality(fine);
  if (!arguments.run.report.empty()) {
    write_report(arguments.run.report, {{"subvol", version()},
                                        {"command", "subdivide"},
                                        {"options", options_in_force(verb)},
                                        {"input", {{"mesh", describe(arguments.mesh, cage)}}},
                                        {"result", describe("", fine)},
                                        {"quality",
                                         {{"cells", quality.num_cells},
                                          {"min_scaled_jacobian", quality.min_scaled_jacobian},
                                          {"mean_scaled_jacobian", quality.mean_scaled_jacobian},
                                          {"inverted_cells", quality.inverted_cells},
                                          {"certified_cells", quality.certificate.certified}}},
                                        {"warnings", warnings},
                                        {"peak_memory_bytes", peak_memory_bytes()},
                                        {"outputs", output_names(outputs)}});
  }
  if (!arguments.run.quiet) {
    for (const std::string& warning : warnings) std::cerr << "subvol: warning: " << warning << '\n';
    std::cerr << fine.num_cells() << " cells, " << fine.num_vertices() << " vertices; scaled Jacobian at least "
              << quality.min_scaled_jacobian << "; " << quality.certificate.not_certified.size()
              << " cells not proved valid\n";
  }
  require_all_written(failures);
  return kDone;
}

}  // namespace

void add_subdivide_command(CLI::App& app, Action& action) {
  CLI::App* verb = app.add_subcommand("subdivide", "Refine a control mesh");
  const auto arguments = std::make_shared<SubdivideArguments>();
  verb->add_option("MESH", arguments->mesh, "Control mesh: " + volume_mesh_formats())->required()->type_name("FILE");
  verb->add_option("--levels", arguments->levels, "Times it is subdivided")
      ->check(CLI::Range(1, 8))
      ->type_name("L")
      ->capture_default_str();
  verb->add_option("--boundary", arguments->boundary, "How boundary vertices are subdivided")
      ->check(CLI::IsMember({"catmull-clark", "averaging"}))
      ->type_name("catmull-clark|averaging")
      ->capture_default_str();
  verb->add_option("--crease-angle", arguments->crease_angle_degrees,
                   "Boundary edges sharper than this become creases (default: only those the file tags)")
      ->check(number_in(0.0, 180.0))
      ->type_name("DEGREES");
  add_output_options(*verb, arguments->run,
                     "Refined mesh, or its surface, by extension: " + output_formats() +
                         "; cage:FILE for the control mesh, cutaway:FILE.glb for the cells inside; may be given\n"
                         "several times");
  add_writing_options(*verb, arguments->writing);
  verb->add_option("--report", arguments->run.report, "Write what was done")->type_name("FILE.json");
  verb->footer(R"(Example:
  subvol subdivide cage.mesh --levels 2 --crease-angle 40 -o fine.mesh -o fine.glb)");
  verb->callback(
      [arguments, verb, &action] { action = [arguments, verb] { return run_subdivide(*arguments, *verb); }; });
}

}  // namespace subvol::cli
