// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/check_report.h"
#include "cli/runs/exit_status.h"
#include "cli/runs/loading.h"
#include "cli/runs/report.h"
#include "cli/runs/shell_output.h"
#include "cli/runs/shell_surface.h"
#include "cli/runs/writing.h"
#include "cli/runs/written_result.h"
#include "cli/verbs/commands.h"
#include "cli/verbs/long_run.h"
#include "cli/verbs/verb_options.h"
#include "subvol/base/error.h"
#include "subvol/base/format.h"
#include "subvol/base/version.h"
#include "subvol/fit/geometry/surface_distance.h"
#include "subvol/fit/mesh_check.h"
#include "subvol/fit/stages/fit_report.h"
#include "subvol/io/surface_io.h"
#include "subvol/mesh/features.h"
#include "subvol/shell/shell.h"
#include "subvol/subdivision/subdivision.h"
#include "subvol/surface/boundary.h"

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <memory>
#include <optional>

namespace subvol::cli {

using namespace internal;
namespace {

struct ShellArguments {
  RunOptions run;
  WritingOptions writing;
  ShellOptions shell;
  std::string surface, thickness, thickness_file, thickness_attribute, side = "outward", first_height, region;
  std::vector<std::string> skipped;
  std::string repair = formatted("%.6g%%", 100 * kMendingShare);
  int order = 1;
  std::string basis = "legendre";
  std::optional<double> crease_angle_degrees;
  bool straight = false;
};

ShellSide shell_side(const std::string& name) {
  return name == "both" ? ShellSide::both : name == "inward" ? ShellSide::inward : ShellSide::outward;
}

/// One run of `shell`, from its input file to its output files.
class ShellRun : public LongRun {
 public:
  ShellRun(const ShellArguments& arguments, const CLI::App& verb)
      : LongRun(arguments.run, verb), arguments_(arguments) {}
  int run();

 private:
  void require_one_per_vertex(const std::string& file, const std::vector<double>& thickness) const;
  void load();
  void mend();
  /// The height that was asked for, in the mesh's unit.
  std::optional<double> first_height() const;
  void plan_layers(ShellOptions& options) const;
  void grow();
  void curve();
  void write();
  void check();
  void check_subdivided();
  Json report() const;
  void summarize() const;
  std::vector<double> thickness_from_file() const;
  std::vector<double> thickness_from_attribute() const;

