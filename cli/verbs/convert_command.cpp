// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/exit_status.h"
#include "cli/runs/loading.h"
#include "cli/runs/losses.h"
#include "cli/runs/outputs.h"
#include "cli/runs/writing.h"
#include "cli/runs/written_result.h"
#include "cli/verbs/commands.h"
#include "cli/verbs/verb_options.h"
#include "subvol/io/mesh_io.h"
#include "subvol/io/surface_io.h"

#include <algorithm>
#include <iostream>
#include <memory>

namespace subvol::cli {
namespace {

struct ConvertArguments {
  RunOptions run;
  WritingOptions writing;
  std::string input, region;
  bool limit = false;
};

void convert_volume(const ConvertArguments& arguments, VolumeMesh mesh, std::vector<Output>& outputs,
                    const WritingOptions& writing, std::vector<std::string>& warnings) {
  if (!arguments.region.empty()) mesh = cells_of_region(mesh, arguments.region);
  const Marks marks = marks_of(mesh);
  warn_of_losses(marks, marks, outputs, warnings);
  warn_of_names(marks, outputs, warnings);
  require_all_written(write_each(outputs, [&](const Output& output) {
    if (arguments.limit && !output.is_volume() && !output.is_scene() && output.extension != ".usda") {
      write_polygons(output, tessellated_limit(mesh, writing), writing);
    } else if (arguments.limit && shows_surface(output)) {
      const TessellatedSurface limit = tessellated_limit(mesh, writing);
      write_output(output, mesh, mesh, &limit, writing);
    } else {
      write_output(output, mesh, writing);
    }
  }));
}

/// returns  an ExitStatus: that of the polynomial cells and of the linear ones that were written.
int convert_high_order(const ConvertArguments& arguments, const HighOrderFile& file, std::vector<Output>& outputs,
                       const WritingOptions& writing, std::vector<std::string>& warnings) {
  if (arguments.limit) throw UsageError("--limit: curved cells have no limit surface; leave it out");
  for (const Output& output : outputs) require_for_curved_cells(output, kind_orders(file.mesh.space));
  const Marks marks = marks_of(file);
  warn_of_losses(marks, marks, outputs, warnings, true);
  warn_of_names(marks, outputs, warnings);
  require_all_written(write_each(outputs, [&](const Output& output) { write_output(output, file, writing); }));
  const std::vector<PolynomialCells> polynomials =
      check_polynomial_cells(outputs, file.mesh, writing.map_tolerance_percent, [&](const HighOrderMesh& mesh) {
        return check_mesh(mesh, curved_boundary(mesh, measured_chord_percent(writing)));
      });
  for (const PolynomialCells& cells : polynomials)
    for (const std::string& warning : polynomial_cells_warnings(cells)) warnings.push_back(warning);
  const std::optional<VolumeMesh> linear = written_cells(outputs);
  const std::vector<std::string> found =
      linear ? linear_cells_warnings(check_mesh(*linear)) : std::vector<std::string>{};
  warnings.insert(warnings.end(), found.begin(), found.end());
  return found.empty() ? polynomial_cells_status(polynomials) : kFailed;
}

void convert_surface(const ConvertArguments& arguments, const PolygonMesh& surface, std::vector<Output>& outputs,
                     const WritingOptions& writing, std::vector<std::string>& warnings) {
  if (arguments.limit)
    throw UsageError("--limit: " + arguments.input + " is a surface, and the limit surface is that of cells");
  for (const Output& output : outputs) {
    if (output.part == Part::cutaway)
      throw UsageError(output.path.string() + ": " + arguments.input + " has no inside");
    if (output.is_volume() && output.part != Part::boundary) {
      throw UsageError(output.path.string() + ": this format holds cells, but " + arguments.input + " is a surface");
    }
  }
  warn_of_names(marks_of(surface), outputs, warnings);
  require_all_written(write_each(outputs, [&](const Output& output) { write_output(output, surface, writing); }));
}

int run_convert(const ConvertArguments& arguments, const CLI::App& verb) {
  std::vector<Output> outputs = checked_outputs(arguments.run, {Part::cutaway, Part::boundary});
  apply_resources(arguments.run);
  WritingOptions writing = arguments.writing;
  writing.source = arguments.input;
  writing.options = options_of_result(verb);
  std::vector<std::string> warnings = unused_output_options(verb, outputs);
  int status = kDone;
  require_known_file(arguments.input);
  require_choice_of_references(arguments.input, arguments.run.references);
  LoadedMesh mesh = load_mesh(arguments.input, warnings, true, arguments.run.references);
  auto* cells = std::get_if<VolumeMesh>(&mesh);
  if (!arguments.region.empty() && std::holds_alternative<PolygonMesh>(mesh))
    throw UsageError("--region: " + arguments.input + " is a surface, which has no cells to choose from");
  if (cells) {
    convert_volume(arguments, std::move(*cells), outputs, writing, warnings);
  } else if (auto* curved = std::get_if<HighOrderFile>(&mesh)) {
    if (!arguments.region.empty()) *curved = cells_of_region(*curved, arguments.region);
    status = convert_high_order(arguments, *curved, outputs, writing, warnings);
  } else {
    convert_surface(arguments, std::get<PolygonMesh>(mesh), outputs, writing, warnings);
  }
  if (!arguments.run.quiet) {
    for (const std::string& warning : warnings) std::cerr << "subvol: warning: " << warning << '\n';
  }
  return status;
}

}  // namespace

void add_convert_command(CLI::App& app, Action& action) {
  CLI::App* verb = app.add_subcommand("convert", "Write a mesh in another format");
  const auto arguments = std::make_shared<ConvertArguments>();
  verb->add_option("IN", arguments->input, "Volume mesh: " + cell_formats() + "; or surface: " + surface_formats())
      ->required()
      ->type_name("FILE");
  verb->add_flag("--limit", arguments->limit,
                 "Surface formats show the limit surface of the mesh as a control cage, not its flat faces");
  verb->add_option("--region", arguments->region, "Write the cells of this region only: its name or reference")
      ->type_name("NAME");
  verb->add_option(
          "--intervals", arguments->writing.linear_intervals,
          "Intervals of each edge of a curved cell that becomes linear ones (.mesh, .vtk); 0: the largest order")
      ->check(whole_number_in(0, 64))
      ->type_name("N")
      ->capture_default_str();
  add_map_tolerance(*verb, arguments->writing);
  add_references_option(*verb, arguments->run);
  add_output_options(
      *verb, arguments->run,
      "Output, whose extension chooses the format: " + output_formats() +
          "; cutaway:FILE.glb for the cells inside, boundary:FILE.vtu for the faces of the boundary with\n"
          "their groups; may be given several times");
  verb->get_option("--output")->required();
  add_writing_options(*verb, arguments->writing);
  verb->footer(
      R"(Surface formats take the boundary of a volume mesh; .usda keeps it a subdivision cage with its creases.
The curved boundary of a high-order .vtu is cut into triangles within --chord of it.

Examples:
  subvol convert cage.vtk -o cage.mesh
  subvol convert cage.mesh --limit -o smooth.glb
  subvol convert curved.vtu -o curved.msh -o curved.glb)");
  verb->callback([arguments, verb, &action] { action = [arguments, verb] { return run_convert(*arguments, *verb); }; });
}

}  // namespace subvol::cli
