// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/writing.h"
#include "cli/verbs/commands.h"
#include "cli/verbs/optimize_run.h"
#include "cli/verbs/verb_options.h"
#include "subvol/fit/optimize_mesh.h"
#include "subvol/io/mesh_io.h"
#include "subvol/io/surface_io.h"

#include <algorithm>
#include <iostream>
#include <memory>
#include <optional>

namespace subvol::cli {

using namespace internal;
namespace {

/// Adds the options that tell what the boundary is to be like, and the sizes of the cells.
void add_boundary_options(CLI::App& verb, OptimizeArguments& arguments) {
  OptimizeOptions& optimize = arguments.optimize;
  CLI::Option* target = verb.add_option("--target", arguments.target,
                                        "Surface that the boundary is to reproduce: " + surface_formats() +
                                            "; or a volume mesh, for its boundary (default: the boundary as it is)")
                            ->type_name("SURFACE");
  verb.add_flag("--fixed-boundary", optimize.fixed_boundary,
                "Keep boundary vertices where they are; otherwise they slide along the surface")
      ->excludes(target);
  verb.add_option("--sizes", arguments.sizes,
                  "Ideal sizes of the cells: all alike, or as they are, so that graded meshes stay graded")
      ->check(CLI::IsMember({"uniform", "local"}))
      ->type_name("uniform|local")
      ->capture_default_str();
  verb.add_option("--crease-angle", optimize.crease_angle_degrees, "Keep edges of the surface sharper than this sharp")
      ->check(number_in(0.0, 180.0))
      ->type_name("DEGREES")
      ->capture_default_str();
}

/// Adds the options that set aims and weigh them.
void add_goal_options(CLI::App& verb, OptimizeOptions& optimize) {
  verb.add_option("--tolerance", optimize.mean_tolerance_percent,
                  "Mean distance from the surface to keep within, in percent of the diagonal of its bounding box;\n"
                  "exit status 4 if missed")
      ->check(number_in(1e-9, 100.0))
      ->type_name("PERCENT")
      ->capture_default_str();
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
}

/// Adds the options that limit steps and time.
void add_optimize_limits(CLI::App& verb, OptimizeOptions& optimize) {
  verb.add_option("--max-iterations", optimize.control.max_iterations,
                  "Steps per stage (default: as many as the schedule asks for)")
      ->check(whole_number_in(1, 1'000'000))
      ->type_name("N");
  verb.add_option("--time-limit", optimize.control.time_limit_seconds,
                  "Stop after this time with the best result so far")
      ->check(number_in(1e-3, 1e9))
      ->type_name("SECONDS");
}

/// Adds the options of curved cells. Call it last: they need and exclude options that exist by then.
void add_curved_element_options(CLI::App& verb, OptimizeArguments& arguments) {
  const auto group = "Curved elements";
  CLI::Option* order =
      verb.add_option("--order", arguments.order, "Curve the cells to this order so that they follow --target")
          ->check(whole_number_in(2, kMaxOrder))
          ->type_name("P")
          ->needs(verb.get_option("--target"))
          ->group(group);
  verb.add_option("--basis", arguments.basis, "Modes of the curved elements")
      ->check(CLI::IsMember({"fourier", "legendre"}))
      ->type_name("fourier|legendre")
      ->capture_default_str()
      ->needs(order)
      ->group(group);
  add_map_tolerance(verb, arguments.writing)->needs(order)->group(group);
  for (const char* other : {"--fixed-boundary", "--sizes", "--max-tolerance"}) order->excludes(verb.get_option(other));
}

}  // namespace

void add_optimize_command(CLI::App& app, Action& action) {
  CLI::App* verb = app.add_subcommand("optimize", "Untangle and improve a volume mesh, or curve it");
  const auto arguments = std::make_shared<OptimizeArguments>();
  verb->add_option("MESH", arguments->mesh, "Hexes, prisms, tets and pyramids, linear or curved: " + cell_formats())
      ->required()
      ->type_name("FILE");
  add_references_option(*verb, arguments->run);
  add_boundary_options(*verb, *arguments);
  add_goal_options(*verb, arguments->optimize);
  add_optimize_limits(*verb, arguments->optimize);
  add_curved_element_options(*verb, *arguments);
  add_tune_option(*verb, arguments->optimize.tuning);
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

What is written is checked: exit status 1 if a cell is not proved positive or the boundary meets itself.
Ctrl-C once ends with the best result so far (exit status 130), twice ends the program.)");
  verb->callback(
      [arguments, verb, &action] { action = [arguments, verb] { return run_optimize(*arguments, *verb); }; });
}

}  // namespace subvol::cli
