// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/loading.h"
#include "python/arrays.h"
#include "python/keywords.h"
#include "python/meshes.h"
#include "python/module.h"
#include "python/work.h"
#include "subvol/base/error.h"
#include "subvol/base/option_checks.h"
#include "subvol/shell/extrude.h"
#include "subvol/templates/auto_template.h"
#include "subvol/templates/carve.h"
#include "subvol/templates/cell_sheet.h"
#include "subvol/templates/cell_split.h"
#include "subvol/templates/pillow.h"
#include "subvol/templates/refine.h"
#include "subvol/templates/vertex_merge.h"
#include "subvol/templates/voxel_grid.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <utility>

namespace subvol::python {

using namespace internal;
namespace {

using MeshPointer = std::shared_ptr<VolumeMesh>;
using Box = std::array<double, 6>;

Vec3 low_corner(const Box& box) { return {box[0], box[1], box[2]}; }
Vec3 high_corner(const Box& box) { return {box[3], box[4], box[5]}; }

/// Calls make() without Python's lock and returns its result as a new mesh.
template <class Make>
MeshPointer made(const Make& make) {
  const py::gil_scoped_release unlocked;
  return std::make_shared<VolumeMesh>(make());
}

MeshPointer make_auto(const py::object& object, const py::kwargs& given) {
  Keywords keywords("auto", given);
  Work work(keywords);
  AutoTemplateOptions options;
  keywords.take("cells", options.cells);
  keywords.take("pillow", options.pillow);
  keywords.finish();
  const TriangleMesh target = triangles_from(object, "target");
  options.progress = [progress = work.progress()](double fraction) {
    return progress({.stage = "template", .level = 0, .iteration = 0, .energy = 0, .fraction = fraction});
  };
  AutoTemplateResult result = work.run("template", [&] { return auto_templates(target, options); });
  if (result.cancelled) throw InputError("auto: ended before there was a template");
  if (result.templates.empty())
    throw InputError("auto: no grid of up to 20 times " + std::to_string(options.cells) + " cells has the target's " +
                     to_string(result.wanted));
  AutoTemplate& best = result.templates.front();
  if (best.cells_asked != options.cells)
    warn({std::to_string(options.cells) + " cells cannot carry the target's " + to_string(result.wanted) + "; " +
          std::to_string(best.cells_asked) + " do"});
  return std::make_shared<VolumeMesh>(std::move(best.mesh));
}

MeshPointer make_grid(const py::object& surface, const py::kwargs& given) {
  Keywords keywords("grid", given);
  std::optional<Box> box;
  std::optional<std::array<int, 3>> counts;
  std::optional<double> size;
  double margin = 5;
  keywords.take("box", box);
  keywords.take("counts", counts);
  keywords.take("size", size);
  keywords.take("margin", margin);
  keywords.finish();
  require_in_range("grid", "margin", margin, 0, 1000);
  if (box.has_value() != surface.is_none()) throw InputError("grid: give a surface or box, one of them");
  if (counts.has_value() == size.has_value()) throw InputError("grid: give counts or size, one of them");
  Vec3 low, high;
  if (box) {
    low = low_corner(*box);
    high = high_corner(*box);
  } else {
    const auto around = box_around(triangles_from(surface, "surface"), margin);
    low = around[0];
    high = around[1];
  }
  return made([&] { return voxel_mesh(counts ? box_grid(low, high, *counts) : box_grid(low, high, *size)); });
}

/// Some cells of a mesh: those in a surface, in a box, on a list, or thin ones; exactly one of these.
class CellChoice {
 public:
  /// Takes inside, share, box and list.
  explicit CellChoice(Keywords& keywords) : inside_(keywords.object("inside")), list_(keywords.object("list")) {
    keywords.take("box", box_);
    keywords.take("share", share_);
  }
  /// Takes thin as well.
  void take_thin(Keywords& keywords) { keywords.take("thin", thin_); }

