// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/optimize_mesh.h"

#include "cli/runs/check_report.h"
#include "cli/runs/face_groups.h"
#include "cli/runs/report.h"
#include "python/arrays.h"
#include "python/checkpoints.h"
#include "python/fit_options.h"
#include "python/module.h"
#include "python/results.h"
#include "subvol/base/error.h"
#include "subvol/base/option_checks.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/fit/mesh_check.h"
#include "subvol/fit/optimize_curved.h"
#include "subvol/fit/quality/high_order_quality.h"
#include "subvol/fit/stages/fit_report.h"
#include "subvol/fit/untangle_before_fit.h"
#include "subvol/surface/boundary.h"

namespace subvol::python {

using namespace internal;
namespace {

/// One call of `optimize`, from its arguments to its result.
class Optimization {
 public:
  Optimization(const py::object& mesh, const py::kwargs& given)
      : keywords_("optimize", given), work_(keywords_), checkpoints_(keywords_) {
    const py::object target = keywords_.object("target");
    Cells cells = cells_from(mesh, "mesh");
    start_ = cells.curved;
    mesh_ = start_ ? std::make_shared<const VolumeMesh>(cli::labels_of(*start_)) : cells.linear;
    const bool has_order = keywords_.has("order");
    if (has_order && target.is_none()) throw InputError("optimize: order needs a target");
    kind_ = !target.is_none() && (has_order || start_) ? Kind::curve : start_ ? Kind::curved : Kind::linear;
    if (kind_ == Kind::curve)
      read_curving_options();
    else
      read_options();
    keywords_.finish();
    if (!target.is_none()) target_ = triangles_from(target, "target");
    std::vector<std::pair<std::string, std::string>> inputs{{"mesh", cli::fingerprint(*mesh_)}};
    if (target_) inputs.emplace_back("target", cli::fingerprint(*target_));
    checkpoints_.begin("optimize", keywords_, inputs);
  }

  std::shared_ptr<Optimized> run() {
    auto result = std::make_shared<Optimized>();
    const QualityReport before =
        work_.run("quality", [&] { return start_ ? measure_quality(start_->mesh) : measure_quality(*mesh_); });
    json_["input"] = {{"mesh", start_ ? cli::describe("", start_->mesh) : cli::describe("", *mesh_)},
                      {"quality", cli::quality_json(before)}};
    if (target_) json_["input"]["target"] = cli::describe("", *target_);
    switch (kind_) {
      case Kind::linear: optimize(*result); break;
      case Kind::curved: optimize_curved_cells(*result); break;
      case Kind::curve: curve(*result); break;
    }
    result->report = make_report("optimize", json_, keywords_, work_, warnings_);
    return result;
  }

 private:
  enum class Kind {
    linear,
    curved,  ///< cells that are curved, and keep their boundary
    curve    ///< cells that are drawn to a target as curved ones
  };

  void read_options() {
    keywords_.refuse({"order", "basis"}, "goes with order only");
    if (kind_ == Kind::curved)
      keywords_.refuse({"sizes", "crease_angle", "tolerance", "max_tolerance", "lambda_"},
                       "is not for curved cells without a target, whose boundary keeps its shape");
    keywords_.take("fixed_boundary", options_.fixed_boundary);
    keywords_.take("sizes", options_.sizes, {{"uniform", CellSizes::uniform}, {"local", CellSizes::local}});
    keywords_.take("crease_angle", options_.crease_angle_degrees);
    keywords_.take("tolerance", options_.mean_tolerance_percent);
    keywords_.take("max_tolerance", options_.max_tolerance_percent);
    keywords_.take("quality", options_.quality);
    keywords_.take("lambda_", options_.lambda);
    keywords_.take("max_iterations", options_.control.max_iterations);
    keywords_.take("time_limit", options_.control.time_limit_seconds);
    take_tuning(keywords_, options_.tuning);
    keywords_.refuse({"chord"}, "goes with order only");
  }

