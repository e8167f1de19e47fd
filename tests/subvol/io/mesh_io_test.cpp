// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/mesh_io.h"

#include "subvol/base/error.h"
#include "subvol/mesh/features.h"
#include "subvol/mesh/validate.h"
#include "tests/support/require_data.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/temporary_folder.h"

#include <catch2/catch.hpp>

#include <limits>
#include <sstream>

using namespace subvol;
using namespace subvol::test;
using Catch::Contains;

namespace {

/// A unit cube as Medit text, with `body` in place of its cells.
std::string cube_file(const std::string& body) {
  return "MeshVersionFormatted 2\nDimension 3\nVertices\n8\n0 0 0 0\n1 0 0 0\n1 1 0 0\n0 1 0 0\n0 0 1 0\n1 0 1 0\n"
         "1 1 1 0\n0 1 1 0\n" +
         body;
}
const std::string kCubeCell = "Hexahedra\n1\n1 2 3 4 5 6 7 8 0\n";

VolumeMesh read_text(const std::string& text, std::vector<std::string>* warnings = nullptr) {
  const TemporaryFolder folder;
  return read_volume_mesh(folder.file("in.mesh", text), {.warnings = warnings});
}

std::string refusal(const std::string& text) {
  try {
    read_text(text);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

void check_equal(const VolumeMesh& a, const VolumeMesh& b) {
  CHECK(a.positions == b.positions);
  CHECK(a.kinds == b.kinds);
  CHECK(a.cell_offsets == b.cell_offsets);
  CHECK(a.cell_vertices == b.cell_vertices);
  CHECK(a.references == b.references);
  CHECK(a.tags == b.tags);
}

}  // namespace

TEST_CASE("a mesh of all kinds, references and tags survives a Medit round trip bit by bit") {
  VolumeMesh mesh = mixed_cells();
  jitter(mesh, 0.05);
  mesh.positions[0] = Vec3(1.0 / 3, -1e-17, 4e-310);
  mesh.references = {7, -2, 0, 2147483647};
  mesh.tags = features_by_angle(mesh, 30);
  mesh.tags.creases[0].sharpness = 2.3;
  mesh.tags.creases[2].sharpness = 0.1;
  mesh.tags.corners[1].sharpness = 1.0 / 3;
  const TemporaryFolder folder;
  write_volume_mesh(folder / "out.mesh", mesh);
  std::vector<std::string> warnings;
  const VolumeMesh again = read_volume_mesh(folder / "out.mesh", {.check = false, .warnings = &warnings});
  check_equal(again, mesh);
  CHECK(warnings.empty());
}

TEST_CASE("sharpness at or above infinite is plain Ridges and Corners that any Medit reader knows") {
  VolumeMesh mesh = lattice(1, 1, 1);
  mesh.tags.creases = {{0, 1, 12.0}};
  mesh.tags.corners = {{0, std::numeric_limits<double>::infinity()}};
  const TemporaryFolder folder;
  write_volume_mesh(folder / "out.mesh", mesh);
  CHECK_THAT(content_of(folder / "out.mesh"), Contains("Edges\n1\n1 2 0\nRidges\n1\n1\nCorners\n1\n1\nEnd\n"));
  CHECK_THAT(content_of(folder / "out.mesh"), !Contains("#"));
  CHECK(read_volume_mesh(folder / "out.mesh").tags.creases[0].sharpness == kInfiniteSharpness);
}

TEST_CASE("Medit is read whatever its layout, order, comments and other sections") {
  const VolumeMesh mesh = read_text(
      "MeshVersionFormatted\n1 # single\n\nDimension\n3\r\n"
      "Ridges 2 2 1 Corners 1\t8\n"
      "Hexahedra 1\n1 2 3 4 5 6 7 8 5\n"
      "#a comment with Vertices 3\n"
      "Edges\n2\n4 3 9\n1 2 9\n"
      "Vertices 8 0 0 0 0 1 0 0 0 1 1 0 0 0 +1 0 0 0. 0 1 0 1 0 1e0 0 1 1 1 0 0 1 1 0\n"
      "Triangles\n1\n1 2 3 0\nQuadrilaterals\n1\n1 2 3 4 0\nRequiredVertices 1 1 Normals 1 0 0 1 NormalAtVertices 1 1 "
      "1\n"
      "SubDomainFromMesh 1 3 1 0\nBoundingBox 0 0 0 1 1 1\nPyramids 0\nEnd\nanything");
  CHECK(mesh.num_cells() == 1);
  CHECK(mesh.references == std::vector<int>{5});
  CHECK(mesh.tags.creases == std::vector<CreaseEdge>{{0, 1}, {2, 3}});
  CHECK(mesh.tags.corners == std::vector<CornerVertex>{{7}});
}

TEST_CASE("edges that are not ridges are no creases, and ridges inside the mesh are dropped with a warning") {
  VolumeMesh mesh = lattice(2, 2, 2);
  const TemporaryFolder folder;
  write_volume_mesh(folder / "out.mesh", mesh);
  std::string text = content_of(folder / "out.mesh");
  text.resize(text.size() - 4);
  Index center = 0;
  while (mesh.positions[static_cast<std::size_t>(center)] != Vec3(1, 1, 1)) ++center;
  Index below = 0;
  while (mesh.positions[static_cast<std::size_t>(below)] != Vec3(1, 1, 0)) ++below;
  text +=
      "Edges\n2\n1 2 0\n" + std::to_string(center + 1) + " " + std::to_string(below + 1) + " 0\nRidges\n1\n2\nEnd\n";
  std::vector<std::string> warnings;
  CHECK(read_text(text, &warnings).tags.empty());
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings[0], Contains("not on the boundary"));
}

TEST_CASE("what is malformed in a Medit file is refused with its line") {
  CHECK_THAT(refusal(""), Contains(":1:") && Contains("empty"));
  CHECK_THAT(refusal("solid x\n"), Contains(":1:") && Contains("MeshVersionFormatted"));
  CHECK_THAT(refusal("MeshVersionFormatted 9\n"), Contains("version 9"));
  CHECK_THAT(refusal("MeshVersionFormatted 2\nDimension 2\n"), Contains(":2:") && Contains("dimension 2"));
  CHECK_THAT(refusal(cube_file("Hexahedrons\n1\n")), Contains(":13:") && Contains("'Hexahedrons'"));
  CHECK_THAT(refusal(cube_file("HexahedraQ2\n1\n")), Contains("'HexahedraQ2'"));
  CHECK_THAT(refusal(cube_file("Hexahedra\n1\n1 2 3 4 5 6 7 9 0\nEnd\n")), Contains(":15:") && Contains("number 9"));
  CHECK_THAT(refusal(cube_file("Hexahedra\n1\n0 1 2 3 4 5 6 7 0\nEnd\n")), Contains(":15:") && Contains("number 0"));
  CHECK_THAT(refusal(cube_file("Hexahedra\n1\n1 2 3 4 5 6 7 8.5 0\n")), Contains(":15:") && Contains("'8.5'"));
  CHECK_THAT(refusal(cube_file("Hexahedra\n1\n1 2 3 4 5 6\n7 8\n")), Contains("file ends"));
  CHECK_THAT(refusal(cube_file("Hexahedra\n-1\n")), Contains("negative"));
  CHECK_THAT(refusal(cube_file("Hexahedra\n2000000000\n1 2 3 4 5 6 7 8 0\n")), Contains("2000000000"));
  CHECK_THAT(refusal(cube_file("Hexahedra\n99999999999999999999\n")), Contains("whole number"));
  CHECK_THAT(refusal(cube_file(kCubeCell + "1 2 3 4 5 6 7 8 0\n")), Contains(":16:") && Contains("more numbers"));
  CHECK_THAT(refusal(cube_file(kCubeCell + "Vertices\n1\n0 0 0 0\n")), Contains("second section"));
  CHECK_THAT(refusal(cube_file(kCubeCell + "Pyramids\n1\n1 2 3 4 9 0\n")), Contains(":18: vertex number 9"));
  CHECK_THAT(refusal(cube_file(kCubeCell + "Ridges\n1\n1\nEnd\n")), Contains(":18:") && Contains("edge number 1"));
  CHECK_THAT(refusal(cube_file(kCubeCell + "Corners\n1\n9\nEnd\n")), Contains(":18:") && Contains("vertex number 9"));
  CHECK_THAT(refusal(cube_file(kCubeCell + "#subvol:RidgeSharpness 1 x\nEnd\n")), Contains(":16:"));
  CHECK_THAT(refusal(cube_file(kCubeCell + "#subvol:CornerSharpness 1 -1\nEnd\n")), Contains(":16:"));
  CHECK_THAT(refusal(cube_file(kCubeCell + "Edges\n1\n1 2 0\n#subvol:RidgeSharpness 2 1.5\nEnd\n")), Contains(":19:"));
  CHECK_THAT(refusal(cube_file("End\n")), Contains("no hexes"));
  CHECK_THAT(refusal("MeshVersionFormatted 2\nDimension 3\n" + kCubeCell), Contains("no Vertices"));
  for (const char* bad : {"nan", "inf", "-inf", "1e999", "abc", "0x1p3", "1,5", "--1", "+-1", "1e"}) {
    CAPTURE(bad);
    const std::string text = std::string("MeshVersionFormatted 2\nDimension 3\nVertices\n1\n0 ") + bad + " 0 0\nEnd\n";
    CHECK_THAT(refusal(text), Contains(":5:") && Contains(std::string("'") + bad + "'"));
  }
  CHECK_THAT(refusal(std::string("MeshVersionFormatted 2\nDimension 3\nVertices\n8\n") + std::string(500, '\0')),
             Contains(":5:"));
}

TEST_CASE("every way to cut a Medit file short is refused or warned of") {
  VolumeMesh mesh = mixed_cells();
  mesh.tags = features_by_angle(mesh, 30);
  const TemporaryFolder folder;
  write_volume_mesh(folder / "whole.mesh", mesh);
  const std::string whole = content_of(folder / "whole.mesh");
  for (std::size_t n = 0; n + 4 < whole.size(); ++n) {
    std::vector<std::string> warnings;
    try {
      read_volume_mesh(folder.file("cut.mesh", whole.substr(0, n)), {.warnings = &warnings});
      CAPTURE(n);
      CHECK(!warnings.empty());
    } catch (const InputError&) {
    }
  }
}

TEST_CASE("an unsound mesh is refused unless the check is off") {
  const std::string twice = cube_file("Hexahedra\n2\n1 2 3 4 5 6 7 8 0\n1 2 3 4 5 6 7 8 0\nEnd\n");
  CHECK_THAT(refusal(twice), Contains("duplicate_cell"));
  const TemporaryFolder folder;
  CHECK(read_volume_mesh(folder.file("in.mesh", twice), {.check = false}).num_cells() == 2);
}

TEST_CASE("left-handed cells beside others are kept as they are, with a warning") {
  std::vector<std::string> warnings;
  VolumeMesh cubes = lattice(1, 1, 2);
  for (const std::size_t v : {8, 9, 10, 11}) cubes.positions[v].z() = 0.5;  // the upper cell stands on its head
  const TemporaryFolder folder;
  write_volume_mesh(folder / "in.mesh", cubes);
  const VolumeMesh mesh = read_volume_mesh(folder / "in.mesh", {.warnings = &warnings});
  CHECK(mesh.cell_vertices == cubes.cell_vertices);
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings[0], Contains("in.mesh") && Contains("1 of 2 cells are flat or left-handed"));
}

