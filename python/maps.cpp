// SPDX-License-Identifier: GPL-3.0-or-later
#include "python/arrays.h"
#include "python/fit_options.h"
#include "python/meshes.h"
#include "python/module.h"
#include "python/work.h"
#include "subvol/base/error.h"
#include "subvol/export/tessellate.h"
#include "subvol/mesh/features.h"
#include "subvol/subdivision/limit_surface.h"
#include "subvol/subdivision/repeated_subdivision.h"

namespace subvol::python {

using namespace internal;
namespace {

enum class Refinement { catmull_clark, averaging, linear };

/// Arguments of `subdivide` and `subdivision_matrix`.
struct Subdivision {
  Subdivision(const char* name, const py::object& object, const py::kwargs& given) {
    Keywords keywords(name, given);
    std::optional<double> crease_angle;
    keywords.take("levels", levels);
    keywords.take("boundary", refinement,
                  {{"catmull-clark", Refinement::catmull_clark},
                   {"averaging", Refinement::averaging},
                   {"linear", Refinement::linear}});
    keywords.take("crease_angle", crease_angle);
    keywords.finish();
    mesh = valid_volume_from(object, "mesh");
    if (!crease_angle) return;
    VolumeMesh creased = *mesh;
    creased.tags = merge_tags(creased.tags, features_by_angle(creased, *crease_angle));
    mesh = std::make_shared<const VolumeMesh>(std::move(creased));
  }

  VolumeMesh refined(SparseMap* matrix = nullptr) const {
    if (refinement == Refinement::linear) return split_repeatedly(*mesh, levels, matrix);
    const bool averages = refinement == Refinement::averaging;
    return subdivide_repeatedly(*mesh, levels, averages ? BoundaryRule::averaging : BoundaryRule::catmull_clark,
                                matrix);
  }

  std::shared_ptr<const VolumeMesh> mesh;
  int levels = 1;
  Refinement refinement = Refinement::catmull_clark;
};

std::shared_ptr<VolumeMesh> subdivide_mesh(const py::object& object, const py::kwargs& given) {
  const Subdivision asked("subdivide", object, given);
  const py::gil_scoped_release unlocked;
  return std::make_shared<VolumeMesh>(asked.refined());
}

std::shared_ptr<SparseMap> matrix_of(const py::object& object, const py::kwargs& given) {
  const Subdivision asked("subdivision_matrix", object, given);
  const py::gil_scoped_release unlocked;
  auto matrix = std::make_shared<SparseMap>();
  asked.refined(matrix.get());
  return matrix;
}

std::shared_ptr<SparseMap> limit_of(const py::object& object) {
  const auto mesh = valid_volume_from(object, "mesh");
  const py::gil_scoped_release unlocked;
  return std::make_shared<SparseMap>(limit_map(*mesh));
}

SurfaceMesh limit_surface(const py::object& object, const py::kwargs& given) {
  Keywords keywords("limit_surface", given);
  cli::WritingOptions writing;
  take_chord(keywords, writing);
  keywords.finish();
  const auto cage = valid_volume_from(object, "cage");
  const py::gil_scoped_release unlocked;
  TessellatedSurface surface = cli::tessellated_limit(*cage, writing);
  SurfaceMesh mesh;
  mesh.polygons.positions = std::move(surface.positions);
  for (const auto& quad : surface.quads) {
    mesh.polygons.face_vertices.insert(mesh.polygons.face_vertices.end(), quad.begin(), quad.end());
    mesh.polygons.face_offsets.push_back(mesh.polygons.face_vertices.size());
  }
  return mesh;
}

std::vector<Vec3> points_for(const py::object& object, std::size_t wanted) {
  std::vector<Vec3> points = points_from(object, "points");
  if (points.size() != wanted)
    throw InputError("points must have " + std::to_string(wanted) + " rows, not " + std::to_string(points.size()));
  return points;
}

void add_sparse_map(py::module_& module) {
  py::class_<SparseMap, std::shared_ptr<SparseMap>> type(module, "SparseMap",
                                                         R"(A sparse matrix by rows (CSR) that maps points to points.

scipy.sparse.csr_matrix((S.data, S.indices, S.indptr), shape=S.shape) is the same matrix; columns of a row ascend.)");
  type.def_property_readonly(
      "shape", [](const SparseMap& map) { return py::make_tuple(map.num_rows(), map.num_cols); }, "(rows, columns).");
  type.def_property_readonly(
      "data",
      [](const py::object& self) {
        const auto& values = self.cast<const SparseMap&>().values;
        return shown(values.data(), {static_cast<py::ssize_t>(values.size())}, self);
      },
      "The entries: float64. A view.");
  type.def_property_readonly(
      "indices",
      [](const py::object& self) {
        const auto& columns = self.cast<const SparseMap&>().columns;
        return shown(columns.data(), {static_cast<py::ssize_t>(columns.size())}, self);
      },
      "Their columns: int32. A view.");
  type.def_property_readonly(
      "indptr", [](const py::object& self) { return shown_offsets(self.cast<const SparseMap&>().offsets, self); },
      "Where each row begins, and the end: (rows + 1,) int64. A view.");
  type.def(
      "apply",
      [](const SparseMap& map, const py::object& points) {
        const std::vector<Vec3> in = points_for(points, map.num_cols);
        return moved_points(map.apply(in));
      },
      py::arg("points"), "apply($self, points)\n--\n\nThe matrix times (columns, 3) numbers: (rows, 3) float64.");
  type.def(
      "apply_transposed",
      [](const SparseMap& map, const py::object& points) {
        const std::vector<Vec3> in = points_for(points, map.num_rows());
        std::vector<Vec3> out(map.num_cols);
        map.apply_transposed(in, out);
        return moved_points(std::move(out));
      },
      py::arg("points"), "apply_transposed($self, points)\n--\n\nThe transpose times (rows, 3) numbers: (columns, 3).");
  type.def("__repr__", [](const SparseMap& map) {
    return "<subvol.SparseMap: " + std::to_string(map.num_rows()) + " x " + std::to_string(map.num_cols) + ", " +
           std::to_string(map.num_nonzeros()) + " entries>";
  });
}

}  // namespace

void add_maps(py::module_& module) {
  add_sparse_map(module);
  module.def("subdivide", &subdivide_mesh, py::arg("mesh"),
             R"(subdivide(mesh, *, levels=1, boundary='catmull-clark', crease_angle=None)
--

Refines a control mesh: VolumeMesh of hexes.

mesh          VolumeMesh or its path
levels        times it is refined, 0 .. 8
boundary      'catmull-clark', 'averaging', or 'linear': cells are only split, and no vertex moves
crease_angle  degrees: boundary edges sharper than this become creases as well)");
  module.def("subdivision_matrix", &matrix_of, py::arg("mesh"),
             R"(subdivision_matrix(mesh, *, levels=1, boundary='catmull-clark', crease_angle=None)
--

S with subdivide(mesh).points == S.apply(mesh.points), for several levels the product: SparseMap.

Arguments as of `subdivide`.)");
  module.def("limit_matrix", &limit_of, py::arg("mesh"),
             R"(limit_matrix(mesh)
--

The square SparseMap that moves boundary points to the Catmull-Clark limit surface; others stay.)");
  module.def("limit_surface", &limit_surface, py::arg("cage"),
             R"(limit_surface(cage, *, chord=0.005)
--

The limit surface of a control mesh as quads within chord percent of its diagonal: SurfaceMesh.

Points along creases of infinite sharpness are there once for each side.)");
}

}  // namespace subvol::python