  void read_curving_options() {
    keywords_.refuse({"fixed_boundary", "sizes", "max_tolerance"},
                     "does not go with order or curved cells and a target");
    curving_.lambda_close = kCurvingLambda;
    curving_.tolerance_percent = options_.mean_tolerance_percent;
    curving_.order = 1;  // curved cells have theirs
    keywords_.take("order", curving_.order);
    require_in_range("optimize", "order", curving_.order, start_ ? 1 : 2, kMaxOrder);
    keywords_.take("basis", curving_.basis, bases());
    keywords_.take("tolerance", curving_.tolerance_percent);
    keywords_.take("quality", curving_.quality);
    keywords_.take("lambda_", curving_.lambda_close);
    curving_.follows_all_edges = keywords_.has("crease_angle");
    curving_.crease_angle_degrees = options_.crease_angle_degrees;
    keywords_.take("crease_angle", curving_.crease_angle_degrees);
    keywords_.take("max_iterations", curving_.control.max_iterations);
    keywords_.take("time_limit", curving_.control.time_limit_seconds);
    take_tuning(keywords_, curving_.tuning);
    take_chord(keywords_, writing_);
  }

  void optimize(Optimized& result) {
    work_.watch(options_.control);
    const TriangleMesh* target = target_ ? &*target_ : nullptr;
    OptimizeResult found = checkpoints_.run(work_, "optimize", warnings_, [&](StageLog* log) {
      options_.control.log = log;
      return optimize_mesh(*mesh_, target, options_);
    });
    const MeshCheck checked = work_.run("check", [&] {
      const TriangleMesh surface = target_ ? *target_ : fan_triangles(boundary_surface(*mesh_, MeshTopology(*mesh_)));
      return check_mesh(found.mesh, &surface);
    });
    add(found.report, checked);
    if (target_) add(work_.run("groups", [&] { return cli::carry_groups(*target_, found.mesh); }));
    result.mesh = std::make_shared<VolumeMesh>(std::move(found.mesh));
  }

  void optimize_curved_cells(Optimized& result) {
    CurvedOptimizeOptions options{.fixed_boundary = options_.fixed_boundary,
                                  .quality = options_.quality,
                                  .control = options_.control,
                                  .tuning = options_.tuning};
    work_.watch(options.control);
    CurvedOptimizeResult found = checkpoints_.run(work_, "optimize", warnings_, [&](StageLog* log) {
      options.control.log = log;
      return optimize_curved(start_->mesh, *mesh_, options);
    });
    const MeshCheck checked = work_.run("check", [&] {
      return check_mesh(found.mesh, curved_boundary(found.mesh, writing_.chord_percent),
                        static_cast<const TriangleMesh*>(nullptr), {.labels = {mesh_->references, mesh_->regions}});
    });
    add(found.report, checked);
    result.curved = with_labels(std::move(found.mesh));
  }

  std::shared_ptr<CurvedMesh> with_labels(HighOrderMesh mesh) const {
    return std::make_shared<CurvedMesh>(
        CurvedMesh{std::move(mesh), mesh_->references, mesh_->face_groups, mesh_->regions});
  }

  void curve(Optimized& result) {
    work_.watch(curving_.control);
    VolumeMesh start = *mesh_;
    std::optional<HighOrderMesh> curved_start;
    if (start_) curved_start = start_->mesh;
    const auto with_limits = [&](auto options, StageLog* log) {
      options.control = curving_.control;
      options.control.max_iterations = 0;  // the caller's limit is that of the fit
      options.control.log = log;
      options.tuning = curving_.tuning;
      return options;
    };
    const UntangledStart untangled = checkpoints_.run(work_, "untangle", warnings_, [&](StageLog* log) {
      return curved_start ? untangle_before_fit(*curved_start, start, with_limits(CurvedOptimizeOptions(), log))
                          : untangle_before_fit(start, with_limits(OptimizeOptions(), log));
    });
    require_untangled(untangled, "optimize");
    curving_.control.time_limit_seconds = work_.time_left(curving_.control.time_limit_seconds);
    if (untangled.tangled > 0)
      warnings_.push_back(std::to_string(untangled.tangled) +
                          " cells were not valid; they were untangled before curving");
    HighOrderFitResult found = checkpoints_.run(work_, "fit", warnings_, [&](StageLog* log) {
      curving_.control.log = log;
      return curved_start ? fit_high_order(*target_, *curved_start, start, curving_)
                          : fit_high_order(*target_, start, curving_);
    });
    const MeshCheck checked = work_.run("check", [&] {
      return check_mesh(found.mesh, curved_boundary(found.mesh, writing_.chord_percent), &*target_,
                        {.labels = {mesh_->references, mesh_->regions}});
    });
    add(found.report, checked);
    result.curved = with_labels(std::move(found.mesh));
    add(work_.run("groups", [&] { return cli::carry_groups(*target_, *result.curved); }));
  }

