// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/losses.h"
#include "cli/runs/outputs.h"
#include "cli/runs/scene_chord.h"
#include "cli/runs/shell_output.h"
#include "cli/runs/writing.h"
#include "cli/runs/written_result.h"
#include "python/fit_options.h"
#include "python/module.h"
#include "python/results.h"
#include "subvol/base/error.h"
#include "subvol/export/curved_file.h"
#include "subvol/fit/mesh_check.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/io/mesh_io.h"
#include "subvol/io/surface_io.h"

namespace subvol::python {
namespace {

py::object read(const py::object& path, const py::kwargs& given) {
  Keywords keywords("read", given);
  bool check = true;
  keywords.take("check", check);
  keywords.finish();
  const std::string file = path_from(path);
  cli::LoadedMesh mesh = mesh_from_file(file, check);
  if (auto* curved = std::get_if<HighOrderFile>(&mesh))
    return py::cast(std::make_shared<CurvedMesh>(std::move(*curved)));
  if (auto* cells = std::get_if<VolumeMesh>(&mesh)) return py::cast(std::make_shared<VolumeMesh>(std::move(*cells)));
  return py::cast(SurfaceMesh{std::get<PolygonMesh>(std::move(mesh)), {}});
}

/// Options of `write`, and the file.
struct Writing {
  Writing(const py::object& path, const py::kwargs& given) {
    Keywords keywords("write", given);
    options.chord_percent = cli::kSceneChordPercent;
    take_chord(keywords, options);
    keywords.take("unit", options.meters_per_unit);
    keywords.take("up", options.up_axis, {{"y", std::string("y")}, {"z", std::string("z")}});
    take_cut(keywords);
    bool wireframe = true;
    keywords.take("wireframe", wireframe);
    options.no_wireframe = !wireframe;
    keywords.take("quantize", options.quantize);
    keywords.take("limit", limit);
    keywords.take("intervals", options.linear_intervals);
    keywords.take("msh_version", options.msh_version, {{"2.2", MshVersion::v2_2}, {"4.1", MshVersion::v4_1}});
    keywords.take("vtu_cells", options.vtu_cells, {{"lagrange", VtuCells::lagrange}, {"bezier", VtuCells::bezier}});
    keywords.take("map_tolerance", options.map_tolerance_percent);
    if (!(options.map_tolerance_percent >= 0)) throw InputError("map_tolerance: expected 0 or more");
    keywords.finish();
    file.outputs = {path_from(path)};
    file.force = true;
  }
  /// InputError, IoError: the file cannot be written.
  cli::Output output(const std::vector<cli::Part>& parts) const { return cli::checked_outputs(file, parts).front(); }

  cli::RunOptions file;
  /// Adds warnings if polynomial cells that were written for curved ones are far from these or not valid.
  void judge(const cli::Output& output, const HighOrderMesh& mesh) {
    const auto check = [&](const HighOrderMesh& cells) {
      return check_mesh(cells, curved_boundary(cells, cli::measured_chord_percent(options)));
    };
    for (const cli::PolynomialCells& cells :
         cli::check_polynomial_cells({&output, 1}, mesh, options.map_tolerance_percent, check))
      for (const std::string& warning : cli::polynomial_cells_warnings(cells)) warnings.push_back(warning);
  }

  cli::WritingOptions options;
  bool limit = false;
  std::vector<std::string> warnings;

