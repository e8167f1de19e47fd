// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/error.h"
#include "subvol/export/boundary_file.h"
#include "subvol/export/cell_text.h"
#include "subvol/export/export.h"
#include "subvol/export/gltf_writer.h"
#include "subvol/export/grouped_faces.h"
#include "subvol/export/high_order_file.h"
#include "subvol/export/obj_writer.h"
#include "subvol/export/read_back.h"
#include "subvol/export/usd_writer.h"
#include "subvol/export/volume_writer.h"
#include "subvol/fit/elements/element_space.h"
#include "subvol/io/surface_io.h"
#include "subvol/surface/boundary.h"
#include "tests/support/element_fixtures.h"
#include "tests/support/grouped_meshes.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/temporary_folder.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <sstream>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;
using Catch::Contains;

namespace {

VolumeMesh grouped_cells() {
  VolumeMesh mesh = with_floor_and_roof(mixed_cells(), 1);
  mesh.face_groups.groups[0].name = "the \"floor\"";
  mesh.face_groups.groups[1].number = -3;
  mesh.references = {4, 4, 4, 4};
  mesh.regions = {{"steel", 4, 3}};
  return mesh;
}

PolygonMesh boundary_of(const VolumeMesh& mesh) { return boundary_surface(mesh, MeshTopology(mesh)); }

}  // namespace

TEST_CASE("points of faces in Gmsh's order: corners, edges, then the same inside") {
  using Points = std::vector<std::array<int, 2>>;
  CHECK(gmsh_face_lattice(3, 1) == Points{{0, 0}, {1, 0}, {0, 1}});
  CHECK(gmsh_face_lattice(4, 2) == Points{{0, 0}, {2, 0}, {2, 2}, {0, 2}, {1, 0}, {2, 1}, {1, 2}, {0, 1}, {1, 1}});
  CHECK(gmsh_face_lattice(3, 3) ==
        Points{{0, 0}, {3, 0}, {0, 3}, {1, 0}, {2, 0}, {2, 1}, {1, 2}, {0, 2}, {0, 1}, {1, 1}});
  for (int order = 1; order <= 10; ++order) {
    for (const std::size_t corners : {3, 4}) {
      Points points = gmsh_face_lattice(corners, order);
      std::sort(points.begin(), points.end());
      CHECK(std::adjacent_find(points.begin(), points.end()) == points.end());
      const auto n = static_cast<std::size_t>(order) + 1;
      CHECK(points.size() == (corners == 4 ? n * n : n * (n + 1) / 2));
    }
  }
}

TEST_CASE("a .msh has a physical surface for each group, behind the cells") {
  const VolumeMesh mesh = grouped_cells();
  const std::string text = msh_text(mesh);
  CHECK_THAT(text, Contains("$PhysicalNames\n3\n2 1 \"the 'floor'\"\n2 2 \"roof\"\n3 4 \"steel\"\n$EndPhysicalNames"));
  CHECK_THAT(text, Contains("$Entities\n0 0 2 1\n"));
  const std::size_t num_faces = mesh.face_groups.faces.size();
  std::ostringstream counts;
  counts << "$Elements\n" << 3 + 4 << ' ' << 4 + num_faces << " 1 " << 4 + num_faces << '\n';
  CHECK_THAT(text, Contains(counts.str()));
  const TemporaryFolder folder;
  write_volume(folder / "a.msh", mesh);
  CHECK_NOTHROW(require_written(folder / "a.msh", mesh));
  VolumeMesh other = mesh;
  other.face_groups.faces.pop_back();
  CHECK_THROWS_AS(require_written(folder / "a.msh", other), IoError);
  other.face_groups.faces[0].group = 9;
  CHECK_THROWS_AS(msh_text(other), InputError);
  other.face_groups = {};
  other.regions = {};
  CHECK_THAT(msh_text(other), Contains("$PhysicalNames\n1\n3 4 \"reference 4\"\n"));
}