  const ShellArguments& arguments_;
  TaggedPolygons given_;
  std::string region_;    ///< of `given_`, on whose boundary layers grow; empty: on all of it
  ShellSurface surface_;  ///< on which the layers grow
  double diagonal_ = 0;
  ShellResult result_;
  std::optional<CurvedShell> curved_;
  ShellFailures failures_;
  std::vector<PolynomialCells> polynomials_;
  std::optional<MeshCheck> linear_;               ///< of linear cells that were written in place of the curved ones
  std::optional<CertificateSummary> subdivided_;  ///< of the layers as a control mesh, refined once
};

void ShellRun::load() {
  region_ = arguments_.region;
  given_ = load_shell_surface(arguments_.surface, region_, warnings_);
  const TriangleMesh triangles = triangulate(given_.polygons);
  diagonal_ = bounding_box_diagonal(triangles);
  if (const auto warning = inward_warning(triangles)) warnings_.push_back(arguments_.surface + ": " + *warning);
  tell_warnings();
}

void ShellRun::mend() {
  try {
    surface_ = prepared_surface(given_, {.region = region_,
                                         .side = shell_side(arguments_.side),
                                         .skipped = arguments_.skipped,
                                         .repair_distance = parse_repair("--repair", arguments_.repair, diagonal_),
                                         .cancelled = interrupted});
  } catch (const InputError& error) {
    throw InputError(arguments_.surface + ": " + error.what());
  }
  if (surface_.note) add_warnings({arguments_.surface + ": " + *surface_.note});
  if (const auto warning = repair_warning(surface_, diagonal_)) add_warnings({arguments_.surface + ": " + *warning});
}

std::vector<double> ShellRun::thickness_from_file() const {
  std::vector<double> thickness = load_thicknesses(arguments_.thickness_file);
  require_one_per_vertex(arguments_.thickness_file, thickness);
  return thickness;
}

std::vector<double> ShellRun::thickness_from_attribute() const {
  std::vector<double> thickness = read_vertex_attribute(arguments_.surface, arguments_.thickness_attribute);
  require_one_per_vertex(arguments_.surface, thickness);
  return thickness;
}

void ShellRun::require_one_per_vertex(const std::string& file, const std::vector<double>& thickness) const {
  if (thickness.size() != given_.polygons.positions.size())
    throw InputError(file + ": expected one thickness for each of the " +
                     std::to_string(given_.polygons.positions.size()) + " vertices of the surface, got " +
                     std::to_string(thickness.size()));
}

void ShellRun::grow() {
  ShellOptions options = arguments_.shell;
  if (!arguments_.thickness.empty())
    options.thickness = parse_length("--thickness", arguments_.thickness, diagonal_);
  else
    options.vertex_thickness = arguments_.thickness_file.empty() ? thickness_from_attribute() : thickness_from_file();
  options.side = shell_side(arguments_.side);
  options.optimize = !arguments_.straight;
  if (!arguments_.first_height.empty()) plan_layers(options);
  try {
    if (arguments_.crease_angle_degrees)
      options.tags = surface_features(surface_.polygons, *arguments_.crease_angle_degrees);
    take_surface(surface_, options);
    result_ = followed(options.control, [&] { return make_shell(surface_.polygons, options); });
  } catch (const InputError& error) {
    throw InputError(arguments_.surface + ": " + error.what());
  }
  if (result_.mesh.num_cells() == 0)
    throw EndedEarly(arguments_.surface + ": the work was ended before there was a shell", kInterrupted);
  add_warnings(result_.report.warnings);
  add_warnings(thickness_warnings(result_, first_height()));
}

std::optional<double> ShellRun::first_height() const {
  if (arguments_.first_height.empty()) return std::nullopt;
  return parse_length("--first-height", arguments_.first_height, diagonal_);
}

void ShellRun::plan_layers(ShellOptions& options) const {
  const auto is_given = [&](const char* option) { return verb_.get_option(option)->count() > 0; };
  const LayerPlan plan = planned_layers(options.thickness, *first_height(),
                                        is_given("--layers") ? std::optional(options.layers) : std::nullopt,
                                        is_given("--growth") ? std::optional(options.growth) : std::nullopt);
  options.layers = plan.layers;
  options.growth = plan.growth;
}

// Uses the time that the linear shell has left. If none is left, or the run must end, the cells get the requested order
// but stay straight.
void ShellRun::curve() {
  if (arguments_.order == 1) return;
  if (!result_.failures.none()) {
    return add_warnings({"the cells were left straight, for the shell is not valid"});
  }
  CurvedShellOptions options{.order = arguments_.order,
                             .basis = arguments_.basis == "fourier" ? Basis::fourier : Basis::legendre,
                             .control = {.max_iterations = arguments_.shell.control.max_iterations}};
  if (const double limit = arguments_.shell.control.time_limit_seconds; limit > 0)
    options.control.time_limit_seconds = std::max(1e-3, limit - seconds());
  options.boundary = [&](const HighOrderMesh& mesh) {
    return curved_boundary(mesh, measured_chord_percent(arguments_.writing));
  };
  curved_ = followed(options.control, [&] { return curve_shell(result_, options); });
  take_figures(*curved_, result_);
  add_warnings(curved_->report.warnings);
}

void ShellRun::write() {
  add_warnings_of_names(marks_of(result_.mesh));
  WritingOptions writing = arguments_.writing;
  writing.source = arguments_.surface;
  writing.options = options_of_result(verb_);
  write_each([&](const Output& output) {
    curved_ ? write_shell(output, result_, *curved_, writing) : write_shell(output, result_, writing);
  });
}

// Every cell number in a report refers to the layers, in whatever order a file lists the cells.
void ShellRun::check() {
  failures_ = result_.failures;
  if (curved_) {
    if (const std::optional<VolumeMesh> linear = written_cells(outputs_)) {
      linear_ = check_mesh(*linear);
      add_warnings(linear_cells_warnings(*linear_));
    }
    const auto check_curved = [&](const HighOrderMesh& mesh) {
      return check_mesh(mesh, curved_boundary(mesh, measured_chord_percent(arguments_.writing)));
    };
    polynomials_ =
        check_polynomial_cells(outputs_, curved_->mesh, arguments_.writing.map_tolerance_percent, check_curved);
    for (const PolynomialCells& cells : polynomials_) add_warnings(polynomial_cells_warnings(cells));
    const std::optional<HighOrderMesh> written = written_curved_cells(outputs_);
    if (!written) return;
    const MeshCheck found = check_curved(*written);
    failures_ = {found.quality->certificate, found.intersecting_faces};
    return;
  }
  std::optional<VolumeMesh> written = written_cells(outputs_);
  if (!written) written = written_cells(outputs_, Part::cage);  // the same cells
  if (!written) return;
  failures_ = ShellCheck(result_.layers, result_.mesh, CheckedSheets::all).failures(written->positions);
}

// A control mesh will be subdivided by its user, which may invert valid cells.
void ShellRun::check_subdivided() {
  const auto is_cage = [](const Output& output) { return output.part == Part::cage; };
  if (std::none_of(outputs_.begin(), outputs_.end(), is_cage)) return;
  subdivided_ = certify(subdivide(result_.mesh, BoundaryRule::catmull_clark).fine);
  if (subdivided_->all_certified()) return;
  add_warnings({std::to_string(subdivided_->not_certified.size()) + " of " +
                std::to_string(subdivided_->certified + subdivided_->not_certified.size()) +
                " cells are not certified once the control mesh is subdivided"});
}

Json ShellRun::report() const {
  const FitReport& report = result_.report;
  Json json{{"subvol", version()},
            {"command", "shell"},
            {"options", options_in_force(verb_)},
            {"input", {{"surface", describe(arguments_.surface, given_.polygons)}}},
            {"repair", repair_json(surface_, diagonal_)},
            {"skipped", skipped_json(surface_)},
            {"stop_reason", to_string(report.stop_reason)},
            {"explanation", report.explanation},
            {"converged", report.stop_reason == StopReason::converged},
            {"stages", stages_json(report)},
            {"valid", failures_.none()},
            {"thickness", thickness_json(result_, diagonal_)},
            {"layers", layers_json(result_)},
            {"border", border_json(result_, diagonal_)},
            {"groups", shell_groups_json(result_, given_.polygons)},
            {"surface_distance_max_percent", 100 * result_.surface_distance_max / diagonal_},
            {"quality", quality_json(result_.quality)},
            {"corner_quality", corner_quality_json(result_)},
            {"not_certified_cells", failures_.certificate.not_certified},
            {"boundary_self_intersections", failures_.intersecting.size()},
            {"intersecting_faces", failures_.intersecting},
            {"mesh", curved_ ? describe("", curved_->mesh) : describe("", result_.mesh)}};
  if (linear_) json["linear_cells"] = check_json(*linear_);
  if (!polynomials_.empty()) json["polynomial_cells"] = polynomial_cells_json(polynomials_);
  if (subdivided_)
    json["subdivided_once"] = {{"certified_cells", subdivided_->certified},
                               {"not_certified_cells", subdivided_->not_certified.size()}};
  return json;
}

void ShellRun::summarize() const {
  const FitReport& report = result_.report;
  std::fprintf(stderr, "%s: %s\n", to_string(report.stop_reason), report.explanation.c_str());
  std::fprintf(stderr, "cells               %zu in %d layer(s), %zu vertices\n", result_.mesh.num_cells(),
               result_.layers.num_sheets() - 1, result_.mesh.num_vertices());
  std::cerr << thickness_text(result_);
  std::fprintf(stderr, "scaled Jacobian     min %.4f, mean %.4f against the references\n",
               result_.quality.min_scaled_jacobian, result_.quality.mean_scaled_jacobian);
  std::fprintf(stderr, "at corners          min %.4f, mean %.4f against ideal cells, as other programs measure\n",
               result_.corner_quality.min_scaled_jacobian, result_.corner_quality.mean_scaled_jacobian);
  std::fprintf(stderr, "certified cells     %zu of %zu\n", failures_.certificate.certified, result_.mesh.num_cells());
  std::fprintf(stderr, "self-intersections  %zu pairs of faces\n", failures_.intersecting.size());
  for (std::size_t i = 0; i < std::min<std::size_t>(5, failures_.certificate.not_certified.size()); ++i)
    std::fprintf(stderr, "  cell %d is not certified\n", static_cast<int>(failures_.certificate.not_certified[i]));
  for (std::size_t i = 0; i < std::min<std::size_t>(5, failures_.intersecting.size()); ++i)
    std::fprintf(stderr, "  faces %d and %d meet\n", static_cast<int>(failures_.intersecting[i][0]),
                 static_cast<int>(failures_.intersecting[i][1]));
  std::fprintf(stderr, "%s\n", failures_.none() ? "valid" : "NOT VALID");
  tell_outputs();
}

int ShellRun::run() {
  if (arguments_.thickness.empty() + arguments_.thickness_file.empty() + arguments_.thickness_attribute.empty() != 2)
    throw UsageError("shell: give one of --thickness, --thickness-file and --thickness-attribute");
  if (!arguments_.thickness.empty()) parse_length("--thickness", arguments_.thickness, 1);
  if (!arguments_.first_height.empty() && arguments_.thickness.empty())
    throw UsageError("shell: --first-height goes with --thickness, not with one thickness for each vertex");
  parse_repair("--repair", arguments_.repair, 1);
  if (arguments_.shell.free_surface && arguments_.straight)
    throw UsageError("shell: --straight and --free-surface exclude each other: straight columns stand on the surface");
  if (arguments_.order > 1 && arguments_.straight) throw UsageError("shell: --straight and --order exclude each other");
  prepare({Part::cage, Part::cutaway, Part::boundary});
  timed("read", &ShellRun::load);
  timed("repair", &ShellRun::mend);
  if (arguments_.order > 1) refuse_curved(outputs_, surface_.polygons, arguments_.order);
  timed("grow", &ShellRun::grow);
  timed("curve", &ShellRun::curve);
  timed("write", &ShellRun::write);
  timed("check", &ShellRun::check);
  timed("subdivide", &ShellRun::check_subdivided);
  write_report(report(), seconds_json(result_.report));
  if (!arguments_.run.quiet) summarize();
  require_outputs();
  const int of_shell = status(result_.report, failures_.none() && (!linear_ || linear_->valid()));
  return of_shell == kDone ? polynomial_cells_status(polynomials_) : of_shell;
}

/// Adds the options that set the thickness and number of the layers.
void add_thickness_options(CLI::App& verb, ShellArguments& arguments) {
  ShellOptions& shell = arguments.shell;
  verb.add_option("--thickness", arguments.thickness,
                  "Thickness of each side, in the mesh's unit or as 2% of the bounding box's diagonal")
      ->type_name("T");
  verb.add_option("--thickness-file", arguments.thickness_file,
                  "Thickness of each vertex instead: one number a line, in the mesh's unit")
      ->type_name("FILE");
  verb.add_option("--thickness-attribute", arguments.thickness_attribute,
                  "Thickness of each vertex instead: a vertex property of SURFACE, a .ply")
      ->type_name("NAME");
  verb.add_option("--layers", shell.layers, "Layers on each side")
      ->check(whole_number_in(1, 1000))
      ->type_name("N")
      ->capture_default_str();
  verb.add_option("--growth", shell.growth, "Thickness of a layer relative to that of the next one toward the surface")
      ->check(number_in(0.01, 100.0))
      ->type_name("FACTOR")
      ->capture_default_str();
  verb.add_option("--first-height", arguments.first_height,
                  "Thickness of the layer at the surface, as a length or 2%: the growth follows from --layers, or the\n"
                  "layers from --growth")
      ->type_name("H");
}

/// Adds the options that tell where on the surface the layers grow, and to which side.
void add_surface_options(CLI::App& verb, ShellArguments& arguments) {
  verb.add_option("--region", arguments.region,
                  "Grow on the boundary of this region of SURFACE, which may be a mesh of cells: its name or number\n"
                  "(default: on the outer surface)")
      ->type_name("NAME");
  verb.add_option(
          "--skip", arguments.skipped,
          "Patch of SURFACE without layers: a group's name or number, or a point X,Y,Z on a patch between sharp\n"
          "edges; may be given several times. Layers end in its plane if it is flat")
      ->allow_extra_args(false)
      ->type_name("PATCH");
  verb.add_option("--repair", arguments.repair,
                  "Faults of the surface are repaired by changes within this distance, a length or 2%; 0: no repair")
      ->type_name("DISTANCE")
      ->capture_default_str();
  verb.add_option("--side", arguments.side, "Along the normals of the faces, against them, or both")
      ->check(CLI::IsMember({"outward", "inward", "both"}))
      ->type_name("outward|inward|both")
      ->capture_default_str();
}

/// Adds the options that tell how columns of cells stand on the surface, and what they keep of it.
void add_column_options(CLI::App& verb, ShellArguments& arguments) {
  verb.add_flag("--free-surface", arguments.shell.free_surface,
                "Let the surface's vertices slide along it for better cells; its border and creases stay");
  verb.add_flag("--straight", arguments.straight, "Straight columns only: no optimization");
  verb.add_option("--crease-angle", arguments.crease_angle_degrees,
                  "Edges of the surface sharper than this become creases (default: only those the file tags)")
      ->check(number_in(0.0, 180.0))
      ->type_name("DEGREES");
}

/// Adds the options of curved cells.
void add_curved_layer_options(CLI::App& verb, ShellArguments& arguments) {
  CLI::Option* order = verb.add_option("--order", arguments.order,
                                       "Order of the cells; above 1 they are curved, but for the surface itself")
                           ->check(whole_number_in(1, kMaxOrder))
                           ->type_name("P")
                           ->capture_default_str();
  verb.add_option("--basis", arguments.basis, "Modes of curved cells")
      ->check(CLI::IsMember({"fourier", "legendre"}))
      ->type_name("fourier|legendre")
      ->capture_default_str()
      ->needs(order);
  add_map_tolerance(verb, arguments.writing)->needs(order);
}

/// Adds the options that limit steps and time.
void add_shell_limits(CLI::App& verb, ShellOptions& shell) {
  verb.add_option("--max-iterations", shell.control.max_iterations, "Steps per solve (default: 60)")
      ->check(whole_number_in(1, 1'000'000))
      ->type_name("N");
  verb.add_option("--time-limit", shell.control.time_limit_seconds, "Stop after this time with the best result so far")
      ->check(number_in(1e-3, 1e9))
      ->type_name("SECONDS");
}

}  // namespace

void add_shell_command(CLI::App& app, Action& action) {
  CLI::App* verb = app.add_subcommand("shell", "Grow layers of prisms or hexes on a surface");
  const auto arguments = std::make_shared<ShellArguments>();
  verb->add_option("SURFACE", arguments->surface,
                   "Triangles and quads: " + surface_formats() + "; or a volume mesh, for its boundary")
      ->required()
      ->type_name("FILE");
  add_thickness_options(*verb, *arguments);
  add_surface_options(*verb, *arguments);
  add_column_options(*verb, *arguments);
  add_curved_layer_options(*verb, *arguments);
  add_shell_limits(*verb, arguments->shell);
  add_output_options(*verb, arguments->run,
                     "The layers, or their sheets, by extension: " + output_formats() +
                         "; cage:FILE for the layers as a control mesh with creases, cutaway:FILE.glb for the cells\n"
                         "inside; may be given several times");
  add_writing_options(*verb, arguments->writing);
  add_long_run_options(*verb, arguments->run);
  verb->footer(R"(Example:
  subvol shell bone.off --thickness 2% --layers 3 --side both -o bone_shell.vtu -o bone_shell.glb

The shell is thinner where there is no room; the report and the files say where. What is written is checked:
every cell certified, no sheet meeting another; otherwise exit status 1.
Ctrl-C once ends with the best result so far (exit status 130), twice ends the program.)");
  verb->callback(
      [arguments, verb, &action] { action = [arguments, verb] { return ShellRun(*arguments, *verb).run(); }; });
}

}  // namespace subvol::cli