TEST_CASE("references of edges and vertices that are not kept are counted in one warning") {
  std::vector<std::string> warnings;
  std::string text =
      cube_file("Quadrilaterals\n3\n1 2 3 4 7\n5 6 7 8 0\n1 2 6 5 8\nEdges\n1\n1 2 9\nRequiredVertices\n1\n1\n" +
                kCubeCell + "End\n");
  read_text(text, &warnings);
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings[0], Contains(": 1 references of Edges, 1 RequiredVertices"));
}

TEST_CASE("a mirrored mesh is numbered anew, with a warning") {
  const TemporaryFolder folder;
  for (const VolumeMesh& mesh : {mixed_cells(), lattice(2, 1, 1)}) {
    VolumeMesh mirrored = mesh;
    for (Vec3& x : mirrored.positions) x.x() = -x.x();
    write_volume_mesh(folder / "in.mesh", mirrored);
    std::vector<std::string> warnings;
    const VolumeMesh found = read_volume_mesh(folder / "in.mesh", {.warnings = &warnings});
    REQUIRE(warnings.size() == 1);
    CHECK_THAT(warnings[0], Contains("all " + std::to_string(mesh.num_cells()) + " cells are left-handed"));
    CHECK(validate(found).empty());
    warnings.clear();
    const VolumeMesh kept = read_volume_mesh(folder / "in.mesh", {.check = false, .warnings = &warnings});
    REQUIRE(warnings.size() == 1);
    CHECK_THAT(warnings[0], Contains("are not numbered anew"));
    CHECK(!validate(kept).empty());
  }
}