TEST_CASE("names of a .msh that are cut stay different") {
  VolumeMesh mesh = lattice(2, 1, 1);
  const std::string same(125, 'n');
  mesh.references = {1, 2};
  mesh.regions = {{same + "ab1", 1, 3}, {same + "ab2", 2, 3}};
  mesh.face_groups.groups = {{same + "\xc3\x9f", 1, 2}, {same + "\xc3\xa4", 2, 2}, {"a\"b", 3, 2}, {"a'b", 4, 2}};
  const std::string text = msh_text(mesh);
  CHECK(text.find("3 1 \"" + same + "a\"\n") != std::string::npos);
  CHECK(text.find("3 2 \"" + same.substr(0, 124) + " 2\"\n") != std::string::npos);
  CHECK(text.find("2 1 \"" + same + "\"\n") != std::string::npos);
  CHECK(text.find("2 2 \"" + same.substr(0, 124) + " 2\"\n") != std::string::npos);
  CHECK(text.find("2 3 \"a'b\"\n2 4 \"a'b 2\"\n") != std::string::npos);
}

TEST_CASE("faces of curved cells have the points of the cells") {
  PointSource source(1);
  const VolumeMesh cells = grouped_cells();
  for (const int order : {1, 2}) {
    const HighOrderMesh mesh = random_mesh(ElementSpace(cells, Basis::legendre, order), source);
    const LagrangeMesh lagrange = lagrange_mesh(mesh, std::vector<int>(cells.num_cells(), order), NodeOrdering::gmsh);
    const GroupedFaces faces = grouped_faces(lagrange, mesh.space.topology(), cells.face_groups);
    REQUIRE(faces.num_faces() == cells.face_groups.faces.size());
    for (std::size_t f = 0; f < faces.num_faces(); ++f) {
      const auto nodes = faces.face(f);
      const auto steps = gmsh_face_lattice(faces.sizes[f], order);
      REQUIRE(nodes.size() == steps.size());
      // The straight-sided mesh has these points at equal steps.
      const HighOrderMesh straight = HighOrderMesh(ElementSpace(cells, Basis::legendre, order), cells);
      const auto points =
          lagrange_mesh(straight, std::vector<int>(cells.num_cells(), order), NodeOrdering::gmsh).positions;
      const Vec3 &a = points[nodes[0]], &b = points[nodes[1]], &d = points[nodes[faces.sizes[f] - 1]];
      for (std::size_t k = 0; k < nodes.size(); ++k) {
        const double s = double(steps[k][0]) / order, t = double(steps[k][1]) / order;
        Vec3 expected = a + s * (b - a) + t * (d - a);
        if (faces.sizes[f] == 4) expected += s * t * (a - b + points[nodes[2]] - d);
        CHECK((points[nodes[k]] - expected).norm() < 1e-12);
      }
    }
  }
}

TEST_CASE("groups go through a .vtu of curved cells and back, and to the linear cells") {
  PointSource source(1);
  const VolumeMesh cells = grouped_cells();
  const HighOrderMesh mesh = random_mesh(ElementSpace(cells, Basis::legendre, 2), source);
  const HighOrderFileOptions options{
      .references = cells.references, .face_groups = &cells.face_groups, .regions = cells.regions};
  const TemporaryFolder folder;
  for (const char* name : {"a.vtu", "a.msh", "a.mesh"}) {
    write_volume(folder / name, mesh, options);
    CHECK_NOTHROW(require_written(folder / name, mesh, options));
  }
  const HighOrderFile found = read_high_order(folder / "a.vtu");
  CHECK(found.face_groups == cells.face_groups);
  CHECK(found.regions == cells.regions);
  const VolumeMesh small = small_cells(mesh, options);
  CHECK(small.face_groups.faces.size() == 4 * cells.face_groups.faces.size());
  CHECK(small.regions == cells.regions);
}

TEST_CASE("field data of groups that does not fit together is refused") {
  PointSource source(1);
  VolumeMesh cells = grouped_cells();
  const HighOrderMesh mesh = random_mesh(ElementSpace(cells, Basis::legendre, 1), source);
  cells.face_groups.faces[0].face = {0, 1, 2, 1000};
  const TemporaryFolder folder;
  const std::string text = vtu_text(mesh, {.face_groups = &cells.face_groups});
  CHECK_THROWS_WITH(read_high_order(folder.file("a.vtu", text)), Contains("expected numbers of points"));
  CHECK_THROWS_AS(read_high_order(folder.file("a.vtu", text.substr(0, text.find("subvol_group_faces")))), InputError);
}

