// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/check_report.h"
#include "cli/runs/checkpointing.h"
#include "cli/runs/exit_status.h"
#include "cli/runs/face_groups.h"
#include "cli/runs/loading.h"
#include "cli/runs/losses.h"
#include "cli/runs/report.h"
#include "cli/runs/writing.h"
#include "cli/runs/written_result.h"
#include "cli/verbs/commands.h"
#include "cli/verbs/high_order_fit_run.h"
#include "cli/verbs/long_run.h"
#include "cli/verbs/verb_options.h"
#include "subvol/base/version.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/fit/optimize_mesh.h"
#include "subvol/fit/untangle_before_fit.h"
#include "subvol/io/mesh_io.h"
#include "subvol/io/surface_io.h"
#include "subvol/surface/boundary.h"

#include <algorithm>
#include <iostream>
#include <memory>
#include <optional>

namespace subvol::cli {

using namespace internal;
namespace {

struct OptimizeArguments {
  RunOptions run;
  WritingOptions writing;
  OptimizeOptions optimize;
  std::string mesh, target, sizes = "local", basis = to_string(HighOrderFitOptions{}.basis);
  int order = 1;
};

/// One run of `optimize`, from its input files to its output files.
class OptimizeRun : public LongRun {
 public:
  OptimizeRun(const OptimizeArguments& arguments, const CLI::App& verb)
      : LongRun(arguments.run, verb), arguments_(arguments) {}
  int run();

 private:
  void load();
  void optimize();
  void write();
  void check();
  Json report() const;
  void summarise() const;

