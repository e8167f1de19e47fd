// SPDX-License-Identifier: GPL-3.0-or-later
#include "python/meshes.h"

#include "cli/runs/check_report.h"
#include "python/arrays.h"
#include "python/groups.h"
#include "python/module.h"
#include "python/report.h"
#include "python/work.h"
#include "subvol/base/error.h"
#include "subvol/fit/quality/region_quality.h"
#include "subvol/io/sound_points.h"
#include "subvol/io/surface_io.h"
#include "subvol/mesh/features.h"
#include "subvol/mesh/validate.h"
#include "subvol/surface/boundary.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

namespace subvol::python {

using namespace internal;
namespace {

template <class Read>
auto read_with_warnings(const Read& read) {
  std::vector<std::string> warnings;
  auto result = [&] {
    const py::gil_scoped_release unlocked;
    return read(warnings);
  }();
  warn(warnings);
  return result;
}

[[noreturn]] void refuse(const py::object& object, const char* name, const char* wanted) {
  throw py::type_error(std::string(name) + " must be " + wanted + " or the path of a file, not " +
                       std::string(py::str(py::type::of(object).attr("__name__"))));
}

void require_finite(const std::vector<Vec3>& points, const char* name) {
  for (std::size_t i = 0; i < points.size(); ++i)
    if (!points[i].allFinite())
      throw InputError(std::string(name) + ": points[" + std::to_string(i) + "] is not finite");
}

// --- Tags -----------------------------------------------------------------------------------------------------------

double sharpness_of(const std::vector<double>& sharpness, std::size_t i) {
  return sharpness.empty() ? kInfiniteSharpness : sharpness[i];
}

std::vector<double> sharpness_from(const py::object& object, const char* name, std::size_t size) {
  if (object.is_none()) return {};
  std::vector<double> values = values_from(object, name);
  if (values.size() != size)
    throw InputError(std::string(name) + " must have " + std::to_string(size) + " entries, not " +
                     std::to_string(values.size()));
  return values;
}

/// Takes creases, crease_sharpness, corners, corner_sharpness.
FeatureTags take_tags(Keywords& keywords, std::size_t num_points) {
  FeatureTags tags;
  const std::vector<Index> creases = indices_from(keywords.object("creases"), "creases", 2, num_points),
                           corners = indices_from(keywords.object("corners"), "corners", 0, num_points);
  const std::vector<double> crease_sharpness =
      sharpness_from(keywords.object("crease_sharpness"), "crease_sharpness", creases.size() / 2);
  for (std::size_t i = 0; i < creases.size() / 2; ++i) {
    const auto [low, high] = std::minmax(creases[2 * i], creases[2 * i + 1]);
    tags.creases.push_back({low, high, sharpness_of(crease_sharpness, i)});
  }
  const std::vector<double> corner_sharpness =
      sharpness_from(keywords.object("corner_sharpness"), "corner_sharpness", corners.size());
  for (std::size_t i = 0; i < corners.size(); ++i)
    tags.corners.push_back({corners[i], sharpness_of(corner_sharpness, i)});
  return merge_tags(tags, {});
}

/// Adds the same four as properties: columns of the records themselves.
template <class Mesh, class... Extra>
void add_tags(py::class_<Mesh, Extra...>& type) {
  constexpr py::ssize_t kCreaseRecordBytes = sizeof(CreaseEdge), kCornerRecordBytes = sizeof(CornerVertex),
                        kIndexBytes = sizeof(Index);
  type.def_property_readonly(
      "creases",
      [](const py::object& self) {
        const auto& creases = self.cast<const Mesh&>().tags.creases;
        return shown(creases.empty() ? nullptr : &creases[0].v0, {static_cast<py::ssize_t>(creases.size()), 2}, self,
                     false, {kCreaseRecordBytes, kIndexBytes});
      },
      "Boundary edges kept sharp: (n, 2) int32, the smaller point first. A view.");
  type.def_property_readonly(
      "crease_sharpness",
      [](const py::object& self) {
        const auto& creases = self.cast<const Mesh&>().tags.creases;
        return shown(creases.empty() ? nullptr : &creases[0].sharpness, {static_cast<py::ssize_t>(creases.size())},
                     self, false, {kCreaseRecordBytes});
      },
      "Refinements each crease stays sharp for: (n,) float64; from 10 on for ever. A view.");
  type.def_property_readonly(
      "corners",
      [](const py::object& self) {
        const auto& corners = self.cast<const Mesh&>().tags.corners;
        return shown(corners.empty() ? nullptr : &corners[0].vertex, {static_cast<py::ssize_t>(corners.size())}, self,
                     false, {kCornerRecordBytes});
      },
      "Boundary points kept in their place: (n,) int32. A view.");
  type.def_property_readonly(
      "corner_sharpness",
      [](const py::object& self) {
        const auto& corners = self.cast<const Mesh&>().tags.corners;
        return shown(corners.empty() ? nullptr : &corners[0].sharpness, {static_cast<py::ssize_t>(corners.size())},
                     self, false, {kCornerRecordBytes});
      },
      "As crease_sharpness, of the corners: (n,) float64. A view.");
}

// --- Volume meshes --------------------------------------------------------------------------------------------------

struct KindName {
  CellKind kind;
  const char* plural;
};
constexpr std::array<KindName, kNumCellKinds> kCellKindNames{
    {{CellKind::hex, "hexes"}, {CellKind::prism, "prisms"}, {CellKind::tet, "tets"}, {CellKind::pyramid, "pyramids"}}};

std::shared_ptr<VolumeMesh> make_volume(const py::object& points, const py::kwargs& given) {
  Keywords keywords("VolumeMesh", given);
  auto mesh = std::make_shared<VolumeMesh>();
  mesh->positions = points_from(points, "points");
  for (const auto& [kind, plural] : kCellKindNames) {
    const auto corners = static_cast<std::size_t>(cell_topology(kind).num_vertices);
    const std::vector<Index> cells = indices_from(keywords.object(plural), plural, corners, mesh->num_vertices());
    for (std::size_t i = 0; i < cells.size(); i += corners) mesh->add_cell(kind, {cells.data() + i, corners});
  }
  mesh->references = integers_from(keywords.object("references"), "references", mesh->num_cells());
  mesh->tags = take_tags(keywords, mesh->num_vertices());
  mesh->face_groups = take_volume_groups(keywords, mesh->num_vertices());
  keywords.finish();
  return mesh;
}

/// Corners of the cells of a kind: the mesh's own memory if these cells are consecutive.
py::array cells_of(const py::object& self, CellKind kind) {
  const auto& mesh = self.cast<const VolumeMesh&>();
  const py::ssize_t corners = cell_topology(kind).num_vertices;
  const py::ssize_t count = std::count(mesh.kinds.begin(), mesh.kinds.end(), kind);
  const auto first = std::find(mesh.kinds.begin(), mesh.kinds.end(), kind);
  const bool together = std::all_of(first, first + count, [kind](CellKind k) { return k == kind; });
  if (together)
    return shown(count == 0 ? nullptr : mesh.cell(static_cast<std::size_t>(first - mesh.kinds.begin())).data(),
                 {count, corners}, self);
  std::vector<Index> gathered;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    if (mesh.kinds[c] == kind) gathered.insert(gathered.end(), mesh.cell(c).begin(), mesh.cell(c).end());
  const py::array array = moved(std::move(gathered));
  array.attr("setflags")(py::arg("write") = false);
  return py::array(array.attr("reshape")(count, corners));
}

std::string volume_text(const VolumeMesh& mesh) {
  std::string text = "<subvol.VolumeMesh: " + std::to_string(mesh.num_vertices()) + " points";
  for (const auto& [kind, plural] : kCellKindNames)
    if (const auto count = std::count(mesh.kinds.begin(), mesh.kinds.end(), kind); count > 0)
      text += ", " + std::to_string(count) + ' ' + plural;
  return text + '>';
}

using VolumeClass = py::class_<VolumeMesh, std::shared_ptr<VolumeMesh>>;

/// Adds the properties that show the arrays of cells.
void add_cell_arrays(VolumeClass& type) {
  for (const auto& [kind, plural] : kCellKindNames)
    type.def_property_readonly(
        plural, [k = kind](const py::object& self) { return cells_of(self, k); },
        "Point numbers of the cells of this kind: int32, one row for each. A view where these "
        "cells follow one another.");
  type.def_property_readonly(
      "kinds",
      [](const py::object& self) {
        const auto& kinds = self.cast<const VolumeMesh&>().kinds;
        return shown(reinterpret_cast<const std::uint8_t*>(kinds.data()), {static_cast<py::ssize_t>(kinds.size())},
                     self);
      },
      "Kind of each cell: (n,) uint8, TET, PRISM, HEX or PYRAMID. A view.");
  type.def_property_readonly(
      "cell_points",
      [](const py::object& self) {
        const auto& points = self.cast<const VolumeMesh&>().cell_vertices;
        return shown(points.data(), {static_cast<py::ssize_t>(points.size())}, self);
      },
      "Point numbers of all cells, one after another: int32. A view.");
  type.def_property_readonly(
      "cell_offsets",
      [](const py::object& self) { return shown_offsets(self.cast<const VolumeMesh&>().cell_offsets, self); },
      "Where each cell begins in cell_points, and the end: (n + 1,) int64. A view.");
  type.def_property_readonly(
      "references",
      [](const py::object& self) {
        const auto& references = self.cast<const VolumeMesh&>().references;
        return shown(references.data(), {static_cast<py::ssize_t>(references.size())}, self);
      },
      "Group number of each cell: (n,) int32; without entries where all are 0. A view.");
}

void add_volume_mesh(py::module_& module) {
  VolumeClass type(module, "VolumeMesh",
                   R"(A mesh of linear hexes, prisms, tets and pyramids.

points      (n, 3) numbers, in the mesh's own unit of length
hexes       (n, 8) point numbers: 0 1 2 3 seen from 4 5 6 7 counter-clockwise
prisms      (n, 6): 0 1 2 seen from 3 4 5 counter-clockwise
tets        (n, 4): 0 1 2 seen from 3 counter-clockwise
pyramids    (n, 5): 0 1 2 3 seen from the apex 4 counter-clockwise
references  a group number for each cell: of the hexes, then the prisms, the tets and the pyramids
creases     (n, 2) boundary edges kept sharp, for ever or through so many refinements
corners     (n,) boundary points kept in their place

Groups of faces, as of physical groups, side sets or materials:
group_names    list of str, and group_numbers (n,): one for each group; numbers are 1, 2, .. unless given
grouped_faces  (n, 4) point numbers of faces in any order; -1 in place of the fourth of a triangle
face_groups    (n,) the place of each face's group in group_names

The arrays given are copied. Those of a mesh are views of its memory, which they keep alive; only points can be written.
What is wrong with a mesh is told by `check`; InputError here only for arrays that do not fit together.)");
  type.def(py::init(&make_volume), py::arg("points"),
           R"(__init__(self, points, *, hexes=None, prisms=None, tets=None, pyramids=None, references=None,
    creases=None, crease_sharpness=None, corners=None, corner_sharpness=None, grouped_faces=None, face_groups=None,
    group_names=None, group_numbers=None)
--

Takes the arrays named above.)");
  type.def_property_readonly(
      "points", [](const py::object& self) { return shown_points(self.cast<const VolumeMesh&>().positions, self); },
      "(n, 3) float64. A view that can be written.");
  add_cell_arrays(type);
  add_tags(type);
  add_groups(type);
  type.def_property_readonly(
      "region_names", [](const VolumeMesh& mesh) { return region_names(mesh.regions); },
      "Names of references: dict of number and name.");
  type.def_property_readonly(
      "regions", [](const VolumeMesh& mesh) { return to_python(cli::regions_json(measure_regions(mesh, nullptr))); },
      "Cells, volume and boundary area of each region, and the area of each interface, as in the report of a check.");
  type.def("boundary", &cli::tagged_polygons,
           "boundary($self)\n--\n\nThe boundary as it stands: a SurfaceMesh with the mesh's tags.");
  type.def(
      "copy", [](const VolumeMesh& mesh) { return std::make_shared<VolumeMesh>(mesh); },
      "copy($self)\n--\n\nA mesh of its own with the same content.");
  type.def("__repr__", &volume_text);
}

// --- Surface meshes -------------------------------------------------------------------------------------------------

void add_faces(PolygonMesh& mesh, const std::vector<Index>& faces, std::size_t corners) {
  mesh.face_vertices.insert(mesh.face_vertices.end(), faces.begin(), faces.end());
  for (std::size_t i = 0; i < faces.size(); i += corners)
    mesh.face_offsets.push_back(mesh.face_offsets.back() + corners);
}

void add_polygons(PolygonMesh& mesh, const py::object& points, const py::object& offsets) {
  if (points.is_none() != offsets.is_none()) throw InputError("face_points and face_offsets go together");
  if (points.is_none()) return;
  if (!mesh.face_vertices.empty()) throw InputError("face_points: give either these or triangles and quads");
  mesh.face_vertices = indices_from(points, "face_points", 0, mesh.positions.size());
  const std::vector<Index> ends = indices_from(offsets, "face_offsets", 0, mesh.face_vertices.size() + 1);
  if (ends.empty() || ends.front() != 0 || static_cast<std::size_t>(ends.back()) != mesh.face_vertices.size())
    throw InputError("face_offsets must begin with 0 and end with the number of face_points, " +
                     std::to_string(mesh.face_vertices.size()));
  for (std::size_t f = 1; f < ends.size(); ++f) {
    const Index size = ends[f] - ends[f - 1];
    if (size < 3 || static_cast<std::size_t>(size) > kMaxPolygonCorners)
      throw InputError("face_offsets: face " + std::to_string(f - 1) + " has " + std::to_string(size) +
                       " corners, but must have 3 .. " + std::to_string(kMaxPolygonCorners));
    mesh.face_offsets.push_back(static_cast<std::size_t>(ends[f]));
  }
}

SurfaceMesh make_surface(const py::object& points, const py::object& triangles, const py::object& quads,
                         const py::kwargs& given) {
  Keywords keywords("SurfaceMesh", given);
  SurfaceMesh mesh;
  mesh.polygons.positions = points_from(points, "points");
  const std::size_t num_points = mesh.polygons.positions.size();
  add_faces(mesh.polygons, indices_from(triangles, "triangles", 3, num_points), 3);
  add_faces(mesh.polygons, indices_from(quads, "quads", 4, num_points), 4);
  const py::object face_points = keywords.object("face_points");
  add_polygons(mesh.polygons, face_points, keywords.object("face_offsets"));
  mesh.tags = take_tags(keywords, num_points);
  mesh.polygons.face_groups = take_face_groups(keywords, mesh.polygons.num_faces());
  keywords.finish();
  return mesh;
}

py::array faces_of(const py::object& self, std::size_t corners) {
  const PolygonMesh& mesh = self.cast<const SurfaceMesh&>().polygons;
  std::size_t first = mesh.num_faces(), count = 0, last = 0;
  for (std::size_t f = 0; f < mesh.num_faces(); ++f) {
    if (mesh.face_offsets[f + 1] - mesh.face_offsets[f] != corners) continue;
    first = std::min(first, f);
    last = f;
    ++count;
  }
  const auto rows = static_cast<py::ssize_t>(count), columns = static_cast<py::ssize_t>(corners);
  if (count == 0 || last - first + 1 == count)
    return shown(count == 0 ? nullptr : mesh.face_vertices.data() + mesh.face_offsets[first], {rows, columns}, self);
  std::vector<Index> gathered;
  for (std::size_t f = first; f <= last; ++f)
    if (mesh.face_offsets[f + 1] - mesh.face_offsets[f] == corners)
      gathered.insert(gathered.end(), mesh.face_vertices.begin() + static_cast<std::ptrdiff_t>(mesh.face_offsets[f]),
                      mesh.face_vertices.begin() + static_cast<std::ptrdiff_t>(mesh.face_offsets[f + 1]));
  const py::array array = moved(std::move(gathered));
  array.attr("setflags")(py::arg("write") = false);
  return py::array(array.attr("reshape")(rows, columns));
}

using SurfaceClass = py::class_<SurfaceMesh, std::shared_ptr<SurfaceMesh>>;

/// Adds the properties that show the arrays of faces.
void add_face_arrays(SurfaceClass& type) {
  type.def_property_readonly(
      "triangles", [](const py::object& self) { return faces_of(self, 3); },
      "Point numbers of the faces of three corners: (n, 3) int32. A view where these follow one another.");
  type.def_property_readonly(
      "quads", [](const py::object& self) { return faces_of(self, 4); },
      "Point numbers of the faces of four corners: (n, 4) int32. A view where these follow one another.");
  type.def_property_readonly(
      "face_points",
      [](const py::object& self) {
        const auto& points = self.cast<const SurfaceMesh&>().polygons.face_vertices;
        return shown(points.data(), {static_cast<py::ssize_t>(points.size())}, self);
      },
      "Point numbers of all faces, one after another: int32. A view.");
  type.def_property_readonly(
      "face_offsets",
      [](const py::object& self) { return shown_offsets(self.cast<const SurfaceMesh&>().polygons.face_offsets, self); },
      "Where each face begins in face_points, and the end: (n + 1,) int64. A view.");
}

/// Adds the properties that describe the groups of faces.
void add_surface_groups(SurfaceClass& type) {
  type.def_property_readonly(
      "group_names", [](const SurfaceMesh& mesh) { return names_of(mesh.polygons.face_groups.groups); }, kNamesHelp);
  type.def_property_readonly(
      "group_numbers",
      [](const py::object& self) {
        return numbers_of(self.cast<const SurfaceMesh&>().polygons.face_groups.groups, self);
      },
      kNumbersHelp);
  type.def_property_readonly(
      "face_groups",
      [](const py::object& self) {
        const auto& places = self.cast<const SurfaceMesh&>().polygons.face_groups.of_face;
        return shown(places.data(), {static_cast<py::ssize_t>(places.size())}, self);
      },
      "Place of each face's group in group_names, -1 for none: (n,) int32; without entries where there are no groups. "
      "A view.");
}

void add_surface_mesh(py::module_& module) {
  SurfaceClass type(module, "SurfaceMesh",
                    R"(A surface of triangles, quads and larger polygons: closed or not, a soup or not.

points        (n, 3) numbers
triangles     (n, 3) point numbers, quads (n, 4); or any polygons:
face_points   point numbers of all faces, one after another, and
face_offsets  (n + 1,) where each face begins in face_points, and the end
group_names   list of str, and group_numbers (n,): groups of faces; numbers are 1, 2, .. unless given
face_groups   (n,) the place of each face's group in group_names, -1 for none; triangles before quads

Tags and arrays as of VolumeMesh.)");
  type.def(py::init(&make_surface), py::arg("points"), py::arg("triangles") = py::none(), py::arg("quads") = py::none(),
           R"(__init__(self, points, triangles=None, quads=None, *, face_points=None, face_offsets=None, creases=None,
    crease_sharpness=None, corners=None, corner_sharpness=None, face_groups=None, group_names=None, group_numbers=None)
--

Takes the arrays named above.)");
  type.def_property_readonly(
      "points",
      [](const py::object& self) { return shown_points(self.cast<const SurfaceMesh&>().polygons.positions, self); },
      "(n, 3) float64. A view that can be written.");
  add_face_arrays(type);
  add_tags(type);
  add_surface_groups(type);
  type.def(
      "triangulated",
      [](const SurfaceMesh& mesh) {
        return SurfaceMesh{as_polygons(triangulate(mesh.polygons)), mesh.tags};
      },
      "triangulated($self)\n--\n\nThe same with larger faces cut into triangles.");
  type.def(
      "copy", [](const SurfaceMesh& mesh) { return mesh; },
      "copy($self)\n--\n\nA surface of its own with the same content.");
  type.def("__repr__", [](const SurfaceMesh& mesh) {
    return "<subvol.SurfaceMesh: " + std::to_string(mesh.polygons.positions.size()) + " points, " +
           std::to_string(mesh.polygons.num_faces()) + " faces>";
  });
}

}  // namespace

