// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/check_report.h"
#include "cli/runs/report.h"
#include "cli/runs/shell_output.h"
#include "cli/runs/shell_surface.h"
#include "python/arrays.h"
#include "python/fit_options.h"
#include "python/module.h"
#include "python/results.h"
#include "subvol/base/error.h"
#include "subvol/base/format.h"
#include "subvol/base/option_checks.h"
#include "subvol/fit/geometry/surface_distance.h"
#include "subvol/fit/mesh_check.h"
#include "subvol/mesh/features.h"
#include "subvol/shell/shell.h"
#include "subvol/surface/boundary.h"

#include <algorithm>
#include <optional>

namespace subvol::python {

using namespace internal;
namespace {

/// One call of `shell`, from its arguments to its result.
class Growing {
 public:
  Growing(const py::object& surface, const py::object& thickness, const py::kwargs& given)
      : keywords_("shell", given), work_(keywords_) {
    read_options();
    given_ = shell_surface_from(surface, "surface", preparation_.region);
    const TriangleMesh triangles = triangulate(given_.polygons);
    diagonal_ = bounding_box_diagonal(triangles);
    inward_warning_ = cli::inward_warning(triangles);
    read_thickness(thickness);
    if (!first_height_.empty()) plan_layers();
    preparation_.repair_distance = cli::parse_repair("repair", repair_, diagonal_);
  }

  std::shared_ptr<Shelled> run() {
    auto result = std::make_shared<Shelled>();
    work_.watch(options_.control);
    preparation_.cancelled = work_.cancelled();
    surface_ = work_.run("repair", [&] { return cli::prepared_surface(given_, preparation_); });
    if (crease_angle_) options_.tags = surface_features(surface_.polygons, *crease_angle_);
    cli::take_surface(surface_, options_);
    result->shell = work_.run("grow", [&] { return make_shell(surface_.polygons, options_); });
    if (curved_options_.order != 1) curve(*result);
    std::vector<std::string> warnings = result->shell.report.warnings;
    if (const auto repaired = cli::repair_warning(surface_, diagonal_)) warnings.insert(warnings.begin(), *repaired);
    if (surface_.note) warnings.insert(warnings.begin(), *surface_.note);
    if (inward_warning_) warnings.insert(warnings.begin(), *inward_warning_);
    result->report = make_report("shell", report_of(*result), keywords_, work_, warnings);
    return result;
  }

 private:
  void read_options() {
    bool straight = false;
    keywords_.take("layers", options_.layers);
    keywords_.take("growth", options_.growth);
    take_length("first_height", first_height_);
    take_length("repair", repair_);
    take_length("region", preparation_.region);
    take_patches();
    keywords_.take("side", options_.side,
                   {{"outward", ShellSide::outward}, {"inward", ShellSide::inward}, {"both", ShellSide::both}});
    preparation_.side = options_.side;
    keywords_.take("free_surface", options_.free_surface);
    keywords_.take("straight", straight);
    keywords_.take("crease_angle", crease_angle_);
    curved_options_.order = 1;
    keywords_.take("order", curved_options_.order);
    if (!keywords_.has("order")) keywords_.refuse({"basis"}, "goes with order only");
    keywords_.take("basis", curved_options_.basis, bases());
    keywords_.take("max_iterations", options_.control.max_iterations);
    keywords_.take("time_limit", options_.control.time_limit_seconds);
    take_chord(keywords_, writing_);
    keywords_.finish();
    require_in_range("shell", "order", curved_options_.order, 1,
                     kMaxOrder);  // checked before the work, as in the program
    require_in_range("shell", "layers", options_.layers, 1, 1000);
    require_in_range("shell", "growth", options_.growth, 0.01, 100);
    if (straight && curved_options_.order > 1) throw InputError("shell: straight and order exclude each other");
    options_.optimize = !straight;
    curved_options_.control.max_iterations = options_.control.max_iterations;
  }

  void read_thickness(const py::object& thickness) {
    if (py::isinstance<py::str>(thickness)) {
      options_.thickness = cli::parse_length("thickness", thickness.cast<std::string>(), diagonal_);
    } else if (const std::optional<double> number = number_of(thickness)) {
      options_.thickness = *number;
    } else if (truth_of(thickness)) {
      throw py::type_error("shell: thickness must be a length, not " + py::repr(thickness).cast<std::string>());
    } else {
      options_.vertex_thickness = values_from(thickness, "thickness");
      if (options_.vertex_thickness.size() != given_.polygons.positions.size())
        throw InputError("thickness must be a length, a percentage as '2%', or have one entry for each of the " +
                         std::to_string(given_.polygons.positions.size()) + " points");
    }
  }

