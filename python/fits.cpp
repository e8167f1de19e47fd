// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/automatic_fit_report.h"
#include "cli/runs/check_report.h"
#include "cli/runs/face_groups.h"
#include "cli/runs/report.h"
#include "cli/runs/untangling.h"
#include "cli/runs/writing.h"
#include "python/arrays.h"
#include "python/checkpoints.h"
#include "python/fit_options.h"
#include "python/limit.h"
#include "python/module.h"
#include "python/results.h"
#include "subvol/base/error.h"
#include "subvol/base/format.h"
#include "subvol/fit/high_order_fit.h"
#include "subvol/fit/mesh_check.h"
#include "subvol/fit/stages/fit_report.h"
#include "subvol/fit/template_fit.h"
#include "subvol/fit/tuning/tuned_numbers.h"
#include "subvol/fit/untangle_before_fit.h"

#include <algorithm>
#include <map>
#include <string>

namespace subvol::python {
namespace {

/// Takes the options that both kinds of fit have, and curving does not.
template <class Options>
void take_fit_options(Keywords& keywords, Options& options) {
  keywords.take("energy", options.distortion,
                {{"hencky", Distortion::hencky},
                 {"inverse_mean_ratio", Distortion::inverse_mean_ratio},
                 {"condition_number", Distortion::condition_number}});
  keywords.take("point_weights", options.point_weights,
                {{"equal", PointWeights::equal}, {"area", PointWeights::by_area}});
  keywords.take("keep_states", options.keep_states);
}

FitOptions subdivision_options(Keywords& keywords) {
  FitOptions options;
  keywords.take("levels", options.levels);
  keywords.take("tolerance", options.tolerance_percent);
  keywords.take("surface", options.surface, {{"limit", FittedSurface::limit}, {"mesh", FittedSurface::mesh}});
  keywords.take("boundary", options.boundary, boundary_rules());
  keywords.take("cage_only", options.cage_only);
  bool keeps_cage = true;
  keywords.take("keep_cage", keeps_cage);
  options.frees_mesh = !keeps_cage;
  keywords.take("lambda_far", options.lambda_far);
  keywords.take("quality", options.quality);
  take_solver_options(keywords, options);
  take_fit_options(keywords, options);
  if (!keeps_cage && (options.cage_only || options.keep_states))
    throw InputError("fit: keep_cage=False does not go with cage_only or keep_states");
  return options;
}

/// One call of `fit`, from its arguments to its result.
class Fit {
 public:
  Fit(const py::object& target, const py::object& template_mesh, const py::kwargs& given)
      : keywords_("fit", given), work_(keywords_), checkpoints_(keywords_) {
    read_options(!template_mesh.is_none());
    target_ = target_with_regions_from(target, "target");
    refuse_for_points(template_mesh.is_none());
    double& time_limit = curved_ ? high_order_.control.time_limit_seconds : subdivision_.control.time_limit_seconds;
    template_options_.control.time_limit_seconds = kTemplateShareOfTime * time_limit;
    template_ = template_mesh.is_none() ? made_template() : volume_from(template_mesh, "template");
    untangle_template(time_limit);
    // Making the template may have used part of the time limit.
    time_limit = work_.time_left(time_limit);
    checkpoints_.begin("fit", keywords_,
                       {{"target", cli::fingerprint(target_)}, {"template", cli::fingerprint(*template_)}});
  }
  std::shared_ptr<Fitted> run() {
    auto result = std::make_shared<Fitted>();
    // The result exposes the template through writable arrays, so it needs its own copy.
    result->template_mesh = std::make_shared<VolumeMesh>(*template_);
    curved_ ? fit_curved(*result) : fit_subdivision(*result);
    return result;
  }

 private:
  void read_options(bool has_template) {
    curved_ = keywords_.has("order");
    if (has_template)
      keywords_.refuse({"cells"}, "does not go with a template");
    else
      keywords_.take("cells", template_options_.cells);
    if (curved_) {
      keywords_.refuse({"levels", "surface", "boundary", "cage_only", "keep_cage", "lambda_far"},
                       "does not go with order");
      high_order_ = high_order_options(keywords_);
      take_fit_options(keywords_, high_order_);
      take_edges(high_order_);
    } else {
      keywords_.refuse({"order", "basis", "adaptive"}, "goes with order only");
      subdivision_ = subdivision_options(keywords_);
      take_edges(subdivision_);
    }
    take_chord(keywords_, writing_);
    keywords_.finish();
  }