bool is_path(const py::object& object) {
  return py::isinstance<py::str>(object) || py::isinstance<py::bytes>(object) || py::hasattr(object, "__fspath__");
}

std::string path_from(const py::object& object) {
  const auto bytes = py::module_::import("os").attr("fsencode")(object);
  return bytes.cast<std::string>();
}

cli::LoadedMesh mesh_from_file(const std::string& path, bool check) {
  return read_with_warnings([&](std::vector<std::string>& warnings) { return cli::load_mesh(path, warnings, check); });
}

std::shared_ptr<const VolumeMesh> volume_from(const py::object& object, const char* name, bool check) {
  if (py::isinstance<VolumeMesh>(object)) return object.cast<std::shared_ptr<VolumeMesh>>();
  if (!is_path(object)) refuse(object, name, "a VolumeMesh");
  return read_with_warnings([&, path = path_from(object)](std::vector<std::string>& warnings) {
    return std::make_shared<const VolumeMesh>(cli::load_volume(path, warnings, check));
  });
}

Cells cells_from(const py::object& object, const char* name, bool check) {
  if (py::isinstance<CurvedMesh>(object)) return {nullptr, object.cast<std::shared_ptr<CurvedMesh>>()};
  if (!is_path(object)) return {volume_from(object, name, check), nullptr};
  cli::LoadedCells cells = read_with_warnings([&, path = path_from(object)](std::vector<std::string>& warnings) {
    return cli::load_cells(path, warnings, check);
  });
  if (auto* linear = std::get_if<VolumeMesh>(&cells))
    return {std::make_shared<const VolumeMesh>(std::move(*linear)), nullptr};
  return {nullptr, std::make_shared<const CurvedMesh>(std::get<HighOrderFile>(std::move(cells)))};
}