  /// Takes a length or a name: a number, or text.
  void take_length(const char* name, std::string& text) {
    const py::object given = keywords_.object(name);
    if (!given.is_none()) text = py::str(given).cast<std::string>();
  }

  /// Takes the patches to leave out: one text, or a sequence of texts or of group numbers.
  void take_patches() {
    const py::object given = keywords_.object("skip");
    if (given.is_none()) return;
    if (py::isinstance<py::str>(given) || number_of(given)) {
      preparation_.skipped.push_back(py::str(given).cast<std::string>());
      return;
    }
    if (!py::isinstance<py::sequence>(given)) throw py::type_error("skip must be a text or a sequence of texts");
    for (const py::handle patch : given) preparation_.skipped.push_back(py::str(patch).cast<std::string>());
  }

  void plan_layers() {
    if (!options_.vertex_thickness.empty())
      throw InputError("shell: first_height goes with one thickness, not with one for each point");
    const cli::LayerPlan plan =
        cli::planned_layers(options_.thickness, cli::parse_length("first_height", first_height_, diagonal_),
                            keywords_.has("layers") ? std::optional(options_.layers) : std::nullopt,
                            keywords_.has("growth") ? std::optional(options_.growth) : std::nullopt);
    options_.layers = plan.layers;
    options_.growth = plan.growth;
  }

  // Uses the time that the linear shell has left. If none is left, or the run must end, the cells get the requested
  // order but stay straight.
  void curve(Shelled& result) {
    ShellResult& shell = result.shell;
    if (!shell.failures.none()) {
      shell.report.warnings.push_back("the cells were left straight, for the shell is not valid");
      return;
    }
    curved_options_.control.time_limit_seconds = work_.time_left(options_.control.time_limit_seconds);
    curved_options_.boundary = [this](const HighOrderMesh& mesh) {
      return curved_boundary(mesh, writing_.chord_percent);
    };
    work_.watch(curved_options_.control);
    result.curved_shell = work_.run("curve", [&] { return curve_shell(shell, curved_options_); });
    cli::take_figures(*result.curved_shell, shell);
    result.curved = std::make_shared<CurvedMesh>(
        CurvedMesh{result.curved_shell->mesh, shell.mesh.references, shell.mesh.face_groups});
  }

  Json report_of(const Shelled& result) const {
    const ShellResult& shell = result.shell;
    return {{"input", {{"surface", cli::describe("", given_.polygons)}}},
            {"repair", cli::repair_json(surface_, diagonal_)},
            {"skipped", cli::skipped_json(surface_)},
            {"stop_reason", to_string(shell.report.stop_reason)},
            {"explanation", shell.report.explanation},
            {"converged", shell.report.stop_reason == StopReason::converged},
            {"stages", cli::stages_json(shell.report)},
            {"valid", shell.failures.none()},
            {"thickness", cli::thickness_json(shell, diagonal_)},
            {"layers", cli::layers_json(shell)},
            {"border", cli::border_json(shell, diagonal_)},
            {"groups", cli::shell_groups_json(shell, given_.polygons)},
            {"surface_distance_max_percent", 100 * shell.surface_distance_max / diagonal_},
            {"quality", cli::quality_json(shell.quality)},
            {"corner_quality", cli::corner_quality_json(shell)},
            {"not_certified_cells", shell.failures.certificate.not_certified},
            {"boundary_self_intersections", shell.failures.intersecting.size()},
            {"intersecting_faces", shell.failures.intersecting},
            {"mesh", result.curved ? cli::describe("", result.curved->mesh) : cli::describe("", shell.mesh)}};
  }