  /// Takes what says which edges are kept, for the fit and for a template that is made, which also gets the tuning.
  template <class Options>
  void take_edges(Options& options) {
    keywords_.take("crease_angle", options.crease_angle_degrees);
    keywords_.take("keep_groups", options.keeps_groups);
    if (options.crease_angle_degrees) {
      template_options_.crease_angle_degrees = options.crease_angle_degrees;
      template_options_.follows_all_edges = true;
    }
    template_options_.keeps_groups = options.keeps_groups;
    template_options_.tuning = options.tuning;
  }

  /// As in the program: a few inverted cells are made valid; the fit refuses a mesh in which at least half of the cells
  /// are inverted.
  void untangle_template(double time_limit_seconds) {
    if (!cli::has_few_inverted_cells(*template_)) return;
    auto mesh = std::make_shared<VolumeMesh>(*template_);
    const UntangledStart untangled = work_.run("untangle", [&] {
      OptimizeOptions options{.control = {.time_limit_seconds = time_limit_seconds},
                              .tuning = template_options_.tuning};
      work_.watch(options.control);
      return untangle_before_fit(*mesh, options);
    });
    require_untangled(untangled, "fit");
    if (untangled.tangled > 0)
      warnings_.push_back(std::to_string(untangled.tangled) +
                          " cells were not valid; they were untangled before the fit");
    template_ = std::move(mesh);
  }

  void refuse_for_points(bool has_no_template) {
    if (!cli::is_cloud(target_))
      return keywords_.refuse({"point_weights"}, "does not go with a surface, whose triangles count by their areas");
    keywords_.refuse({"crease_angle"}, "does not go with points, between which no edges can be seen");
    if (has_no_template) throw InputError("fit: points do not tell what they enclose: give a template");
  }

  std::shared_ptr<const VolumeMesh> made_template() {
    work_.watch(template_options_.control);
    made_ = work_.run("template", [&] {
      return fit_template(std::get<TriangleMesh>(target_), template_options_,
                          curved_ ? TemplateUse::curved_cells : TemplateUse::subdivision);
    });
    if (made_->mesh.num_cells() == 0) throw InputError("fit: ended before there was a template");
    return std::make_shared<const VolumeMesh>(made_->mesh);
  }

  void fit_subdivision(Fitted& result) {
    work_.watch(subdivision_.control);
    FitResult fit = checkpoints_.run(work_, "fit", warnings_, [&](internal::StageLog* log) {
      subdivision_.control.log = log;
      return std::visit([&](const auto& target) { return fit_subdivision_volume(target, *template_, subdivision_); },
                        target_);
    });
    const MeshCheck found = work_.run("check", [&] {
      return std::visit([&](const auto& target) { return check_mesh(fit.mesh, &target); }, target_);
    });
    const bool has_cage = fit.cage.num_cells() > 0;
    cli::MeasuredLimit limit;
    if (has_cage) limit = measured_limit(fit.cage, target_, writing_, work_);
    const cli::GroupsFound groups = work_.run("groups", [&] {
      if (has_cage) cli::carry_groups(target_, fit.cage);
      return cli::carry_groups(target_, fit.mesh);
    });
    Json json = report_of(fit.report, found, groups);
    if (has_cage) json.update(cli::cage_json(fit.cage, limit, found.target_diagonal));
    json["audit"] = cli::audit_json(audit(*template_));
    finish(result, json, fit.report);
    result.states = std::move(fit.states);
    if (has_cage) result.cage = std::make_shared<VolumeMesh>(std::move(fit.cage));
    result.mesh = std::make_shared<VolumeMesh>(std::move(fit.mesh));
  }