  /// choices  the available options, for the message if not exactly one is given.
  void prepare(const VolumeMesh& mesh, const char* choices) {
    if (!inside_.is_none() + box_.has_value() + !list_.is_none() + thin_ != 1) throw InputError(choices);
    cells_ = indices_from(list_, "list", 0, mesh.num_cells());
    if (!inside_.is_none()) surface_ = triangles_from(inside_, "inside");
  }
  /// To be called after `prepare`; needs no lock. One entry per cell, non-zero for the chosen cells.
  std::vector<char> chosen(const VolumeMesh& mesh) const {
    if (thin_) return thin_cells(mesh);
    if (box_) return cells_in_box(mesh, low_corner(*box_), high_corner(*box_));
    return surface_ ? cells_inside(mesh, *surface_, share_) : cells_listed(mesh, cells_);
  }

 private:
  py::object inside_, list_;
  std::optional<Box> box_;
  double share_ = 0.5;
  bool thin_ = false;
  std::vector<Index> cells_;
  std::optional<TriangleMesh> surface_;
};

MeshPointer make_carved(const py::object& object, const py::kwargs& given) {
  Keywords keywords("carve", given);
  CellChoice choice(keywords);
  bool invert = false;
  keywords.take("invert", invert);
  keywords.finish();
  const auto mesh = volume_from(object, "mesh");
  choice.prepare(*mesh, "carve: give one of inside, box and list");
  return made([&] {
    const std::vector<char> chosen = choice.chosen(*mesh);
    return carve(*mesh, [&](std::size_t c) { return (chosen[c] != 0) != invert; });
  });
}

MeshPointer make_refined(const py::object& object, const py::kwargs& given) {
  Keywords keywords("refine", given);
  CellChoice choice(keywords);
  choice.take_thin(keywords);
  keywords.finish();
  const auto mesh = valid_volume_from(object, "mesh");
  choice.prepare(*mesh, "refine: give one of inside, box, list and thin");
  bool any = false;
  MeshPointer refined = made([&] {
    const std::vector<char> chosen = choice.chosen(*mesh);
    any = std::find(chosen.begin(), chosen.end(), 1) != chosen.end();
    return refine_at(*mesh, vertices_of(*mesh, chosen));
  });
  if (!any) warn({"no cell is chosen: the mesh stays as it is"});
  return refined;
}

MeshPointer make_extruded(const py::object& object, const py::kwargs& given) {
  Keywords keywords("extrude", given);
  ExtrudeOptions options;
  std::optional<std::array<double, 3>> direction;
  keywords.take("thickness", options.thickness);
  keywords.take("layers", options.layers);
  keywords.take("growth", options.growth);
  keywords.take("direction", direction);
  keywords.finish();
  if (direction) options.direction = Vec3((*direction)[0], (*direction)[1], (*direction)[2]);
  const SurfaceMesh surface = surface_from(object, "surface");
  options.tags = surface.tags;
  return made([&] { return extrude(surface.polygons, options); });
}

MeshPointer make_pillowed(const py::object& object, const py::kwargs& given) {
  Keywords keywords("pillow", given);
  const py::object list = keywords.object("list");
  keywords.finish();
  const auto mesh = volume_from(object, "mesh");
  const std::vector<Index> cells = indices_from(list, "list", 0, mesh->num_cells());
  if (!list.is_none() && cells.empty()) throw InputError("pillow: list has no cells; None is all of them");
  return made([&] { return pillow(*mesh, cells); });
}

using TwoPoints = std::array<int, 2>;

MeshPointer make_collapsed(const py::object& object, const py::kwargs& given) {
  using Collapse = VolumeMesh (*)(const VolumeMesh&, Index, Index);
  Keywords keywords("collapse", given);
  std::optional<TwoPoints> vertices;
  Collapse collapse = collapse_sheet;
  keywords.take("vertices", vertices);
  keywords.take("what", collapse, {{"sheet", collapse_sheet}, {"face", collapse_face}, {"edge", collapse_edge}});
  keywords.finish();
  if (!vertices) throw InputError("collapse: vertices must be given");
  const auto mesh = volume_from(object, "mesh");
  return made([&] { return collapse(*mesh, (*vertices)[0], (*vertices)[1]); });
}

MeshPointer make_merged(const py::object& object, const py::object& other, const py::kwargs& given) {
  Keywords keywords("merge", given);
  double tolerance = 1e-6;
  keywords.take("tolerance", tolerance);
  keywords.finish();
  require_in_range("merge", "tolerance", tolerance, 0, 10);
  const auto mesh = volume_from(object, "mesh");
  const auto beside = other.is_none() ? nullptr : volume_from(other, "other");
  return made([&] {
    const VolumeMesh both = beside ? joined(*mesh, *beside) : *mesh;
    Eigen::AlignedBox3d box;
    for (const Vec3& p : both.positions) box.extend(p);
    return glue(both, tolerance / 100 * box.diagonal().norm());
  });
}

MeshPointer make_split(const py::object& object, const py::kwargs& given) {
  enum class Into { parts, prisms, tets };
  Keywords keywords("split", given);
  Into into = Into::parts;
  std::optional<TwoPoints> edge;
  int parts = 2;
  keywords.take("into", into, {{"parts", Into::parts}, {"prisms", Into::prisms}, {"tets", Into::tets}});
  keywords.take("edge", edge);
  keywords.take("parts", parts);
  keywords.finish();
  if (into != Into::tets && !edge) throw InputError("split: into parts or prisms needs edge");
  const auto mesh = volume_from(object, "mesh");
  return made([&] {
    return into == Into::tets     ? split_into_tets(*mesh)
           : into == Into::prisms ? split_into_prisms(*mesh, (*edge)[0], (*edge)[1])
                                  : split_sheet(*mesh, (*edge)[0], (*edge)[1], parts);
  });
}

/// Adds the functions that make a mesh of a surface, a box or a grid.
void add_makers(py::module_& group) {
  group.def("auto", &make_auto, py::arg("target"),
            R"(auto(target, *, cells=300, pillow=False, progress=None, threads=None)
--

Makes a template from a surface: a carved grid with its topology, of about so many cells, more where it needs them.

pillow  put a layer of cells around the whole boundary, counted in)");
  group.def("grid", &make_grid, py::arg("surface") = py::none(),
            R"(grid(surface=None, *, box=None, counts=None, size=None, margin=5.0)
--

Fills a box with equal hexes.

surface  the box around it, moved outward by margin percent of its diagonal; or
box      x0 y0 z0 x1 y1 z1
counts   cells along each axis; or
size     about how long a cell is)");
  group.def("carve", &make_carved, py::arg("mesh"),
            R"(carve(mesh, *, inside=None, share=0.5, box=None, list=None, invert=False)
--

Keeps the cells that lie in a surface by so much of their volume, or whose center is in a box, or that are listed; or,
with invert, the others.)");
  group.def("extrude", &make_extruded, py::arg("surface"),
            R"(extrude(surface, *, thickness, layers=1, growth=1.0, direction=None)
--

Stacks hexes and prisms on the faces of a surface, along its normals or a direction (x, y, z).

thickness  length of all layers together)");
}

/// Adds the functions that change the cells of a mesh.
void add_edits(py::module_& group) {
  group.def("pillow", &make_pillowed, py::arg("mesh"),
            R"(pillow(mesh, *, list=None)
--

Puts a layer of cells inside the boundary, or around the cells listed.)");
  group.def("refine", &make_refined, py::arg("mesh"),
            R"(refine(mesh, *, inside=None, share=0.5, box=None, list=None, thin=False)
--

Cuts some hexes in 27, and those around so that they fit: chosen as `carve` does, or those that are all there is between
two sides of the mesh.)");
  group.def("collapse", &make_collapsed, py::arg("mesh"),
            R"(collapse(mesh, *, vertices, what='sheet')
--

Takes cells out by shrinking the 'sheet' of an edge, the 'face' with two opposite corners and its column, or an 'edge'.

vertices  the two points)");
  group.def("merge", &make_merged, py::arg("mesh"), py::arg("other") = py::none(),
            R"(merge(mesh, other=None, *, tolerance=1e-06)
--

Glues faces that lie on each other, of one mesh or two; tolerance in percent of the box's diagonal.)");
  group.def("split", &make_split, py::arg("mesh"),
            R"(split(mesh, *, into='parts', edge=None, parts=2)
--

Cuts the sheet of an edge into 'parts', or all cells into 'prisms' along an edge, or 'tets'.)");
}

}  // namespace

void add_templates(py::module_& module) {
  py::module_ group = module.def_submodule("_template", "Makes and edits coarse meshes to fit with.");
  group.attr("__name__") = "subvol.template";
  add_makers(group);
  add_edits(group);
}

}  // namespace subvol::python
