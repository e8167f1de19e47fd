// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/automatic_fit_report.h"
#include "cli/runs/check_report.h"
#include "cli/runs/diagnosis_report.h"
#include "cli/runs/face_groups.h"
#include "cli/runs/report.h"
#include "python/arrays.h"
#include "python/checkpoints.h"
#include "python/fit_options.h"
#include "python/limit.h"
#include "python/module.h"
#include "python/results.h"
#include "subvol/base/error.h"
#include "subvol/fit/automatic_fit.h"
#include "subvol/fit/mending/surface_repair.h"
#include "subvol/fit/mesh_check.h"
#include "subvol/fit/target/surface_wrap.h"
#include "subvol/subdivision/audit.h"

#include <string>
#include <utility>
#include <vector>

namespace subvol::python {
namespace {

/// One call of `fill`, from its arguments to its result.
class Filling {
 public:
  Filling(const py::object& target, const py::kwargs& given)
      : keywords_("fill", given), work_(keywords_), checkpoints_(keywords_) {
    keywords_.take("cells", options_.cells);
    keywords_.take("quality", options_.quality);
    take_crease_angle();
    keywords_.take("regions", options_.regions,
                   {{"auto", RegionRule::automatic}, {"keep", RegionRule::keep}, {"merge", RegionRule::merge}});
    std::optional<double> wrap_percent;
    keywords_.take("wrap", wrap_percent);
    keywords_.take("keep_groups", options_.keeps_groups);
    keywords_.take("cage", options_.makes_cage);
    keywords_.take("levels", options_.levels);
    keywords_.take("tolerance", options_.mean_tolerance_percent);
    keywords_.take("max_tolerance", options_.max_tolerance_percent);
    keywords_.take("max_iterations", options_.control.max_iterations);
    keywords_.take("time_limit", options_.control.time_limit_seconds);
    take_tuning(keywords_, options_.tuning);
    take_chord(keywords_, writing_);
    keywords_.finish();
    target_ = triangles_from(target, "target");
    if (wrap_percent)
      target_ = work_.run("wrap", [&] { return wrap_surface(target_, {.voxel_percent = *wrap_percent}); });
    else
      repair();
    checkpoints_.begin("fill", keywords_, {{"target", cli::fingerprint(target_)}});
  }

  std::shared_ptr<Filled> run() {
    work_.watch(options_.control);
    std::vector<std::string> warnings = std::move(remarks_);
    AutomaticFitResult found = checkpoints_.run(work_, "fit", warnings, [&](internal::StageLog* log) {
      options_.control.log = log;
      return fit_automatically(target_, options_);
    });
    if (found.mesh.num_cells() == 0) throw InputError("fill: ended before there was a mesh");
    const std::optional<RegionSurface> regions = find_regions(target_, options_.regions);
    const TriangleMesh outer = regions ? outer_surface(*regions) : target_;
    const cli::GroupsFound groups = work_.run("groups", [&] { return cli::carry_groups(outer, found.mesh); });
    const MeshCheck checked = work_.run("check", [&] { return check_mesh(found.mesh, &outer); });
    const bool has_cage = found.cage.num_cells() > 0;
    if (has_cage) cli::carry_groups(outer, found.cage);
    Json json{{"input", {{"target", cli::describe("", target_)}}}, {"repairs", repairs_}};
    json.update(cli::automatic_fit_json(found));
    json.update(cli::fit_json(found.report));
    json.update(cli::check_json(checked));
    if (regions && checked.regions) {
      const RegionReport wanted = measure_regions(*regions);
      json["regions"] = cli::regions_json(*checked.regions, &wanted, "target");
    }
    if (has_cage) {
      const cli::MeasuredLimit limit = measured_limit(found.cage, outer, writing_, work_);
      json.update(cli::cage_json(found.cage, limit, checked.target_diagonal));
      json["audit"] = cli::audit_json(audit(found.cage));
    }
    if (!groups.groups.empty()) json["groups"] = cli::groups_json(groups.groups);
    checkpoints_.describe(json);
    warnings.insert(warnings.end(), found.report.warnings.begin(), found.report.warnings.end());
    warnings.insert(warnings.end(), groups.warnings.begin(), groups.warnings.end());
    auto result = std::make_shared<Filled>();
    result->report = make_report("fill", json, keywords_, work_, warnings);
    if (has_cage) result->cage = std::make_shared<VolumeMesh>(std::move(found.cage));
    result->mesh = std::make_shared<VolumeMesh>(std::move(found.mesh));
    return result;
  }

