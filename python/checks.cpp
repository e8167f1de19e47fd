// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/check_report.h"
#include "cli/runs/face_groups.h"
#include "python/arrays.h"
#include "python/fit_options.h"
#include "python/module.h"
#include "python/report.h"
#include "python/results.h"
#include "subvol/base/error.h"
#include "subvol/export/curved_file.h"
#include "subvol/fit/geometry/self_intersection.h"
#include "subvol/fit/mesh_check.h"

#include <algorithm>
#include <utility>
#include <variant>

namespace subvol::python {

using namespace internal;
namespace {

/// The mesh to check: linear or curved cells, from memory or a file.
struct CheckedMesh : Cells {
  explicit CheckedMesh(const py::object& object) : Cells(cells_from(object, "mesh", false)) {
    if (!curved || !is_path(object)) return;
    const std::string path = path_from(object);
    const py::gil_scoped_release unlocked;
    if (holds_exact_map(path)) lagrange = cli::check_lagrange_cells(path, curved->mesh);
  }

  std::optional<cli::LagrangeCheck> lagrange;  ///< for a .vtu
};

py::dict check(const py::object& object, const py::object& target_object, const py::kwargs& given) {
  Keywords keywords("check", given);
  Work work(keywords);
  cli::WritingOptions writing;
  take_chord(keywords, writing);
  keywords.finish();
  const CheckedMesh mesh(object);
  std::optional<cli::Target> target;
  if (!target_object.is_none()) target = target_from(target_object, "target");
  const auto check_against = [&](auto against) {
    MeshCheckOptions options{.progress = work.parts()};
    if (mesh.linear) return check_mesh(*mesh.linear, against, options);
    options.labels = {mesh.curved->references, mesh.curved->regions};
    const HighOrderMesh& curved = mesh.curved->mesh;
    const bool is_finite = std::ranges::all_of(curved.coefficients, [](const Vec3& x) { return x.allFinite(); });
    // The check reports what is not finite, and does not look at the boundary then.
    const CurvedBoundary boundary = is_finite ? curved_boundary(curved, writing.chord_percent) : CurvedBoundary{};
    return check_mesh(curved, boundary, against, options);
  };
  MeshCheck found = work.run("check", [&] {
    if (!target) return check_against(static_cast<const TriangleMesh*>(nullptr));
    return std::visit([&](const auto& geometry) { return check_against(&geometry); }, *target);
  });
  py::dict report = to_python(cli::check_json(found));
  if (target && found.quality) {
    const cli::GroupsFound groups = work.run("groups", [&] {
      return mesh.linear ? cli::compare_groups(*target, *mesh.linear) : cli::compare_groups(*target, *mesh.curved);
    });
    if (!groups.groups.empty()) report["groups"] = to_python(cli::groups_json(groups.groups));
  }
  if (mesh.lagrange) {
    report["valid"] = found.valid() && mesh.lagrange->valid();
    report["lagrange_cells"] = to_python(cli::lagrange_json(*mesh.lagrange));
  }
  if (found.subdivision_audit) report["audit"] = to_python(cli::audit_json(*found.subdivision_audit));
  if (!found.quality) return report;
  report["not_certified_cells"] = moved(std::move(found.quality->certificate.not_certified));
  report["cell_scaled_jacobian"] = moved(std::move(found.quality->cell_minima));
  return report;
}

py::dict distance(const py::object& surface, const py::object& target_object, const py::kwargs& given) {
  Keywords keywords("distance", given);
  Work work(keywords);
  SurfaceDistanceOptions options;
  keywords.take("samples", options.num_samples);
  keywords.finish();
  const TriangleMesh ours = triangles_from(surface, "surface"), target = triangles_from(target_object, "target");
  const SurfaceDistance found = work.run("distance", [&] { return surface_distance(ours, target, options); });
  return to_python(cli::distance_json(found, bounding_box_diagonal(target)));
}

py::array intersections(const py::object& object) {
  const TriangleMesh surface = triangles_from(object, "surface");
  SelfIntersections found;
  {
    const py::gil_scoped_release unlocked;
    found = self_intersections(surface);
  }
  std::vector<Index> pairs;
  for (const auto& [a, b] : found.pairs) pairs.insert(pairs.end(), {a, b});
  return py::array(moved(std::move(pairs)).attr("reshape")(-1, 2));
}

}  // namespace

void add_checks(py::module_& module) {
  module.def("check", &check, py::arg("mesh"), py::arg("target") = py::none(),
             R"(check(mesh, target=None, *, chord=0.005, progress=None, threads=None)
--

Says what is true of a mesh: dict, with the entries of docs/cli.md and two arrays.

mesh      VolumeMesh, HighOrderMesh, or the path of either; anything may be wrong with it
target    measure the distance to it: SurfaceMesh, VolumeMesh, points as an (n, 3) array, or path
progress  called with a Progress before each part (stage and fraction); returns False to end there

valid                 sound, every cell proved to be nowhere inverted, the boundary free of self-intersections
quality, distance, boundary_self_intersections, topology, defects, audit, ...
cell_scaled_jacobian  least of each cell: (n,) float64
not_certified_cells   (m,) int32)");
  module.def("distance", &distance, py::arg("surface"), py::arg("target"),
             R"(distance(surface, target, *, samples=50000, progress=None, threads=None)
--

Distances between two surfaces, both ways: dict, lengths and percent of the diagonal of the target's bounding box.

samples  about so many points carry each mean)");
  module.def("self_intersections", &intersections, py::arg("surface"),
             R"(self_intersections(surface)
--

Pairs of triangles, of surface.triangulated(), that meet in more than their common corners and edge: (n, 2) int32.)");
}

}  // namespace subvol::python