  void add(const cli::GroupsFound& groups) {
    if (!groups.groups.empty()) json_["groups"] = cli::groups_json(groups.groups);
    warnings_.insert(warnings_.end(), groups.warnings.begin(), groups.warnings.end());
  }

  void add(const FitReport& report, const MeshCheck& checked) {
    json_.update(cli::fit_json(report));
    json_.update(cli::check_json(checked));
    if (report.creases) json_["creases"] = cli::creases_json(*report.creases);
    checkpoints_.describe(json_);
    json_["not_certified_cells"] = cli::not_certified_cells(checked);
    warnings_.insert(warnings_.end(), report.warnings.begin(), report.warnings.end());
  }

  Keywords keywords_;
  Work work_;
  Checkpoints checkpoints_;
  Kind kind_ = Kind::linear;
  OptimizeOptions options_;
  HighOrderFitOptions curving_;
  cli::WritingOptions writing_;
  std::shared_ptr<const VolumeMesh> mesh_;   ///< of curved cells, the straight-sided ones with their labels
  std::shared_ptr<const CurvedMesh> start_;  ///< null: the cells are linear
  std::optional<TriangleMesh> target_;
  Json json_;
  std::vector<std::string> warnings_;
};

constexpr const char* kOptimizeHelp =
    R"(optimize(mesh, *, target=None, fixed_boundary=False, sizes='local', crease_angle=40.0, tolerance=0.05,
    max_tolerance=0.5, quality=0.65, lambda_=None, order=None, basis='legendre', max_iterations=0, time_limit=0.0,
    tune=None, checkpoint=None, every=60.0, resume=None, chord=0.005, progress=None, threads=None)
--

Untangles a mesh and improves its cells, or curves it: OptimizeResult.

mesh            VolumeMesh, HighOrderMesh or the path of either; its cells may be inverted
target          what the boundary is to reproduce: SurfaceMesh, VolumeMesh or path; None: its boundary as it is
fixed_boundary  boundary points stay; otherwise they slide along the surface; those of curved cells in flat parts only
sizes           ideal sizes of the cells: 'uniform', or as they are, 'local'
crease_angle    degrees: edges of the surface sharper than this stay sharp
tolerance       mean distance from the surface to keep within, percent of its diagonal
max_tolerance   the same for the largest distance
quality         least scaled Jacobian to aim at, as far as distances allow; 0: none
lambda_         weight of the cells' shape; None: 0.1, with order 0.0025
order           curve the cells to this order, 2 .. 16; needs a target, and straight cells' options do not go with it;
                None: the order that they have
basis           of curved cells: 'legendre' or 'fourier'

max_iterations, time_limit, tune, checkpoint, every, resume, chord, progress and threads as of `fit`.)";

}  // namespace

void add_optimize(py::module_& module) {
  using Type = py::class_<Optimized, Reported, std::shared_ptr<Optimized>>;
  Type type(module, "OptimizeResult", "What `optimize` returns.");
  type.def_property_readonly("mesh", &mesh_of<Optimized>, "The mesh, a VolumeMesh; or curved cells, a HighOrderMesh.");
  module.def(
      "optimize", [](const py::object& mesh, const py::kwargs& given) { return Optimization(mesh, given).run(); },
      py::arg("mesh"), kOptimizeHelp);
}

}  // namespace subvol::python
