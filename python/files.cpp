// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/outputs.h"
#include "cli/shell_output.h"
#include "cli/writing.h"
#include "fit/quality.h"
#include "python/fit_options.h"
#include "python/module.h"
#include "python/results.h"
#include "subvol/error.h"
#include "subvol/mesh_io.h"
#include "subvol/surface_io.h"

namespace subvol::python {
namespace {

py::object read(const py::object& path, const py::kwargs& given) {
  Keywords keywords("read", given);
  bool check = true;
  keywords.take("check", check);
  keywords.finish();
  const std::string file = path_from(path);
  if (cli::is_high_order_file(file)) {
    std::shared_ptr<CurvedMesh> curved;
    {
      const py::gil_scoped_release unlocked;
      curved = std::make_shared<CurvedMesh>(read_high_order(file));
    }
    return py::cast(curved);
  }
  if (cli::is_volume_file(file)) return py::cast(std::const_pointer_cast<VolumeMesh>(volume_from(path, "path", check)));
  return py::cast(surface_from(path, "path"));
}

/// Options of `write`, and the file.
struct Writing {
  Writing(const py::object& path, const py::kwargs& given) {
    Keywords keywords("write", given);
    take_chord(keywords, options);
    keywords.take("unit", options.metres_per_unit);
    keywords.take("up", options.up_axis, {{"y", std::string("y")}, {"z", std::string("z")}});
    keywords.take("limit", limit);
    keywords.take("intervals", options.linear_intervals);
    keywords.finish();
    file.outputs = {path_from(path)};
    file.force = true;
  }
  /// InputError, IoError: the file cannot be written.
  cli::Output output(bool allow_cage) const { return cli::checked_outputs(file, allow_cage).front(); }

  cli::RunOptions file;
  cli::WritingOptions options;
  bool limit = false;
};

void write_volume_mesh(const Writing& writing, const VolumeMesh& mesh) {
  const cli::Output output = writing.output(false);
  if (!writing.limit || !cli::needs_limit(output)) return cli::write_output(output, mesh, writing.options);
  const TessellatedSurface limit = cli::tessellated_limit(mesh, writing.options);
  cli::write_output(output, mesh, mesh, &limit, writing.options);
}

void write_fit(const Writing& writing, const VolumeMesh& cage, const VolumeMesh& mesh) {
  const cli::Output output = writing.output(true);
  TessellatedSurface limit;
  if (cli::needs_limit(output)) limit = cli::tessellated_limit(cage, writing.options);
  cli::write_output(output, cage, mesh, &limit, writing.options);
}

void write_shell(const Writing& writing, const Shelled& result) {
  const cli::Output output = writing.output(true);
  if (result.curved_shell)
    cli::write_shell(output, result.shell, *result.curved_shell, writing.options);
  else
    cli::write_shell(output, result.shell, writing.options);
}

/// object as a Thing that is written by write(thing), without Python's lock.
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
  const auto write_curved = [&](const CurvedMesh& curved) {
    cli::write_output(writing.output(false), curved, writing.options);
  };
  const bool done =
      written<VolumeMesh>(object, [&](const VolumeMesh& mesh) { write_volume_mesh(writing, mesh); }) ||
      written<CurvedMesh>(object, write_curved) ||
      written<SurfaceMesh>(object, [&](const SurfaceMesh& surface) {
        cli::write_output(writing.output(false), surface.polygons, writing.options);
      }) ||
      written<Fitted>(object, [&](const Fitted& fit) {
        fit.curved ? write_curved(*fit.curved) : write_fit(writing, *fit.cage, *fit.mesh);
      }) ||
      written<Optimized>(object, [&](const Optimized& result) {
        result.curved ? write_curved(*result.curved) : write_volume_mesh(writing, *result.mesh);
      }) ||
      written<Shelled>(object, [&](const Shelled& shell) { write_shell(writing, shell); });
  if (!done)
    throw py::type_error("write: expected a mesh or a result, not " +
                         std::string(py::str(py::type::of(object).attr("__name__"))));
}

}  // namespace

void add_files(py::module_& module) {
  module.def("read", &read, py::arg("path"),
             R"(read(path, *, check=True)
--

Reads a file; its extension chooses the format: VolumeMesh (.mesh, .vtk), HighOrderMesh (.vtu as written here) or
SurfaceMesh (.off, .obj, .stl, .ply).

check  refuse volume meshes that are not sound, but for inverted cells and unused points)");
  module.def("write", &write, py::arg("path"), py::arg("what"),
             R"(write(path, what, *, chord=0.005, unit=1.0, up='y', limit=False, intervals=0)
--

Writes a mesh or a result; the extension chooses the format: .mesh .vtk .vtu .msh .glb .gltf .obj .usda. A file of that
name is replaced, once the new one is whole.

what       VolumeMesh, HighOrderMesh, SurfaceMesh, FitResult (its finest mesh; in a scene the limit surface, coloured by
           the quality of the cells; 'cage:FILE' is the cage), OptimizeResult, ShellResult (in a scene its sheets)
chord      how close triangles are to a curved surface, per cent of its bounding box's diagonal
unit, up   metres a unit has, and the mesh's upward axis, 'y' or 'z': for .glb, .gltf and .usda
limit      a VolumeMesh is a control mesh: scenes show its limit surface
intervals  of each edge of a curved cell where it becomes linear ones (.mesh, .vtk); 0: the largest order)");
}

}  // namespace subvol::python
