// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/error.h"
#include "subvol/io/mesh_io.h"
#include "subvol/io/surface_io.h"
#include "subvol/surface/solid_topology.h"
#include "tests/support/grouped_meshes.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/temporary_folder.h"

#include <catch2/catch.hpp>

using namespace subvol;
using namespace subvol::test;
using Catch::Contains;

namespace {

/// The group of each face by its label; "" for none.
std::vector<std::string> labels(const FaceGroups& groups) {
  std::vector<std::string> found;
  for (const Index g : groups.of_face) found.push_back(g == kNoIndex ? "" : label_of(groups.groups[g]));
  return found;
}

using Labels = std::vector<std::string>;

PolygonMesh read_groups(const std::string& name, const std::string& text,
                        std::vector<std::string>* warnings = nullptr) {
  const TemporaryFolder folder;
  return read_polygon_mesh(folder.file(name, text), warnings);
}

const std::string kCorners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";

}  // namespace

TEST_CASE("groups of an .obj are named by g, else by materials, else by several objects") {
  std::vector<std::string> warnings;
  const PolygonMesh by_g = read_groups("a.obj",
                                       kCorners +
                                           "o tet\nusemtl red\nf 1 3 2\ng base plate\nf 1 2 4\ng side\n"
                                           "usemtl blue\nf 2 3 4\ng\nf 3 1 4\n",
                                       &warnings);
  CHECK(labels(by_g.face_groups) == Labels{"", "base plate", "side", ""});
  CHECK(by_g.face_groups.groups == std::vector<Group>{{"base plate", 1, 2}, {"side", 2, 2}});
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings[0], Contains("2 uses of materials"));

  const std::string faces = "usemtl red\nf 1 3 2\nusemtl blue\nf 1 2 4\nf 2 3 4\nusemtl red\nf 3 1 4\n";
  CHECK(labels(read_groups("a.obj", kCorners + "g all\n" + faces).face_groups) == Labels{"red", "blue", "blue", "red"});
  CHECK(labels(read_groups("a.obj", kCorners + "g all\nf 1 3 2\nf 1 2 4\n").face_groups) == Labels{"all", "all"});
  CHECK(labels(read_groups("a.obj", kCorners + "o a\nf 1 3 2\no b\nf 1 2 4\n").face_groups) == Labels{"a", "b"});
  CHECK(read_groups("a.obj", kCorners + "o a\nf 1 3 2\nf 1 2 4\n").face_groups.empty());
  CHECK(read_groups("a.obj", kCorners + "g unused\ng\nf 1 3 2\nf 1 2 4\n").face_groups.empty());
}

TEST_CASE("dropped faces take their groups along") {
  const TemporaryFolder folder;
  const auto file = folder.file("a.obj", kCorners +
                                             "g a\nf 1 3 2\ng b\nf 1 1 2\ng c\nf 1 2 4\ng d\nf 2 4 1\n"
                                             "g e\nf 2 3 4\n");
  CHECK(labels(read_polygon_mesh(file).face_groups) == Labels{"a", "c", "d", "e"});
  CHECK(labels(read_triangle_mesh(file).face_groups) == Labels{"a", "c", "e"});
}

TEST_CASE("several solids of an .stl are groups, one is none") {
  const auto facet = [](const char* a, const char* b, const char* c) {
    return std::string("facet normal 0 0 0\nouter loop\nvertex ") + a + "\nvertex " + b + "\nvertex " + c +
           "\nendloop\nendfacet\n";
  };
  const std::string o = facet("0 0 0", "0 1 0", "1 0 0"), x = facet("0 0 0", "1 0 0", "0 0 1"),
                    y = facet("1 0 0", "0 1 0", "0 0 1");
  const std::string two = "solid  base plate \n" + o + "endsolid\nsolid\n" + x + y + "endsolid\n";
  CHECK(labels(read_groups("a.stl", two).face_groups) == Labels{"base plate", "solid 2", "solid 2"});
  CHECK(read_groups("a.stl", "solid one\n" + o + x + y + "endsolid one\n").face_groups.empty());
}

