// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/viewing.h"
#include "python/keywords.h"
#include "python/meshes.h"
#include "python/module.h"
#include "subvol/base/atomic_file.h"
#include "subvol/base/error.h"
#include "subvol/base/markup.h"
#include "subvol/export/viewer_page.h"
#include "subvol/mesh/validate.h"

#include <optional>
#include <stdexcept>
#include <utility>

namespace subvol::python {

using namespace internal;
namespace {

/// A page of the viewer.
struct View {
  std::string html;
};

/// Refuses what no picture can be made of; arrays of meshes can be written to.
void require_drawable(const VolumeMesh& mesh) {
  using Kind = MeshDefect::Kind;
  for (const MeshDefect& defect : validate(mesh))
    for (const Kind kind : {Kind::no_cells, Kind::size_mismatch, Kind::index_out_of_range, Kind::not_finite})
      if (defect.kind == kind) throw InputError("mesh: " + defect.message);
}

cli::ShownMesh shown_mesh(const py::object& object) {
  if (py::isinstance<CurvedMesh>(object)) return *object.cast<std::shared_ptr<CurvedMesh>>();
  if (py::isinstance<SurfaceMesh>(object)) return surface_from(object, "mesh").polygons;
  const std::shared_ptr<const VolumeMesh> mesh = volume_from(object, "mesh", false);
  require_drawable(*mesh);
  return *mesh;
}

View view(const py::object& object, const py::object& target_object, const py::kwargs& given) {
  Keywords keywords("show", given);
  cli::ViewingOptions options;
  std::string title = "subvol";
  keywords.take("limit", options.limit);
  keywords.take("title", title);
  keywords.finish();
  if (!has_viewer())
    throw std::runtime_error(
        "this module was built without the viewer, which needs node and the npm packages three and "
        "esbuild (docs/viewer.md)");
  const cli::ShownMesh mesh = shown_mesh(object);
  std::optional<TriangleMesh> target;
  if (!target_object.is_none()) target = triangles_from(target_object, "target");
  const py::gil_scoped_release unlocked;
  if (target) options.target = &*target;
  std::vector<std::string> warnings;
  return {viewer_page(cli::mesh_content(title, mesh, options, warnings))};
}

/// A page as a frame inside another.
std::string frame(const std::string& page) {
  return "<iframe title=\"subvol\" style=\"width: 100%; height: 36rem; border: 0\" srcdoc=\"" +
         internal::escaped_markup(page) + "\"></iframe>";
}

void add_show(py::module_& module, const char* name) {
  py::object type = module.attr(name);
  type.attr("show") = py::cpp_function([](const py::object& self, const py::object& target,
                                          const py::kwargs& given) { return view(self, target, given); },
                                       py::name("show"), py::is_method(type), py::arg("target") = py::none(),
                                       R"(show(self, target=None, *, limit=False, title='subvol')
--

A View of the mesh: a page in which it can be turned, cut, peeled and filtered. Notebooks show it.

target  a surface, shown as a ghost; the mesh can be colored by its distance from it
limit   the mesh is a control cage: its limit surface is shown, too
InputError: arrays that are no mesh. RuntimeError: the module was built without the viewer.)");
  type.attr("_repr_html_") = py::cpp_function(
      [](const py::object& self) -> py::object {
        if (!has_viewer()) return py::none();
        try {
          return py::str(frame(view(self, py::none(), py::kwargs()).html));
        } catch (const InputError&) {
          return py::none();  // the plain text is shown
        }
      },
      py::name("_repr_html_"), py::is_method(type));
}

}  // namespace

void add_viewing(py::module_& module) {
  py::class_<View> type(module, "View", "A page of the viewer; `show` of meshes returns it.");
  type.def_readonly("html", &View::html, "The page: str. It needs nothing else.");
  type.def(
      "save", [](const View& page, const py::object& path) { write_file_atomically(path_from(path), page.html); },
      py::arg("path"), R"(save(self, path)
--

Writes the page to a file, which is replaced. IoError: the system refuses.)");
  type.def("_repr_html_", [](const View& page) { return frame(page.html); });
  add_show(module, "VolumeMesh");
  add_show(module, "SurfaceMesh");
  add_show(module, "HighOrderMesh");
}

}  // namespace subvol::python
