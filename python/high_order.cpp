// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/check_report.h"
#include "python/arrays.h"
#include "python/fit_options.h"
#include "python/groups.h"
#include "python/meshes.h"
#include "python/module.h"
#include "python/report.h"
#include "subvol/base/error.h"
#include "subvol/export/export.h"
#include "subvol/export/lagrange_mesh.h"
#include "subvol/fit/quality/region_quality.h"
#include "subvol/mesh/pyramids.h"
#include "subvol/surface/boundary.h"

namespace subvol::python {

using namespace internal;
namespace {

std::shared_ptr<CurvedMesh> make_curved(const py::object& object, int order, const py::kwargs& given) {
  Keywords keywords("HighOrderMesh", given);
  Basis basis = HighOrderFitOptions{}.basis;
  keywords.take("basis", basis, bases());
  keywords.finish();
  const auto mesh = valid_volume_from(object, "mesh");
  require_no_pyramids(mesh->kinds, "mesh: pyramids cannot be curved");
  return std::make_shared<CurvedMesh>(CurvedMesh{HighOrderMesh(ElementSpace(*mesh, basis, order), *mesh),
                                                 mesh->references, mesh->face_groups, mesh->regions});
}

std::vector<CellPoint> cell_points(const py::object& cells, const py::object& points, const CurvedMesh& curved) {
  const std::vector<Index> numbers = indices_from(cells, "cells", 0, curved.mesh.space.num_cells());
  const std::vector<Vec3> places = points_from(points, "points");
  if (numbers.size() != places.size())
    throw InputError("cells and points must have as many rows, not " + std::to_string(numbers.size()) + " and " +
                     std::to_string(places.size()));
  std::vector<CellPoint> result;
  for (std::size_t i = 0; i < numbers.size(); ++i) result.push_back({numbers[i], places[i]});
  return result;
}

auto orders_shown(std::vector<int> EntityOrders::*orders_of) {
  return [orders_of](const py::object& self) {
    const std::vector<int>& orders = self.cast<const CurvedMesh&>().mesh.space.orders().*orders_of;
    return shown(orders.data(), {static_cast<py::ssize_t>(orders.size())}, self);
  };
}

using HighOrderClass = py::class_<CurvedMesh, std::shared_ptr<CurvedMesh>>;

/// Adds the properties that describe the nodes, the basis and the orders.
void add_nodes_and_orders(HighOrderClass& type) {
  type.def_property_readonly(
      "coefficients",
      [](const py::object& self) { return shown_points(self.cast<const CurvedMesh&>().mesh.coefficients, self); },
      "(nodes, 3) float64: positions of the points, then displacements. A view that can be written.");
  type.def_property_readonly(
      "basis", [](const CurvedMesh& curved) { return to_string(curved.mesh.space.basis()); },
      "'legendre' or 'fourier'.");
  type.def_property_readonly(
      "order", [](const CurvedMesh& curved) { return curved.mesh.space.max_order(); },
      "Largest order of its edges, faces and cells.");
  type.def_property_readonly("edge_orders", orders_shown(&EntityOrders::edges), "Of each edge: (n,) int32. A view.");
  type.def_property_readonly("face_orders", orders_shown(&EntityOrders::faces), "Of each face: (n,) int32. A view.");
  type.def_property_readonly("cell_orders", orders_shown(&EntityOrders::cells), "Of each cell: (n,) int32. A view.");
}

/// Adds the properties that describe references, groups and regions.
void add_regions(HighOrderClass& type) {
  type.def_property_readonly(
      "references",
      [](const py::object& self) {
        const auto& references = self.cast<const CurvedMesh&>().references;
        return shown(references.data(), {static_cast<py::ssize_t>(references.size())}, self);
      },
      "Group number of each cell: (n,) int32; without entries where all are 0. A view.");
  add_groups(type);
  type.def_property_readonly(
      "region_names", [](const CurvedMesh& curved) { return region_names(curved.regions); },
      "Names of references: dict of number and name.");
  type.def_property_readonly(
      "regions",
      [](const CurvedMesh& curved) {
        return to_python(cli::regions_json(measure_regions(curved.mesh, {curved.references, curved.regions}, nullptr)));
      },
      "Cells, volume and boundary area of each region, and the area of each interface, as in the report of a check.");
}

/// Adds the methods that return positions at points of the cells.
void add_positions(HighOrderClass& type) {
  type.def(
      "point_map",
      [](const CurvedMesh& curved, const py::object& cells, const py::object& points) {
        return std::make_shared<SparseMap>(point_map(curved.mesh.space, cell_points(cells, points, curved)));
      },
      py::arg("cells"), py::arg("points"),
      "point_map($self, cells, points)\n--\n\nThe SparseMap from coefficients to positions at points of cells.\n\n"
      "cells   (n,) cell numbers\npoints  (n, 3) canonical coordinates, in [0, 1]");
  type.def(
      "evaluate",
      [](const CurvedMesh& curved, const py::object& cells, const py::object& points) {
        const SparseMap map = point_map(curved.mesh.space, cell_points(cells, points, curved));
        return moved_points(map.apply(curved.mesh.coefficients));
      },
      py::arg("cells"), py::arg("points"),
      "evaluate($self, cells, points)\n--\n\nPositions at points of cells: (n, 3). Arguments as of point_map.");
}

/// Adds the methods that return other meshes.
void add_other_meshes(HighOrderClass& type) {
  type.def(
      "straight_sided",
      [](const CurvedMesh& curved) {
        VolumeMesh mesh = curved.mesh.straight_sided();
        mesh.references = curved.references;
        mesh.face_groups = curved.face_groups;
        mesh.regions = curved.regions;
        return std::make_shared<VolumeMesh>(std::move(mesh));
      },
      "straight_sided($self)\n--\n\nThe points with linear cells between them: VolumeMesh.");
  type.def(
      "linear_cells",
      [](const CurvedMesh& curved, int intervals) {
        const py::gil_scoped_release unlocked;
        return std::make_shared<VolumeMesh>(linear_cells(curved.mesh, intervals));
      },
      py::arg("intervals"),
      "linear_cells($self, intervals)\n--\n\nThe curved cells as intervals**3 linear ones each: VolumeMesh.");
  type.def(
      "boundary",
      [](const CurvedMesh& curved, double chord) {
        require_chord(chord);
        const py::gil_scoped_release unlocked;
        CurvedBoundary boundary = curved_boundary(curved.mesh, chord);
        const std::vector<Index> groups = groups_of_boundary(curved.face_groups, curved.mesh.space.topology());
        boundary.triangles.face_groups.groups = curved.face_groups.groups;
        if (!groups.empty())
          for (const Index face : boundary.faces) boundary.triangles.face_groups.of_face.push_back(groups[face]);
        return SurfaceMesh{as_polygons(boundary.triangles), {}};
      },
      py::arg("chord") = cli::WritingOptions{}.chord_percent,
      "boundary($self, chord=0.005)\n--\n\n"
      "The curved boundary as triangles within chord percent of its diagonal: SurfaceMesh.");
  type.def(
      "copy", [](const CurvedMesh& curved) { return std::make_shared<CurvedMesh>(curved); },
      "copy($self)\n--\n\nA mesh of its own with the same content.");
}

}  // namespace

void add_high_order_mesh(py::module_& module) {
  HighOrderClass type(
      module, "HighOrderMesh",
      R"(A mesh of curved cells: one coefficient for each point, then those of the modes of edges, faces and cells.

mesh   VolumeMesh or its path: the cells start straight
order  of every edge, face and cell, 1 .. 16
basis  'legendre' or 'fourier')");
  type.def(py::init(&make_curved), py::arg("mesh"), py::arg("order"),
           R"(__init__(self, mesh, order, *, basis='legendre')
--

Straight cells to begin with.)");
  add_nodes_and_orders(type);
  add_regions(type);
  add_positions(type);
  add_other_meshes(type);
  type.def("__repr__", [](const CurvedMesh& curved) {
    const ElementSpace& space = curved.mesh.space;
    return "<subvol.HighOrderMesh: " + std::to_string(space.num_cells()) + " cells of order " +
           std::to_string(space.max_order()) + ", " + std::to_string(space.num_nodes()) + " nodes, " +
           to_string(space.basis()) + '>';
  });
}

}  // namespace subvol::python