std::shared_ptr<const VolumeMesh> valid_volume_from(const py::object& object, const char* name) {
  std::shared_ptr<const VolumeMesh> mesh = volume_from(object, name);
  if (is_path(object)) return mesh;  // the reader has checked it
  require_valid(*mesh, name, InvertedCells::allowed);
  return mesh;
}

TriangleMesh triangles_from(const py::object& object, const char* name) {
  if (!is_path(object)) return triangulate(surface_from(object, name).polygons);
  return read_with_warnings(
      [path = path_from(object)](std::vector<std::string>& warnings) { return cli::load_surface(path, warnings); });
}

cli::Target target_from(const py::object& object, const char* name) {
  if (is_path(object))
    return read_with_warnings(
        [path = path_from(object)](std::vector<std::string>& warnings) { return cli::load_target(path, warnings); });
  const bool is_mesh = py::isinstance<SurfaceMesh>(object) || py::isinstance<VolumeMesh>(object);
  if (is_mesh || !(py::isinstance<py::sequence>(object) || py::hasattr(object, "__array__")))
    return triangles_from(object, name);
  std::vector<std::string> warnings;
  PointCloud cloud = sound_points(points_from(object, name), name, &warnings);
  warn(warnings);
  return cloud;
}

cli::Target target_with_regions_from(const py::object& object, const char* name) {
  if (is_path(object))
    return read_with_warnings([path = path_from(object)](std::vector<std::string>& warnings) {
      return cli::load_target_with_regions(path, warnings);
    });
  if (!py::isinstance<VolumeMesh>(object)) return target_from(object, name);
  const auto& mesh = object.cast<const VolumeMesh&>();
  require_finite(mesh.positions, name);
  return cli::surface_with_interfaces(mesh);
}