  const OptimizeArguments& arguments_;
  VolumeMesh mesh_;
  std::optional<TriangleMesh> target_;
  TriangleMesh surface_;  ///< compared with the boundary: the target, or the original boundary
  QualityReport before_;
  std::optional<Checkpointing> checkpointing_;
  OptimizeResult result_;
  GroupsFound groups_;
  MeshCheck mesh_check_;
};

void OptimizeRun::load() {
  mesh_ = load_volume(arguments_.mesh, warnings_, true, arguments_.run.references);
  require_regions(outputs_, regions_of(mesh_));
  warn_of_losses(marks_of(mesh_), marks_of(mesh_), outputs_, warnings_);
  if (!arguments_.target.empty()) target_ = load_surface(arguments_.target, warnings_);
  surface_ = target_ ? *target_ : fan_triangles(boundary_surface(mesh_, MeshTopology(mesh_)));
  before_ = measure_quality(mesh_);
  tell_warnings();
}

void OptimizeRun::optimize() {
  OptimizeOptions options = arguments_.optimize;
  options.sizes = arguments_.sizes == "uniform" ? CellSizes::uniform : CellSizes::local;
  std::vector<std::pair<std::string, std::string>> inputs{{"mesh", fingerprint(mesh_)}};
  if (target_) inputs.emplace_back("target", fingerprint(*target_));
  checkpointing_.emplace(run_, run_identity(verb_, inputs));
  options.log = checkpointing_->log();
  result_ = followed([&](auto progress) {
    options.progress = progress;
    options.cancelled = interrupted;
    return optimize_mesh(mesh_, target_ ? &*target_ : nullptr, options);
  });
  checkpointing_->finish(result_.report.warnings);
  add_warnings(result_.report.warnings);
  if (target_) groups_ = carry_groups(*target_, result_.mesh);
  add_warnings(groups_.warnings);
}

void OptimizeRun::write() {
  WritingOptions writing = arguments_.writing;
  writing.source = arguments_.mesh;
  writing.options = options_of_result(verb_);
  write_each([&](const Output& output) { write_output(output, result_.mesh, writing); });
}

void OptimizeRun::check() {
  const std::optional<VolumeMesh> written = written_cells(outputs_);
  const VolumeMesh& mesh = written ? *written : result_.mesh;
  mesh_check_ = watched([&](auto progress) { return check_mesh(mesh, &surface_, {.progress = progress}); });
  const OptimizeOptions& asked = arguments_.optimize;
  if (!asked.fixed_boundary)
    hold_to({asked.mean_tolerance_percent, asked.max_tolerance_percent}, mesh_check_, result_.report);
  add_warnings(warnings_of_quality(asked.quality, mesh_check_));
}

Json OptimizeRun::report() const {
  Json json{{"subvol", version()},
            {"command", "optimize"},
            {"options", options_in_force(verb_)},
            {"input", {{"mesh", describe(arguments_.mesh, mesh_)}, {"quality", quality_json(before_)}}}};
  if (target_) json["input"]["target"] = describe(arguments_.target, *target_);
  json.update(fit_json(result_.report));
  json.update(check_json(mesh_check_));
  if (mesh_check_.regions) {
    const RegionReport start = measure_regions(mesh_, &before_);
    json["regions"] = regions_json(*mesh_check_.regions, &start);
  }
  if (!groups_.groups.empty()) json["groups"] = groups_json(groups_.groups);
  checkpointing_->describe(json);
  json["not_certified_cells"] = not_certified_cells(mesh_check_);
  return json;
}

void OptimizeRun::summarise() const {
  constexpr std::size_t kMostNamed = 10;
  std::cerr << to_string(result_.report.stop_reason) << ": " << result_.report.explanation << '\n'
            << "before: " << before_.inverted_cells << " cells inverted, scaled Jacobian min "
            << before_.min_scaled_jacobian << ", mean " << before_.mean_scaled_jacobian << '\n'
            << to_text(mesh_check_);
  const std::vector<Index> left = not_certified_cells(mesh_check_);
  for (std::size_t i = 0; i < std::min(left.size(), kMostNamed); ++i)
    std::cerr << "cell " << left[i] << " is not proved positive\n";
  tell_outputs();
}

int OptimizeRun::run() {
  prepare({Part::cutaway, Part::boundary, Part::region});
  timed("read", &OptimizeRun::load);
  timed("optimize", &OptimizeRun::optimize);
  timed("write", &OptimizeRun::write);
  timed("check", &OptimizeRun::check);
  write_report(report());
  if (!arguments_.run.quiet) summarise();
  require_outputs();
  return status(result_.report, mesh_check_.valid());
}

/// Curves a mesh by fitting curved elements with the mesh as the template.
HighOrderFitArguments curving_arguments(const OptimizeArguments& arguments, const CLI::App& verb) {
  HighOrderFitArguments result{
      arguments.run, arguments.writing, {}, arguments.target, {arguments.mesh, std::nullopt}, "optimize", true, false};
  HighOrderFitOptions& fit = result.fit;
  fit.order = arguments.order;
  fit.basis = arguments.basis == "legendre" ? Basis::legendre : Basis::fourier;
  fit.tolerance_percent = arguments.optimize.mean_tolerance_percent;
  fit.quality = arguments.optimize.quality;
  fit.crease_angle_degrees = arguments.optimize.crease_angle_degrees;
  fit.follows_all_edges = verb.count("--crease-angle") > 0;
  fit.lambda_close = verb.count("--lambda") > 0 ? arguments.optimize.lambda : kCurvingLambda;
  fit.max_iterations = arguments.optimize.max_iterations;
  fit.time_limit_seconds = arguments.optimize.time_limit_seconds;
  fit.memory_limit_bytes = static_cast<double>(arguments.run.memory_limit);
  return result;
}

void add_options(CLI::App& verb, OptimizeArguments& arguments) {
  OptimizeOptions& optimize = arguments.optimize;
  CLI::Option* target =
      verb.add_option("--target", arguments.target,
                      "Surface that the boundary is to reproduce: " + surface_formats() +
                          "; or a volume mesh, for its boundary (default: the boundary as it is)")
          ->type_name("SURFACE");
  CLI::Option* fixed = verb.add_flag("--fixed-boundary", optimize.fixed_boundary,
                                     "Keep boundary vertices where they are; otherwise they slide along the surface")
                           ->excludes(target);
  CLI::Option* sizes =
      verb.add_option("--sizes", arguments.sizes,
                      "Ideal sizes of the cells: all alike, or as they are, so that graded meshes stay graded")
          ->check(CLI::IsMember({"uniform", "local"}))
          ->type_name("uniform|local")
          ->capture_default_str();
  verb.add_option("--crease-angle", optimize.crease_angle_degrees, "Keep edges of the surface sharper than this sharp")
      ->check(number_in(0.0, 180.0))
      ->type_name("DEGREES")
      ->capture_default_str();
  verb.add_option("--tolerance", optimize.mean_tolerance_percent,
                  "Mean distance from the surface to keep within, in per cent of the diagonal of its bounding box;\n"
                  "exit status 4 if missed")
      ->check(number_in(1e-9, 100.0))
      ->type_name("PERCENT")
      ->capture_default_str();
  CLI::Option* max =
      verb.add_option("--max-tolerance", optimize.max_tolerance_percent, "The same for the largest distance")
          ->check(number_in(1e-9, 100.0))
          ->type_name("PERCENT")
          ->capture_default_str();
  verb.add_option("--quality", optimize.quality, "Least scaled Jacobian to aim at, as far as distances allow; 0: none")
      ->check(number_in(0.0, kMostQuality))
      ->type_name("Q")
      ->capture_default_str();
  verb.add_option("--lambda", optimize.lambda,
                  "Weight of the cells' shape against the distance; lowered while distances are above the tolerances\n"
                  "(with --order: 0.0025)")
      ->check(number_in(1e-9, 1e9))
      ->type_name("W")
      ->capture_default_str();
  verb.add_option("--max-iterations", optimize.max_iterations,
                  "Steps per stage (default: as many as the schedule asks for)")
      ->check(CLI::Range(1, 1'000'000))
      ->type_name("N");
  verb.add_option("--time-limit", optimize.time_limit_seconds, "Stop after this time with the best result so far")
      ->check(number_in(1e-3, 1e9))
      ->type_name("SECONDS");
  const auto group = "Curved elements";
  CLI::Option* order =
      verb.add_option("--order", arguments.order, "Curve the cells to this order so that they follow --target")
          ->check(CLI::Range(2, kMaxOrder))
          ->type_name("P")
          ->needs(target)
          ->group(group);
  verb.add_option("--basis", arguments.basis, "Modes of the curved elements")
      ->check(CLI::IsMember({"fourier", "legendre"}))
      ->type_name("fourier|legendre")
      ->capture_default_str()
      ->needs(order)
      ->group(group);
  add_map_tolerance(verb, arguments.writing)->needs(order)->group(group);
  for (CLI::Option* other : {fixed, sizes, max}) order->excludes(other);
}

}  // namespace

void add_optimize_command(CLI::App& app, Action& action) {
  CLI::App* verb = app.add_subcommand("optimize", "Untangle and improve a volume mesh, or curve it");
  const auto arguments = std::make_shared<OptimizeArguments>();
  verb->add_option("MESH", arguments->mesh, "Hexes, prisms, tets and pyramids: " + volume_mesh_formats())
      ->required()
      ->type_name("FILE");
  add_references_option(*verb, arguments->run);
  add_options(*verb, *arguments);
  add_output_options(
      *verb, arguments->run,
      "The mesh, or its surface, by extension: " + output_formats() +
          "; cutaway:FILE.glb for the cells inside, boundary:FILE.vtu for the faces of the boundary with\n"
          "their groups, region:NAME:FILE for the cells of one region; may be given several times");
  add_writing_options(*verb, arguments->writing);
  add_long_run_options(*verb, arguments->run);
  add_checkpoint_options(*verb, arguments->run);
  verb->footer(R"(Examples:
  subvol optimize tangled.mesh -o valid.mesh --report valid.json
  subvol optimize tets.mesh --order 3 --target part.off -o curved.vtu

What is written is checked: exit status 1 where a cell is not proved positive or the boundary meets itself.
Ctrl-C once ends with the best result so far (exit status 130), twice ends the program.)");
  verb->callback([arguments, verb, &action] {
    action = [arguments, verb] {
      return arguments->order > 1 ? run_high_order_fit(curving_arguments(*arguments, *verb), *verb)
                                  : OptimizeRun(*arguments, *verb).run();
    };
  });
}

}  // namespace subvol::cli