  void fit_curved(Fitted& result) {
    work_.watch(high_order_.control);
    HighOrderFitResult fit = checkpoints_.run(work_, "fit", warnings_, [&](internal::StageLog* log) {
      high_order_.control.log = log;
      return std::visit([&](const auto& target) { return fit_high_order(target, *template_, high_order_); }, target_);
    });
    const MeshCheck found = work_.run("check", [&] {
      const CurvedBoundary boundary = curved_boundary(fit.mesh, writing_.chord_percent);
      const MeshCheckOptions options{.labels = {template_->references, template_->regions}};
      return std::visit([&](const auto& target) { return check_mesh(fit.mesh, boundary, &target, options); }, target_);
    });
    auto curved = std::make_shared<CurvedMesh>(
        CurvedMesh{std::move(fit.mesh), template_->references, template_->face_groups, template_->regions});
    const cli::GroupsFound groups = work_.run("groups", [&] { return cli::carry_groups(target_, *curved); });
    Json json = report_of(fit.report, found, groups);
    json["mesh"] = cli::describe("", curved->mesh);
    finish(result, json, fit.report);
    result.states = std::move(fit.states);
    result.curved = std::move(curved);
  }

  Json report_of(const FitReport& report, const MeshCheck& found, const cli::GroupsFound& groups) {
    Json json{{"input", {{"target", cli::describe("", target_)}, {"template", cli::describe("", *template_)}}}};
    if (made_) json["template"] = cli::automatic_fit_json(*made_).at("template");
    json.update(cli::fit_json(report));
    json.update(cli::check_json(found));
    if (report.creases) json["creases"] = cli::creases_json(*report.creases);
    if (!groups.groups.empty()) json["groups"] = cli::groups_json(groups.groups);
    warnings_.insert(warnings_.end(), groups.warnings.begin(), groups.warnings.end());
    checkpoints_.describe(json);
    return json;
  }

  void finish(Fitted& result, const Json& json, const FitReport& report) {
    warnings_.insert(warnings_.end(), report.warnings.begin(), report.warnings.end());
    result.report = make_report("fit", json, keywords_, work_, warnings_);
  }

  Keywords keywords_;
  Work work_;
  Checkpoints checkpoints_;
  bool curved_ = false;
  FitOptions subdivision_;
  HighOrderFitOptions high_order_;
  AutomaticFitOptions template_options_;
  cli::WritingOptions writing_;
  cli::Target target_;
  std::shared_ptr<const VolumeMesh> template_;
  std::optional<AutomaticFitResult> made_;
  std::vector<std::string> warnings_;
};

constexpr const char* kFitHelp =
    R"(fit(target, template=None, *, cells=None, levels=3, tolerance=None, surface='limit',
    boundary='catmull-clark', cage_only=False, keep_cage=True, crease_angle=None, keep_groups=False, lambda_far=1.0,
    quality=0.65, lambda_close=None, correspondence='closest', solver='newton', energy='hencky', point_weights='equal',
    max_iterations=0, time_limit=0.0, tune=None, order=None, basis='legendre', adaptive=False, keep_states=False,
    checkpoint=None, every=60.0, resume=None, chord=0.005, progress=None, threads=None)
--

Deforms a template until its boundary reproduces a surface: FitResult.

target    SurfaceMesh, VolumeMesh (its boundary), points as an (n, 3) array, or the path of any; points need a template
template  VolumeMesh or its path, roughly in place; None: made from the target, of about `cells` cells

Without order a subdivision volume is fitted:
levels        times the template is subdivided, 1 .. 6
surface       what is to agree with the target: the cage's 'limit' surface, or the finest 'mesh'
boundary      'catmull-clark' or 'averaging'
cage_only     only the points of the template move
keep_cage     False: if the cage keeps cells below the quality, the points of the finest mesh are freed from it, and
              the result has no cage, unless a fit that went on from it ends with one
lambda_far    largest weight of the cells' shape to which the way from one level to the next may raise it

With order, 1 .. 16, curved cells:
basis     'legendre' or 'fourier'
adaptive  raise orders only where it pays

And with both:
crease_angle    degrees: keep edges of the target sharper than this sharp
keep_groups     keep borders between groups of the target's faces in the same way
tolerance       mean distance to reach, percent of the diagonal of the target's bounding box
quality         least scaled Jacobian to aim at, as far as distances allow; 0: none
lambda_close    weight of the cells' shape in the last stage; None: 0.005; with order 0.05, or 0.0025 if creases follow
                nearly all of the target's sharp edges
correspondence  'closest' or 'voronoi'
solver          'newton' or 'lbfgs'
energy          how cells' distortion is measured: 'hencky', 'inverse_mean_ratio' or 'condition_number'
point_weights   of points: all count alike, 'equal', or by the area they stand for, 'area'
keep_states     fills states of the result, which write("animation:FILE.glb", ...) shows
max_iterations  per stage; 0: the schedule's own
time_limit      seconds; 0: none
tune            for experiments: tuned numbers of the method by name, such as {'fitting.coarse_lambda': 0.02}
checkpoint      file to keep what `resume` needs, written at most every `every` seconds as minimizations end, and
                however the call ends
resume          checkpoint of an earlier call with the same target, template and options: goes on where that ended
chord           how close triangles are to the surface that is measured, percent of its diagonal
progress        called with a Progress at every step; returns False to end with the best result so far
threads         for this call alone; None: as many as OpenMP gives

How the fit ended is told by report["stop_reason"]. Ctrl-C raises KeyboardInterrupt.)";

}  // namespace