 private:
  void take_cut(Keywords& keywords) {
    std::optional<std::string> cut;
    keywords.take("cut", cut);
    if (!cut) return;
    if (const std::string error = cli::parse_cut(*cut, options.cut); !error.empty()) throw InputError("cut: " + error);
  }
};

void write_volume_mesh(Writing& writing, const VolumeMesh& mesh) {
  const cli::Output output = writing.output({cli::Part::cutaway, cli::Part::boundary});
  cli::warn_of_names(cli::marks_of(mesh), {&output, 1}, writing.warnings);
  if (!writing.limit || !cli::shows_surface(output)) return cli::write_output(output, mesh, writing.options);
  const TessellatedSurface limit = cli::tessellated_limit(mesh, writing.options);
  cli::write_output(output, mesh, mesh, &limit, writing.options);
}

void write_curved(Writing& writing, const CurvedMesh& curved) {
  const cli::Output output = writing.output({cli::Part::cutaway, cli::Part::boundary});
  cli::warn_of_names(cli::marks_of(curved), {&output, 1}, writing.warnings);
  cli::write_output(output, curved, writing.options);
  writing.judge(output, curved.mesh);
}

void write_fit(Writing& writing, const Fitted& fit) {
  std::vector<cli::Part> parts{cli::Part::cutaway, cli::Part::boundary};
  if (fit.cage) parts.push_back(cli::Part::cage);
  if (!fit.states.empty()) parts.push_back(cli::Part::animation);
  const cli::Output output = writing.output(parts);
  if (output.part == cli::Part::animation)
    return fit.curved ? cli::write_animation(output, fit.curved->mesh, fit.states, writing.options)
                      : cli::write_animation(output, *fit.cage, *fit.mesh, fit.states, writing.options);
  cli::warn_of_names(fit.curved ? cli::marks_of(*fit.curved) : cli::marks_of(*fit.mesh), {&output, 1},
                     writing.warnings);
  if (fit.curved) {
    cli::write_output(output, *fit.curved, writing.options);
    return writing.judge(output, fit.curved->mesh);
  }
  if (!fit.cage) return cli::write_output(output, *fit.mesh, writing.options);
  TessellatedSurface limit;
  if (cli::shows_surface(output)) limit = cli::tessellated_limit(*fit.cage, writing.options);
  cli::write_output(output, *fit.cage, *fit.mesh, &limit, writing.options);
}

void write_shell(Writing& writing, const Shelled& result) {
  const cli::Output output = writing.output({cli::Part::cage, cli::Part::cutaway});
  cli::warn_of_names(cli::marks_of(result.shell.mesh), {&output, 1}, writing.warnings);
  if (!result.curved_shell) return cli::write_shell(output, result.shell, writing.options);
  cli::write_shell(output, result.shell, *result.curved_shell, writing.options);
  writing.judge(output, result.curved_shell->mesh);
}

/// Writes the object with write(thing), without Python's lock, if it is a Thing; otherwise returns false.
template <class Thing, class Write>
bool written(const py::object& object, const Write& write) {
  if (!py::isinstance<Thing>(object)) return false;
  const Thing& thing = object.cast<const Thing&>();
  const py::gil_scoped_release unlocked;
  write(thing);
  return true;
}

void write(const py::object& path, const py::object& object, const py::kwargs& given) {
  Writing writing(path, given);
  if (py::isinstance<Reported>(object)) {
    const py::dict report = object.cast<const Reported&>().report;
    writing.options.options = to_json(py::dict(report["options"]));
  }
  const bool done =
      written<VolumeMesh>(object, [&](const VolumeMesh& mesh) { write_volume_mesh(writing, mesh); }) ||
      written<CurvedMesh>(object, [&](const CurvedMesh& curved) { write_curved(writing, curved); }) ||
      written<SurfaceMesh>(object,
                           [&](const SurfaceMesh& surface) {
                             const cli::Output output = writing.output({cli::Part::boundary});
                             cli::warn_of_names(cli::marks_of(surface.polygons), {&output, 1}, writing.warnings);
                             cli::write_output(output, surface.polygons, writing.options);
                           }) ||
      written<Fitted>(object, [&](const Fitted& fit) { write_fit(writing, fit); }) ||
      written<Filled>(object, [&](const Filled& result) { write_volume_mesh(writing, *result.mesh); }) ||
      written<Optimized>(object,
                         [&](const Optimized& result) {
                           result.curved ? write_curved(writing, *result.curved)
                                         : write_volume_mesh(writing, *result.mesh);
                         }) ||
      written<Shelled>(object, [&](const Shelled& shell) { write_shell(writing, shell); });
  if (!done)
    throw py::type_error("write: expected a mesh or a result, not " +
                         std::string(py::str(py::type::of(object).attr("__name__"))));
  warn(writing.warnings);
}

}  // namespace

void add_files(py::module_& module) {
  module.def("read", &read, py::arg("path"),
             R"(read(path, *, check=True)
--

Reads a file; its extension chooses the format (`subvol formats` lists them): VolumeMesh of linear cells, HighOrderMesh
of curved ones, or SurfaceMesh.

check  refuse volume meshes that are not sound, but for inverted cells and unused points)");
  module.def("write", &write, py::arg("path"), py::arg("what"),
             R"(write(path, what, *, chord=0.05, unit=1.0, up='y', limit=False, intervals=0, cut=None, wireframe=True,
    quantize=False, map_tolerance=0.001, msh_version='4.1', vtu_cells='lagrange')
--

Writes a mesh or a result; the extension chooses the format (`subvol formats` lists them). A file of that name is
replaced, once the new one is whole.

what       VolumeMesh, HighOrderMesh, SurfaceMesh, FitResult (its finest mesh; in a scene the limit surface, colored by
           the quality of the cells; 'cage:FILE' is the cage, 'animation:FILE.glb' the fit as it went where its states
           were kept), OptimizeResult, ShellResult (in a scene its sheets); 'cutaway:FILE.glb' shows the cells inside,
           'boundary:FILE.vtu', .vtk or .xdmf holds the faces of the boundary with their groups
chord      how close triangles are to a curved surface, percent of its bounding box's diagonal
unit, up   meters a unit has, and the mesh's upward axis, 'y' or 'z': for .glb, .gltf and .usda
cut        where a cutaway is cut: the axis 'x', 'y' or 'z' that the plane stands across, also with a place between 0
           and 1 as 'z:0.3'; None: across the mesh's shortest extent, halfway
wireframe  scenes show the edges of the cells
quantize   scenes in 16 and 8 bits (KHR_mesh_quantization)
limit      a VolumeMesh is a control mesh: scenes show its limit surface
intervals  of each edge of a curved cell where it becomes linear ones (.mesh, .vtk); 0: the largest order
map_tolerance  largest distance between curved cells and the polynomials that stand for them in .vtu and .msh, percent
           of the diagonal; a warning tells if it is larger, or if these cells are not valid
msh_version  of a .msh: '4.1', or '2.2', which more programs read
vtu_cells  curved cells of a .vtu: 'lagrange', or 'bezier', whose points are control points)");
}

}  // namespace subvol::python
