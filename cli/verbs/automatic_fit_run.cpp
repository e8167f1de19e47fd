// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/verbs/automatic_fit_run.h"

#include "cli/runs/automatic_fit_report.h"
#include "cli/runs/check_report.h"
#include "cli/runs/checkpointing.h"
#include "cli/runs/diagnosis_report.h"
#include "cli/runs/exit_status.h"
#include "cli/runs/face_groups.h"
#include "cli/runs/interrupt.h"
#include "cli/runs/loading.h"
#include "cli/runs/report.h"
#include "cli/runs/written_result.h"
#include "cli/verbs/cage_run.h"
#include "cli/verbs/verb_options.h"
#include "subvol/base/format.h"
#include "subvol/base/version.h"
#include "subvol/io/label_grid_io.h"
#include "subvol/io/nodal_mesh.h"
#include "subvol/io/surface_io.h"
#include "subvol/subdivision/audit.h"
#include "subvol/surface/solid_topology.h"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <optional>
#include <utility>

namespace subvol::cli {

using namespace internal;
namespace {

/// One run, from its input file to its output files.
class AutomaticFitRun : public CageRun {
 public:
  AutomaticFitRun(const AutomaticFitArguments& arguments, const CLI::App& verb)
      : CageRun(arguments.run, verb), arguments_(arguments) {}
  int run();

 private:
  void load();
  const TriangleMesh& surface() const { return regions_ ? outer_ : target_; }
  void fit();
  void write();
  void check();
  Json report() const;
  Json used(Json options) const;
  void summarize() const;
  bool has_cage() const { return result_.cage.num_cells() > 0; }