TEST_CASE("a mesh without extent is refused, checked or not") {
  const TemporaryFolder folder;
  for (const bool check : {true, false})
    CHECK_THROWS_WITH(
        read_volume_mesh(folder.file("in.mesh",
                                     "MeshVersionFormatted 2\nDimension 3\nVertices\n5\n1 2 3 0\n1 2 3 0\n"
                                     "1 2 3 0\n1 2 3 0\n0 0 0 0\nTetrahedra\n1\n1 2 3 4 0\nEnd\n"),
                         {.check = check}),
        Contains("in one place"));
}

TEST_CASE("unused vertices stay in the mesh, with a warning") {
  std::vector<std::string> warnings;
  std::string text = cube_file(kCubeCell + "End\n");
  text.replace(text.find("\n8\n"), 3, "\n9\n9 9 9 0\n");
  text.replace(text.find("1 2 3 4 5 6 7 8 0"), 17, "2 3 4 5 6 7 8 9 0");
  CHECK(read_text(text, &warnings).num_vertices() == 9);
  CHECK(warnings.size() == 1);
}

TEST_CASE("paths that are no mesh files are refused") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(read_volume_mesh(folder / "none.mesh"), Contains("no such file"));
  CHECK_THROWS_AS(read_volume_mesh(folder.file("x.stl", "solid")), InputError);
  CHECK_THROWS_WITH(read_volume_mesh(folder.file("x", "")), Contains("expected cells: .mesh .vtk .vtu"));
  std::filesystem::create_directory(folder / "dir.mesh");
  CHECK_THROWS_WITH(read_volume_mesh(folder / "dir.mesh"), Contains("folder"));
}

