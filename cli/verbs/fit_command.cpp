// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/automatic_template.h"
#include "cli/runs/exit_status.h"
#include "cli/verbs/automatic_fit_run.h"
#include "cli/verbs/commands.h"
#include "cli/verbs/high_order_fit_run.h"
#include "cli/verbs/subdivision_fit_run.h"
#include "cli/verbs/verb_options.h"
#include "subvol/io/label_grid_io.h"
#include "subvol/io/mesh_io.h"
#include "subvol/io/surface_io.h"
#include "subvol/templates/auto_template.h"

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <string>

namespace subvol::cli {
namespace {

constexpr const char *kAutomaticAngle = "auto", *kNoAngle = "none";

/// Options of the method by which a subdivision volume is fitted to a template.
constexpr std::array kMethodOptions{"--surface",      "--boundary", "--cage-only",      "--lambda-far",
                                    "--lambda-close", "--solver",   "--correspondence", "--energy"};

struct FitArguments {
  RunOptions run;
  WritingOptions writing;
  FitOptions fit;
  std::string target;
  TemplateSource template_mesh;
  std::string surface = "limit", boundary = "catmull-clark", solver = "newton", correspondence = "closest";
  std::string regions, point_weights = "equal", energy = "hencky", crease_angle = kAutomaticAngle;
  std::optional<std::size_t> cells;  ///< of the result, if the template is made
  double quality = kUsualQuality;
  std::optional<double> quality_floor, max_tolerance_percent, wrap_percent, size;
  int order = 0;  ///< order of curved elements; 0: a subdivision volume is fitted
  std::string basis = to_string(HighOrderFitOptions{}.basis);
  bool adaptive = false;
};

SolverKind solver_kind(const FitArguments& arguments) {
  return arguments.solver == "lbfgs" ? SolverKind::lbfgs : SolverKind::newton;
}

Correspondence correspondence(const FitArguments& arguments) {
  return arguments.correspondence == "voronoi" ? Correspondence::voronoi : Correspondence::closest;
}

PointWeights point_weights(const FitArguments& arguments) {
  return arguments.point_weights == "area" ? PointWeights::by_area : PointWeights::equal;
}

Distortion distortion(const FitArguments& arguments) {
  for (Distortion d : {Distortion::inverse_mean_ratio, Distortion::condition_number})
    if (arguments.energy == to_string(d)) return d;
  return Distortion::hencky;
}

/// The angle that --crease-angle gives; `automatic` for "auto".
std::optional<double> crease_angle(const FitArguments& arguments, std::optional<double> automatic) {
  if (arguments.crease_angle == kAutomaticAngle) return automatic;
  if (arguments.crease_angle == kNoAngle) return std::nullopt;
  return std::stod(arguments.crease_angle);
}

/// Which edges a template that is made from the target is to follow.
AutomaticFitOptions template_options(const FitArguments& arguments) {
  AutomaticFitOptions options;
  options.crease_angle_degrees = crease_angle(arguments, kUsualCreaseAngle);
  options.follows_all_edges = arguments.crease_angle != kAutomaticAngle;
  options.keeps_groups = arguments.fit.keeps_groups;
  options.tuning = arguments.fit.tuning;
  return options;
}

void add_method_options(CLI::App& verb, FitArguments& arguments) {
  FitOptions& fit = arguments.fit;
  verb.add_option("--levels", fit.levels,
                  "Times the template is subdivided. Without --template, the result is then a cage and its mesh\n"
                  "(1 if only an output asks for a cage)")
      ->check(whole_number_in(1, 6))
      ->type_name("L")
      ->capture_default_str();
  verb.add_option(
          "--tolerance", fit.tolerance_percent,
          "Mean distance to reach, in percent of the diagonal of the target's bounding box; exit status 4 if missed")
      ->check(number_in(1e-9, 100.0))
      ->type_name("PERCENT");
  verb.add_option("--max-tolerance", arguments.max_tolerance_percent,
                  "The same for the largest distance; only without a template")
      ->check(number_in(1e-9, 100.0))
      ->type_name("PERCENT");
  verb.add_option("--quality", arguments.quality, "Least scaled Jacobian to aim at, as far as distances allow; 0: none")
      ->check(number_in(0.0, kMostQuality))
      ->type_name("Q")
      ->capture_default_str();
  verb.add_option("--quality-floor", arguments.quality_floor,
                  "Exit status 4 if the least scaled Jacobian is below this")
      ->check(number_in(-1.0, 1.0))
      ->type_name("Q");
  verb.add_option("--surface", arguments.surface,
                  "What is to agree with the target: the cage's limit surface, or the finest mesh itself")
      ->check(CLI::IsMember({"limit", "mesh"}))
      ->type_name("limit|mesh")
      ->capture_default_str();
  verb.add_option("--boundary", arguments.boundary, "How boundary vertices are subdivided")
      ->check(CLI::IsMember({"catmull-clark", "averaging"}))
      ->type_name("catmull-clark|averaging")
      ->capture_default_str();
  verb.add_flag("--cage-only", fit.cage_only, "Keep the template as control cage: only its vertices move");
  verb.add_option(
          "--crease-angle", arguments.crease_angle,
          "Keep edges of the target sharper than this sharp: edges of the mesh that follow them become creases\n"
          "and are drawn to them. auto: without a template, 40 if the target is a designed part and no scan;\n"
          "with one, only the creases that its file tags")
      ->check(number_in(0.0, 180.0) | CLI::IsMember({kAutomaticAngle, kNoAngle}))
      ->type_name("DEGREES|auto|none")
      ->capture_default_str();
  verb.add_flag("--keep-groups", fit.keeps_groups,
                "Keep borders between groups of the target's faces in the same way, also where the surface is smooth");
}

void add_high_order_options(CLI::App& verb, FitArguments& arguments) {
  const auto group = "Curved elements";
  CLI::Option* order = verb.add_option("--order", arguments.order,
                                       "Fit curved elements, orders raised up to P, in place of a subdivision volume")
                           ->check(whole_number_in(1, kMaxOrder))
                           ->type_name("P")
                           ->group(group);
  verb.add_option("--basis", arguments.basis, "Modes of the curved elements")
      ->check(CLI::IsMember({"fourier", "legendre"}))
      ->type_name("fourier|legendre")
      ->capture_default_str()
      ->needs(order)
      ->group(group);
  add_map_tolerance(verb, arguments.writing)->needs(order)->group(group);
  verb.add_flag("--adaptive", arguments.adaptive, "Raise orders only where it pays, up to P")
      ->needs(order)
      ->group(group);
  for (const char* other : {"--levels", "--surface", "--boundary", "--cage-only", "--lambda-far"})
    order->excludes(verb.get_option(other));
}

/// The number of cells to ask a template for that is subdivided `levels` times.
std::optional<std::size_t> template_cells(const FitArguments& arguments, int levels) {
  if (!arguments.cells) return std::nullopt;
  return std::clamp(*arguments.cells >> (3 * levels), kLeastTemplateCells, kMostTemplateCells);
}

/// True if nothing on the command line asks for a template, curved elements or a certain method.
bool is_automatic(const FitArguments& arguments, const CLI::App& verb) {
  if (!arguments.template_mesh.path.empty() || arguments.order > 0) return false;
  return std::ranges::none_of(kMethodOptions, [&](const char* option) { return verb.count(option) > 0; });
}

/// True if the result of an automatic fit is to be a subdivision volume; if not, every vertex is free.
bool makes_cage(const FitArguments& arguments, const CLI::App& verb) {
  return verb.count("--levels") > 0 || std::ranges::any_of(arguments.run.outputs, [](const std::string& output) {
           return output.starts_with("cage:") || (output.starts_with("animation:") && !output.ends_with(".html"));
         });
}

/// UsageError: an option was given that has a meaning only for automatic fits.
void refuse_automatic_options(const CLI::App& verb) {
  for (const std::string option : {"--max-tolerance", "--size", "--regions", "--wrap"})
    if (verb.count(option) > 0)
      throw UsageError(option +
                       ": only an automatic fit takes this option: leave out --template, --order and options of the "
                       "method (such as --cage-only)");
}

AutomaticFitArguments automatic_arguments(const FitArguments& arguments, const CLI::App& verb) {
  AutomaticFitArguments result{arguments.run,
                               arguments.writing,
                               {},
                               arguments.fit.tolerance_percent,
                               arguments.max_tolerance_percent,
                               arguments.quality_floor,
                               arguments.target,
                               arguments.wrap_percent,
                               arguments.size};
  result.fit = template_options(arguments);
  AutomaticFitOptions& fit = result.fit;
  fit.cells = arguments.cells;
  fit.regions = region_rule(arguments.regions);
  fit.quality = arguments.quality;
  fit.makes_cage = makes_cage(arguments, verb);
  if (verb.count("--levels") > 0) fit.levels = arguments.fit.levels;
  fit.mean_tolerance_percent = arguments.fit.tolerance_percent.value_or(kAutomaticMeanPercent);
  fit.max_tolerance_percent = arguments.max_tolerance_percent.value_or(kAutomaticMaxPercent);
  fit.control = arguments.fit.control;
  result.unused_options = {"basis", "map-tolerance", "adaptive"};
  for (const std::string option : kMethodOptions) result.unused_options.push_back(option.substr(2));
  if (!fit.makes_cage) result.unused_options.push_back("levels");
  return result;
}

/// Arguments of the same run with curved elements, for which lambda has another default.
HighOrderFitArguments high_order_arguments(const FitArguments& arguments, const CLI::App& verb) {
  HighOrderFitArguments result{arguments.run, arguments.writing, {}, arguments.target, arguments.template_mesh};
  result.quality_floor = arguments.quality_floor;
  result.template_fit = template_options(arguments);
  HighOrderFitOptions& fit = result.fit;
  fit.quality = arguments.quality;
  fit.order = arguments.order;
  fit.basis = arguments.basis == "legendre" ? Basis::legendre : Basis::fourier;
  fit.adaptive = arguments.adaptive;
  fit.tolerance_percent = arguments.fit.tolerance_percent;
  if (verb.count("--lambda-close") > 0) fit.lambda_close = arguments.fit.lambda_close;
  fit.crease_angle_degrees = arguments.fit.crease_angle_degrees;
  fit.keeps_groups = arguments.fit.keeps_groups;
  fit.solver = solver_kind(arguments);
  fit.correspondence = correspondence(arguments);
  fit.point_weights = point_weights(arguments);
  fit.distortion = distortion(arguments);
  fit.control = arguments.fit.control;
  fit.memory_limit_bytes = static_cast<double>(arguments.run.memory_limit);
  fit.tuning = arguments.fit.tuning;
  return result;
}

/// Arguments of the same run with a subdivision volume.
SubdivisionFitArguments subdivision_arguments(const FitArguments& arguments, const CLI::App& verb) {
  SubdivisionFitArguments result{arguments.run,           arguments.writing, arguments.fit,          arguments.target,
                                 arguments.template_mesh, arguments.cells,   arguments.quality_floor};
  result.template_fit = template_options(arguments);
  FitOptions& fit = result.fit;
  fit.frees_mesh = !fit.cage_only && verb.count("--surface") == 0;
  fit.surface = arguments.surface == "limit" ? FittedSurface::limit : FittedSurface::mesh;
  fit.boundary = arguments.boundary == "averaging" ? BoundaryRule::averaging : BoundaryRule::catmull_clark;
  fit.solver = solver_kind(arguments);
  fit.correspondence = correspondence(arguments);
  fit.point_weights = point_weights(arguments);
  fit.distortion = distortion(arguments);
  return result;
}

int run_fit(const FitArguments& given, const CLI::App& verb) {
  FitArguments arguments = given;
  if (is_automatic(given, verb)) return run_automatic_fit(automatic_arguments(given, verb), verb);
  refuse_automatic_options(verb);
  arguments.fit.crease_angle_degrees = crease_angle(given, std::nullopt);
  arguments.fit.quality = given.quality;
  arguments.template_mesh.cells = template_cells(given, given.order > 0 ? 0 : arguments.fit.levels);
  return given.order > 0 ? run_high_order_fit(high_order_arguments(arguments, verb), verb)
                         : run_subdivision_fit(subdivision_arguments(arguments, verb), verb);
}

void add_solver_options(CLI::App& verb, FitArguments& arguments) {
  FitOptions& fit = arguments.fit;
  const auto group = "Solver";
  verb.add_option("--lambda-far", fit.lambda_far,
                  "Upper limit of the weight of the cells' shape while a level is started")
      ->check(number_in(1e-9, 1e9))
      ->type_name("W")
      ->capture_default_str()
      ->group(group);
  verb.add_option(
          "--lambda-close", fit.lambda_close,
          "Weight of the cells' shape in the last stage; lowered further while the mean distance is above --tolerance\n"
          "(0.015 if none is given) and falls by more than the cells' distortion rises. With --order: 0.05, or\n"
          "0.0025 if creases follow nearly all sharp edges, lowered for a --tolerance and volumes of regions")
      ->check(number_in(1e-9, 1e9))
      ->type_name("W")
      ->capture_default_str()
      ->group(group);
  verb.add_option("--solver", arguments.solver, "How energies are minimized")
      ->check(CLI::IsMember({"newton", "lbfgs"}))
      ->type_name("newton|lbfgs")
      ->capture_default_str()
      ->group(group);
  verb.add_option("--correspondence", arguments.correspondence,
                  "How correspondences are chosen: exact closest points both ways, or the restricted Voronoi cells of "
                  "the paper")
      ->check(CLI::IsMember({"closest", "voronoi"}))
      ->type_name("closest|voronoi")
      ->capture_default_str()
      ->group(group);
  verb.add_option("--energy", arguments.energy,
                  "How cells' distortion is measured: hencky keeps shapes and sizes, the others shapes alone")
      ->check(CLI::IsMember({"hencky", "inverse_mean_ratio", "condition_number"}))
      ->type_name("hencky|inverse_mean_ratio|condition_number")
      ->capture_default_str()
      ->group(group);
  verb.add_option(
          "--point-weights", arguments.point_weights,
          "How much each point of a cloud counts: all alike, or by the area that it represents, for uneven scans")
      ->check(CLI::IsMember({"equal", "area"}))
      ->type_name("equal|area")
      ->capture_default_str()
      ->group(group);
  verb.add_option("--max-iterations", fit.control.max_iterations,
                  "Steps per stage (default: as many as the schedule asks for)")
      ->check(whole_number_in(1, 1'000'000))
      ->type_name("N")
      ->group(group);
  verb.add_option("--time-limit", fit.control.time_limit_seconds, "Stop after this time with the best result so far")
      ->check(number_in(1e-3, 1e9))
      ->type_name("SECONDS")
      ->group(group);
}

}  // namespace

void add_fit_command(CLI::App& app, Action& action) {
  CLI::App* verb =
      app.add_subcommand("fit", "Fill a surface with cells, or deform a template until its boundary reproduces it");
  const auto arguments = std::make_shared<FitArguments>();
  verb->add_option("TARGET", arguments->target,
                   "Surface to reproduce: " + surface_formats() + "; a volume mesh, for its boundary; points: " +
                       point_cloud_formats() + "; or, without a template, a segmentation: " + label_grid_formats())
      ->required()
      ->type_name("FILE");
  CLI::Option* file =
      verb->add_option("--template", arguments->template_mesh.path,
                       "Coarse mesh to start from: " + volume_mesh_formats() + " (default: made from the target)")
          ->type_name("MESH");
  verb->add_option("--cells", arguments->cells,
                   "How many cells the result has at most; about so many with --order or options of the method\n"
                   "(default: as many as it needs)")
      ->check(whole_number_in(kLeastTemplateCells, kMostRequestedCells))
      ->type_name("N")
      ->excludes(file);
  verb->add_option("--size", arguments->size,
                   "The same by the edge length of the cells, in the target's unit; only without a template")
      ->check(number_in(1e-30, 1e30))
      ->type_name("LENGTH")
      ->excludes(file)
      ->excludes(verb->get_option("--cells"));
  add_references_option(*verb, arguments->run)->needs(file);
  add_regions_option(*verb, arguments->regions);
  add_wrap_option(*verb, arguments->wrap_percent);
  add_method_options(*verb, *arguments);
  add_solver_options(*verb, *arguments);
  add_high_order_options(*verb, *arguments);
  add_tune_option(*verb, arguments->fit.tuning);
  add_output_options(
      *verb, arguments->run,
      "Finest mesh, or its surface, by extension: " + output_formats() +
          "; cage:FILE for the control cage, cutaway:FILE.glb for the cells inside, animation:FILE.glb or .html\n"
          "for the fit as it went, region:NAME:FILE for the cells of one region; may be given several times");
  add_writing_options(*verb, arguments->writing);
  add_long_run_options(*verb, arguments->run);
  add_checkpoint_options(*verb, arguments->run);
  verb->footer(R"(Example:
  subvol fit bone.off --template bone.mesh --levels 3 -o bone.glb -o cage:bone_cage.usda -o bone_fine.mesh

  subvol fit bone.off -o bone.mesh -o bone.glb     (as good as possible, without a template)
  subvol fit bone.off --levels 2 -o cage:bone.usda (with a template made from the surface)
  subvol fit bone.off --template bone.mesh --order 4 -o bone.vtu -o bone.glb

Ctrl-C once ends the fit with the best result so far (exit status 130), twice ends the program.
--config FILE.toml reads options from a file: key = value, keys being the long names above.)");
  verb->callback([arguments, verb, &action] { action = [arguments, verb] { return run_fit(*arguments, *verb); }; });
}

}  // namespace subvol::cli