  const AutomaticFitArguments& arguments_;
  TriangleMesh target_;                   ///< repaired
  std::optional<RegionSurface> regions_;  ///< of the target, if there are several
  TriangleMesh outer_;                    ///< the target's surface without its interfaces, if there are regions
  std::vector<std::string> repairs_;      ///< made to the target
  std::optional<Checkpointing> checkpointing_;
  AutomaticFitResult result_;
  GroupsFound groups_;
  MeshCheck mesh_check_;
};

void AutomaticFitRun::load() {
  bool has_only_points = false;
  if (!is_label_grid_file(arguments_.target)) {
    require_known_file(arguments_.target);
    has_only_points = !is_nodal_extension(arguments_.target) && is_point_cloud_file(arguments_.target);
  }
  require_fitting_options(verb_, has_only_points);
  if (has_only_points) throw UsageError("points do not tell what they enclose: give a coarse mesh with --template");
  SurfaceRepair repair = load_to_fill(arguments_.target, {arguments_.fit.regions, arguments_.wrap_percent}, warnings_);
  target_ = std::move(repair.surface);
  warn_of_missing_groups(verb_, target_, warnings_);
  regions_ = std::move(repair.regions);
  if (regions_) outer_ = outer_surface(*regions_);
  require_regions(outputs_, regions_ ? regions_->regions : std::vector<Group>{});
  add_remarks(repair, warnings_);
  repairs_ = std::move(repair.done);
}

/// Returns the number of cubes of an edge length that fill a volume. UsageError: there are too many.
std::size_t cells_of_size(double volume, double size) {
  const double cells = volume / std::pow(size, 3);
  if (!(cells <= static_cast<double>(kMostRequestedCells)))
    throw UsageError(formatted("--size %g: the target would need %.3g cells, expected at most %zu", size, cells,
                               kMostRequestedCells));
  return std::max(kLeastTemplateCells, static_cast<std::size_t>(std::lround(cells)));
}

void AutomaticFitRun::fit() {
  AutomaticFitOptions options = arguments_.fit;
  if (arguments_.size) options.cells = cells_of_size(solid_boundary(surface()).volume, *arguments_.size);
  checkpointing_.emplace(run_, run_identity(verb_, {{"target", fingerprint(target_)}}));
  options.control.log = checkpointing_->log();
  options.keep_states = has_animation(outputs_);
  options.regions = RegionRule::merge;  // they were found when the target was read
  result_ = followed(options.control,
                     [&] { return regions_ ? fit_regions(*regions_, options) : fit_automatically(target_, options); });
  checkpointing_->finish(result_.report.warnings);
  add_warnings(result_.report.warnings);
  groups_ = carry_groups(surface(), result_.mesh);
  if (has_cage()) carry_groups(surface(), result_.cage);
  add_warnings(groups_.warnings);
  add_warnings_of_names(marks_of(result_.mesh));
}

void AutomaticFitRun::write() {
  WritingOptions writing = arguments_.writing;
  writing.source = arguments_.target;
  writing.options = used(options_of_result(verb_));
  write_results(result_.cage, result_.mesh, result_.states, writing);
}

void AutomaticFitRun::check() {
  const std::optional<VolumeMesh> written = written_cells(outputs_);
  const VolumeMesh& mesh = written ? *written : result_.mesh;
  mesh_check_ = watched([&](auto progress) {
    return check_mesh(mesh, &surface(), {.audits_subdivision = has_cage(), .progress = progress});
  });
  if (has_cage()) {
    measure_limit(result_.cage, surface(), arguments_.writing);
    hold_to(arguments_.mean_tolerance_percent, "the limit surface's mean",
            limit_.mean_percent(mesh_check_.target_diagonal), result_.report);
  }
  hold_to({arguments_.mean_tolerance_percent, arguments_.max_tolerance_percent}, mesh_check_, result_.report);
  hold_to_quality(arguments_.least_quality, mesh_check_, result_.report);
}

/// Returns the options without those that play no part.
Json AutomaticFitRun::used(Json options) const {
  for (const std::string& name : arguments_.unused_options) options.erase(name);
  return options;
}

Json AutomaticFitRun::report() const {
  Json json{{"subvol", version()},
            {"command", "fit"},
            {"options", used(options_in_force(verb_))},
            {"input", {{"target", describe(arguments_.target, target_)}}},
            {"repairs", repairs_}};
  json.update(automatic_fit_json(result_));
  json.update(fit_json(result_.report));
  json.update(check_json(mesh_check_));
  if (mesh_check_.regions && regions_) {
    const RegionReport wanted = measure_regions(*regions_);
    json["regions"] = regions_json(*mesh_check_.regions, &wanted, "target");
  }
  if (has_cage()) {
    json.update(cage_json(result_.cage, limit_, mesh_check_.target_diagonal));
    json["audit"] = audit_json(audit(result_.cage));
  }
  if (!groups_.groups.empty()) json["groups"] = groups_json(groups_.groups);
  checkpointing_->describe(json);
  return json;
}

void AutomaticFitRun::summarize() const {
  std::cerr << to_string(result_.report.stop_reason) << ": " << result_.report.explanation << '\n'
            << to_text(mesh_check_);
  if (has_cage()) std::cerr << to_text(limit_, mesh_check_.target_diagonal);
  if (result_.report.creases) std::cerr << to_text(*result_.report.creases);
  tell_outputs();
}

int AutomaticFitRun::run() {
  prepare({Part::cage, Part::cutaway, Part::animation, Part::boundary, Part::region});
  timed("read", &AutomaticFitRun::load);
  tell_warnings();
  timed("fit", &AutomaticFitRun::fit);
  if (result_.mesh.num_cells() == 0)  // nothing has been fitted yet
    throw EndedEarly("nothing to write: " + result_.report.explanation,
                     result_.report.stop_reason == StopReason::cancelled ? kInterrupted : kNotConverged);
  timed("write", &AutomaticFitRun::write);
  timed("check", &AutomaticFitRun::check);
  write_report(report(), seconds_json(result_.report));
  if (!run_.quiet) summarize();
  require_outputs();
  return status(result_.report, mesh_check_.valid());
}

}  // namespace

int run_automatic_fit(const AutomaticFitArguments& arguments, const CLI::App& verb) {
  return AutomaticFitRun(arguments, verb).run();
}

}  // namespace subvol::cli