TEST_CASE("an .obj has a line g wherever the group changes, and reads back the same") {
  const VolumeMesh mesh = grouped_cells();
  const PolygonMesh boundary = boundary_of(mesh);
  const TemporaryFolder folder;
  write_obj(folder / "a.obj", boundary);
  CHECK_NOTHROW(require_written(folder / "a.obj", boundary));
  const FaceGroups found = read_polygon_mesh(folder / "a.obj").face_groups;
  REQUIRE(found.groups.size() == 2);
  REQUIRE(found.of_face.size() == boundary.num_faces());
  for (std::size_t f = 0; f < boundary.num_faces(); ++f) {
    const Index group = boundary.face_groups.of_face[f];
    std::string expected = group == kNoIndex ? "" : group == 0 ? "the_\"floor\"" : "roof";
    CHECK((found.of_face[f] == kNoIndex ? "" : found.groups[found.of_face[f]].name) == expected);
  }
  PolygonMesh broken = boundary;
  broken.face_groups.of_face.pop_back();
  CHECK_THROWS_AS(obj_text(broken), InputError);
}

TEST_CASE("a .usda has a GeomSubset for each group") {
  const std::string text = usd_text(boundary_of(grouped_cells()), {});
  CHECK_THAT(text, Contains("subsetFamily:group:familyType = \"nonOverlapping\""));
  CHECK_THAT(text, Contains("def GeomSubset \"the__floor_\" ("));
  CHECK_THAT(text, Contains("string name = \"the \\\"floor\\\"\"\n            int number = 1\n"));
  CHECK_THAT(text, Contains("def GeomSubset \"roof\" ("));
  CHECK_THAT(usd_text(boundary_of(mixed_cells()), {}), !Contains("GeomSubset"));
}

TEST_CASE("a scene has a primitive and a material for each group") {
  const VolumeMesh mesh = grouped_cells();
  const Scene scene = boundary_scene(mesh);
  const ScenePrimitive& surface = scene.nodes[0].primitive;
  REQUIRE(surface.parts.size() == 3);  // the last one: faces of no group
  CHECK(surface.parts[1].name == "roof");
  CHECK(surface.indices.size() == boundary_scene(mixed_cells()).nodes[0].primitive.indices.size());
  const TemporaryFolder folder;
  write_gltf(folder / "a.gltf", scene);
  CHECK_NOTHROW(require_written(folder / "a.gltf", scene));
  const std::string text = content_of(folder / "a.gltf");
  CHECK_THAT(text, Contains("\"name\":\"roof\"") || Contains("\"name\": \"roof\""));
  Scene broken = scene;
  broken.nodes[0].primitive.parts.pop_back();
  CHECK_THROWS_AS(write_gltf(folder / "b.gltf", broken), InputError);
}

TEST_CASE("the boundary as cells names its groups, vertices and cells") {
  const VolumeMesh mesh = grouped_cells();
  const MeshTopology topology(mesh);
  std::vector<Index> vertices;
  const PolygonMesh boundary = boundary_surface(mesh, topology, &vertices);
  const std::vector<Index> cells(boundary.num_faces(), 0);
  const std::string vtu = boundary_vtu_text(boundary, {vertices, cells});
  const std::string vtk = boundary_vtk_text(boundary, {vertices, cells});
  CHECK_THAT(vtu, Contains("type=\"UInt8\" Name=\"group_names\" NumberOfTuples=\"17\""));  // "floor" and quotes
  CHECK_THAT(vtk, Contains("group_numbers 1 2 int\n1\n2\ngroup_names 1 17 unsigned_char\n116\n104\n101\n32\n34\n"));
  for (const char* name : {"group", "vertex", "cell"})
    CHECK_THAT(vtk, Contains(std::string("SCALARS ") + name + " int 1"));
  CHECK_THROWS_AS(boundary_vtu_text(boundary, {cells, vertices}), InputError);
}