  Keywords keywords_;
  Work work_;
  ShellOptions options_;
  CurvedShellOptions curved_options_;
  cli::WritingOptions writing_;
  std::optional<double> crease_angle_;
  SurfaceMesh given_;
  cli::ShellSurfaceOptions preparation_;
  cli::ShellSurface surface_;
  std::string first_height_, repair_ = formatted("%.6g%%", 100 * kMendingShare);
  double diagonal_ = 0;
  std::optional<std::string> inward_warning_;
};

/// The straight cells; they keep alive the result that they are part of.
std::shared_ptr<VolumeMesh> linear_mesh(const std::shared_ptr<Shelled>& result) {
  return {result, &result->shell.mesh};
}

/// One number per point and side, as (2, n), the inside first.
auto by_side(std::vector<double> ShellResult::*values) {
  return [values](const py::object& self) {
    const ShellResult& shell = self.cast<const Shelled&>().shell;
    return shown((shell.*values).data(), {2, static_cast<py::ssize_t>(shell.layers.num_columns())}, self);
  };
}

constexpr const char* kShellHelp =
    R"(shell(surface, thickness, *, layers=1, growth=1.0, side='outward', free_surface=False, straight=False,
    crease_angle=None, first_height=None, region=None, skip=None, repair='0.02%', order=1, basis='legendre',
    max_iterations=0, time_limit=0.0, chord=0.005, progress=None, threads=None)
--

Grows layers of prisms on triangles and of hexes on quads: ShellResult.

surface       SurfaceMesh, VolumeMesh (its boundary), or the path of either
thickness     of each side: a length, '2%' of the bounding box's diagonal, or (n,) lengths, one for each point
layers        on each side
growth        thickness of a layer against that of the one nearer the surface
first_height  thickness of the layer at the surface, as text: a length, or '2%': the growth follows from layers, or the
              layers from growth
region        grow on the boundary of this region of the surface or of the cells: its name or number; None: on the
              outer surface
skip          list of patches without layers: names or numbers of groups, or points 'X,Y,Z' on patches between sharp
              edges
repair        faults of the surface are repaired by changes within this distance, as text: a length, or '2%'; '0': none
side          'outward' where the faces' normals point, 'inward', or 'both'
free_surface  the surface's points may slide along it for the cells' sake
straight      straight columns, no optimization
crease_angle  degrees: edges of the surface sharper than this become creases as well
order         of the cells, 1 .. 16; above 1 they are curved, but for the surface itself
basis         of curved cells: 'legendre' or 'fourier'

max_iterations, time_limit, chord, progress and threads as of `fit`.)";

}  // namespace

void add_shell(py::module_& module) {
  py::class_<Shelled, Reported, std::shared_ptr<Shelled>> type(
      module, "ShellResult",
      "What `shell` returns. Point s n + i of the cells is point i of the surface on sheet s, of n points and from the "
      "innermost sheet. The surface is the given one without the patches that were left out, and after its repair: "
      "`surface`.");
  type.def_property_readonly(
      "surface",
      [](const Shelled& result) {
        return SurfaceMesh{result.shell.layers.surface, {}};
      },
      "The surface that the layers stand on: SurfaceMesh.");
  type.def_property_readonly(
      "mesh",
      [](const std::shared_ptr<Shelled>& result) {
        return result->curved ? py::cast(result->curved) : py::cast(linear_mesh(result));
      },
      "The layers, a VolumeMesh whose references number them from the innermost; or curved cells, a HighOrderMesh.");
  type.def_property_readonly("linear_mesh", &linear_mesh,
                             "The layers with straight cells, also where they were curved: VolumeMesh.");
  type.def_property_readonly(
      "inside_layers", [](const Shelled& result) { return result.shell.layers.inside; },
      "Layers on the inside: the surface itself is the sheet of this number.");
  type.def_property_readonly("thickness", by_side(&ShellResult::achieved),
                             "Length of the columns on the inside and the outside of each point: (2, n). A view.");
  type.def_property_readonly("thickness_asked", by_side(&ShellResult::asked), "What was asked for: (2, n). A view.");
  type.def_property_readonly("thickness_limited", by_side(&ShellResult::limited),
                             "What there was room for: (2, n). A view.");
  type.def_property_readonly("clearance", by_side(&ShellResult::clearance),
                             "Distance of each column's end from the whole surface: (2, n). A view.");
  module.def(
      "shell",
      [](const py::object& surface, const py::object& thickness, const py::kwargs& given) {
        return Growing(surface, thickness, given).run();
      },
      py::arg("surface"), py::arg("thickness"), kShellHelp);
}

}  // namespace subvol::python