 private:
  /// Makes the target bound a solid. Regions are looked for once: what was repaired has one.
  void repair() {
    SurfaceRepair repair =
        work_.run("repair", [&] { return repair_surface(target_, work_.cancelled(), options_.regions); });
    cli::add_remarks(repair, remarks_);
    if (!repair.regions) options_.regions = RegionRule::merge;
    target_ = std::move(repair.surface);
    repairs_ = std::move(repair.done);
  }

  /// An angle is followed on every surface, "auto" on designed parts only; a negative one means none.
  void take_crease_angle() {
    std::optional<double> angle;
    keywords_.take("crease_angle", angle);
    if (!angle) return;
    options_.follows_all_edges = true;
    options_.crease_angle_degrees = *angle < 0 ? std::nullopt : angle;
  }

  Keywords keywords_;
  Work work_;
  Checkpoints checkpoints_;
  AutomaticFitOptions options_;
  cli::WritingOptions writing_;
  TriangleMesh target_;
  std::vector<std::string> repairs_, remarks_;  ///< what was done to the target; that, and what was left
};

constexpr const char* kFillHelp =
    R"(fill(target, *, cells=None, quality=0.65, crease_angle=None, regions='auto', wrap=None, keep_groups=False,
    cage=False, levels=1, tolerance=0.02, max_tolerance=0.5, max_iterations=0, time_limit=0.0, tune=None,
    checkpoint=None, every=60.0, resume=None, chord=0.005, progress=None, threads=None)
--

Fills a surface with hexes that one can compute on, without a template: FillResult.

target         what bounds the solid: SurfaceMesh, VolumeMesh (its boundary) or path
cells          number of cells that the result may have; None: as few as make it good
quality        least scaled Jacobian to aim at, at most 0.8
crease_angle   degrees: edges of the target sharper than this stay sharp; negative: none; None: 40, if the target is a
               designed part and no scan
regions        what becomes of closed parts inside others and of sheets inside a solid: 'auto', 'keep' or 'merge'
wrap           fill a closed surface that follows the target, made of voxels this large, in percent of the diagonal;
               None: 0.5 if the target bounds no solid after its repair (parts united, holes covered), else none
keep_groups    follow borders between groups of the target's faces like sharp edges
cage           make a subdivision volume: a cage, whose points are the only unknowns, and the mesh it is subdivided to
levels         times the template of a cage is subdivided to the mesh, 1 .. 6; always once if edges are followed
tolerance      mean distance to aim at, percent of the diagonal of the target's bounding box
max_tolerance  the same for the largest distance

max_iterations, time_limit, tune, checkpoint, every, resume, chord, progress and threads as of `fit`.)";

}  // namespace

void add_fill(py::module_& module) {
  using Type = py::class_<Filled, Reported, std::shared_ptr<Filled>>;
  Type type(module, "FillResult", "What `fill` returns.");
  type.def_property_readonly(
      "cage", [](const Filled& filled) { return filled.cage; },
      "The control mesh whose limit surface is fitted: VolumeMesh; None unless asked for.");
  type.def_property_readonly(
      "mesh", [](const Filled& filled) { return filled.mesh; }, "The mesh, a VolumeMesh.");
  module.def(
      "fill", [](const py::object& target, const py::kwargs& given) { return Filling(target, given).run(); },
      py::arg("target"), kFillHelp);
}

}  // namespace subvol::python