TEST_CASE("labels and colors of the faces of a .ply and an .off are groups") {
  const auto ply = [](const std::string& properties, const std::array<std::string, 2>& values) {
    return "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
           "element face 2\nproperty list uchar int vertex_indices\n" +
           properties + "end_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1 " + values[0] + "\n3 0 1 3 " + values[1] +
           "\n";
  };
  const std::string material = "property int flags\nproperty int material_id\n";
  const FaceGroups numbered = read_groups("a.ply", ply(material, {"1 9", "1 4"})).face_groups;
  CHECK(numbered.groups == std::vector<Group>{{"", 4, 2}, {"", 9, 2}});
  CHECK(numbered.of_face == std::vector<Index>{1, 0});
  CHECK(labels(read_groups("a.ply", ply(material, {"1 0", "1 4"})).face_groups) ==
        Labels{"material_id 0", "material_id 4"});
  const std::string colors = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  CHECK(labels(read_groups("a.ply", ply(colors, {"255 0 0", "0 128 0"})).face_groups) == Labels{"#ff0000", "#008000"});
  CHECK(read_groups("a.ply", ply(colors, {"255 0 0", "255 0 0"})).face_groups.empty());
  const std::array<std::string, 2> large{"1 9007199254740993", "1 9223372036854775807"};  // beyond a double's digits
  CHECK(labels(read_groups("a.ply", ply(material, large)).face_groups) ==
        Labels{"material_id 9007199254740993", "material_id 9223372036854775807"});
  const std::string off = "OFF\n4 3 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1 255 0 0\n3 0 1 3 0.0 1.0 0.0 1.0\n3 1 2 3\n";
  CHECK(labels(read_groups("a.off", off).face_groups) == Labels{"#ff0000", "#00ff00", ""});
}

TEST_CASE("a repaired surface keeps its groups, and holes that are closed have none") {
  const TemporaryFolder folder;
  // One triangle is flipped, and there is a hole.
  const auto file = folder.file("a.obj", kCorners + "g a\nf 1 3 2\ng b\nf 1 4 2\ng c\nf 2 3 4\n");
  const SolidBoundary solid = solid_boundary(read_triangle_mesh(file));
  CHECK(solid.flipped_triangles == 1);
  const Labels found = labels(solid.surface.face_groups);
  REQUIRE(found.size() == solid.surface.triangles.size());
  CHECK(Labels(found.begin(), found.begin() + 3) == Labels{"a", "b", "c"});
  CHECK(found.back().empty());
}

TEST_CASE("groups of faces and names of references go through a .mesh and back") {
  const TemporaryFolder folder;
  VolumeMesh mesh = with_floor_and_roof(lattice(2, 2, 1), 1);
  mesh.face_groups.groups[0].name = "the floor";
  mesh.face_groups.groups[1].number = 12;
  mesh.references = {1, 1, 2, 2};
  mesh.regions = {{"steel", 1, 3}, {"cast iron", 2, 3}};
  write_volume_mesh(folder / "a.mesh", mesh);
  const VolumeMesh found = read_volume_mesh(folder / "a.mesh");
  CHECK(found.face_groups == mesh.face_groups);
  CHECK(found.regions == mesh.regions);
  mesh.face_groups.groups[1].number = 0;  // would be none
  write_volume_mesh(folder / "a.mesh", mesh);
  CHECK(read_volume_mesh(folder / "a.mesh").face_groups.groups[1] == Group{"roof", 2, 2});
  mesh.face_groups.faces[0].group = 7;
  CHECK_THROWS_AS(write_volume_mesh(folder / "a.mesh", mesh), InputError);
}

TEST_CASE("faces of no cell and malformed names in a .mesh") {
  const TemporaryFolder folder;
  write_volume_mesh(folder / "a.mesh", with_floor_and_roof(lattice(1, 1, 1), 1));
  std::string text = content_of(folder / "a.mesh");
  text.insert(text.find("End"), "Triangles\n2\n1 2 3 5\n1 2 4 0\n");
  std::vector<std::string> warnings;
  const VolumeMesh found = read_volume_mesh(folder.file("b.mesh", text), {.warnings = &warnings});
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings[0], Contains("1 faces with a group are faces of no cell"));
  CHECK(found.face_groups.faces.size() == 2);
  text.insert(text.find("End"), "#subvol:FaceName seven wall\n");
  CHECK_THROWS_WITH(read_volume_mesh(folder.file("c.mesh", text)), Contains("expected '#subvol:FaceName NUMBER NAME'"));
}

TEST_CASE("a mesh without groups is written as before") {
  const TemporaryFolder folder;
  write_volume_mesh(folder / "a.mesh", lattice(1, 1, 1));
  CHECK(content_of(folder / "a.mesh").find("Quadrilaterals") == std::string::npos);
}