SurfaceMesh surface_from(const py::object& object, const char* name) {
  if (py::isinstance<SurfaceMesh>(object)) {
    const auto& surface = object.cast<const SurfaceMesh&>();
    require_finite(surface.polygons.positions, name);
    return surface;
  }
  if (py::isinstance<VolumeMesh>(object)) {
    const auto& mesh = object.cast<const VolumeMesh&>();
    require_finite(mesh.positions, name);
    return cli::tagged_polygons(mesh);
  }
  if (!is_path(object)) refuse(object, name, "a SurfaceMesh, a VolumeMesh");
  return read_with_warnings([path = path_from(object)](std::vector<std::string>& warnings) {
    return cli::load_tagged_polygons(path, warnings);
  });
}

SurfaceMesh shell_surface_from(const py::object& object, const char* name, std::string& region) {
  if (region.empty()) return surface_from(object, name);
  if (py::isinstance<VolumeMesh>(object)) {
    const auto& mesh = object.cast<const VolumeMesh&>();
    require_finite(mesh.positions, name);
    return cli::tagged_polygons(cli::cells_of_region(mesh, std::exchange(region, {})));
  }
  if (!is_path(object)) return surface_from(object, name);
  return read_with_warnings([&, path = path_from(object)](std::vector<std::string>& warnings) {
    return cli::load_shell_surface(path, region, warnings);
  });
}

void add_meshes(py::module_& module) {
  for (const auto& [kind, plural] : kCellKindNames) {
    std::string name = cell_topology(kind).name;
    std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::toupper(c); });
    module.attr(name.c_str()) = static_cast<int>(kind);
  }
  add_surface_mesh(module);
  add_volume_mesh(module);
}

}  // namespace subvol::python