Choices<BoundaryRule> boundary_rules() {
  return {{"catmull-clark", BoundaryRule::catmull_clark}, {"averaging", BoundaryRule::averaging}};
}

Choices<Basis> bases() { return {{"fourier", Basis::fourier}, {"legendre", Basis::legendre}}; }

void take_tuning(Keywords& keywords, Tuning& tuning) {
  std::map<std::string, double> numbers;
  keywords.take("tune", numbers);
  for (const auto& [name, value] : numbers) set_tuned_number(tuning, name, value);
}

HighOrderFitOptions high_order_options(Keywords& keywords) {
  HighOrderFitOptions options;
  keywords.take("order", options.order);
  keywords.take("basis", options.basis, bases());
  keywords.take("adaptive", options.adaptive);
  keywords.take("tolerance", options.tolerance_percent);
  keywords.take("quality", options.quality);
  take_solver_options(keywords, options);
  return options;
}

void require_untangled(const UntangledStart& start, const char* function) {
  if (start.ended_early())
    throw InputError(std::string(function) + ": the work was ended while the mesh was made valid; " +
                     std::to_string(start.left) + " cells were not yet");
}

void take_chord(Keywords& keywords, cli::WritingOptions& writing) {
  keywords.take("chord", writing.chord_percent);
  require_chord(writing.chord_percent);
}

void require_chord(double percent) {
  constexpr double kLeastChordPercent = 1e-4, kMostChordPercent = 100;  // as in the program
  if (!(percent >= kLeastChordPercent && percent <= kMostChordPercent))
    throw InputError(internal::formatted("chord must be in [%g, %g] percent, got %g", kLeastChordPercent,
                                         kMostChordPercent, percent));
}

void add_fits(py::module_& module) {
  py::class_<Reported, std::shared_ptr<Reported>>(module, "Result", "A result and its report.")
      .def_property_readonly(
          "report", [](const Reported& result) { return result.report; },
          "What was done and what is true of the result: dict, with the entries of docs/cli.md.");
  py::class_<Fitted, Reported, std::shared_ptr<Fitted>> type(module, "FitResult", "What `fit` returns.");
  type.def_property_readonly(
      "template", [](const Fitted& fit) { return fit.template_mesh; }, "The template: VolumeMesh.");
  type.def_property_readonly(
      "cage", [](const Fitted& fit) { return fit.cage; },
      "The control mesh whose limit surface is fitted: VolumeMesh; None of curved cells and of a mesh "
      "that was freed from it.");
  type.def_property_readonly("mesh", &mesh_of<Fitted>,
                             "The finest mesh, a VolumeMesh; or curved cells, a HighOrderMesh.");
  type.def_property_readonly(
      "states",
      [](const py::object& self) {
        py::list states;
        for (const FitState& state : self.cast<Fitted&>().states)
          states.append(py::make_tuple(state.name, shown_points(state.positions, self)));
        return states;
      },
      "Where the cage's points, or the coefficients of curved cells, were before each minimization, if kept: list of\n"
      "(name, array).");
  module.def(
      "fit",
      [](const py::object& target, const py::object& template_mesh, const py::kwargs& given) {
        return Fit(target, template_mesh, given).run();
      },
      py::arg("target"), py::arg("template") = py::none(), kFitHelp);
}

}  // namespace subvol::python