TEST_CASE("a mesh that could not be read back is not written") {
  const TemporaryFolder folder;
  VolumeMesh mesh = lattice(1, 1, 1);
  SECTION("no cells") { mesh = {}; }
  SECTION("nan") { mesh.positions[0].x() = std::numeric_limits<double>::quiet_NaN(); }
  SECTION("index") { mesh.cell_vertices[0] = 99; }
  SECTION("tag") { mesh.tags.corners = {{77}}; }
  CHECK_THROWS_AS(write_volume_mesh(folder / "out.mesh", mesh), InputError);
  CHECK_FALSE(std::filesystem::exists(folder / "out.mesh"));
  CHECK_THROWS_AS(write_volume_mesh(folder / "out.xyz", lattice(1, 1, 1)), InputError);
  CHECK_THROWS_AS(write_volume_mesh(folder / "missing/out.mesh", lattice(1, 1, 1)), IoError);
}

TEST_CASE("the real templates load and are sound but for the inverted cells they are known for") {
  const auto data = require_data();
  if (!data) return;
  std::size_t num_read = 0;
  for (const auto& folder : std::filesystem::directory_iterator(*data / "fit")) {
    const auto path = folder.path() / "template.mesh";
    if (!std::filesystem::exists(path)) continue;
    CAPTURE(path.string());
    std::vector<std::string> warnings;
    const VolumeMesh mesh = read_volume_mesh(path, {.warnings = &warnings});
    ++num_read;
    const std::string name = folder.path().filename().string();
    const bool known = name == "bust494" || name == "dinopet_inv";
    CHECK(warnings.size() == (known ? 1 : 0));
    for (const MeshDefect& defect : validate(mesh)) CHECK(defect.kind == MeshDefect::Kind::inverted_cell);
  }
  CHECK(num_read > 20);
}

TEST_CASE("every bad volume mesh of the collection gets the outcome it asks for") {
  const auto data = require_data();
  if (!data) return;
  std::istringstream lines(content_of(*data / "bad" / "EXPECT.txt"));
  std::size_t num_tried = 0;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string name, expected;
    words >> name >> expected;
    const std::string extension = std::filesystem::path(name).extension().string();
    if (extension != ".mesh" && extension != ".vtk") continue;
    CAPTURE(line);
    ++num_tried;
    std::vector<std::string> warnings;
    if (expected == "reject") {
      CHECK_THROWS_AS(read_volume_mesh(*data / "bad" / name, {.warnings = &warnings}), InputError);
      continue;
    }
    try {
      read_volume_mesh(*data / "bad" / name, {.warnings = &warnings});
      CHECK((expected == "accept-or-reject" || !warnings.empty()));
    } catch (const InputError&) {
    }
  }
  CHECK(num_tried > 20);
}
