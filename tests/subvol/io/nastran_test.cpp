// SPDX-License-Identifier: GPL-3.0-or-later
// Nastran files of other programs have includes, coordinate systems, repeated cards and cells numbered either way.
#include "subvol/io/mesh_io.h"
#include "subvol/io/nodal_mesh.h"
#include "tests/support/nodal_fixtures.h"

#include <catch2/catch.hpp>

#include <cmath>

using namespace subvol;
using namespace subvol::test;
using Catch::Matchers::Contains;

namespace {

NodalMesh read_nastran(std::string_view bytes) { return read_nodal_text("a.bdf", bytes); }

std::string nastran_refusal(std::string_view bytes) { return nodal_refusal("a.bdf", bytes); }

const std::string kNastranPoints = "GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID,3,,0.,1.,0.\nGRID,4,,0.,0.,1.\n";
const std::string kNastranTet = "CTETRA,1,1,1,2,3,4\n";

bool is_near(const Vec3& a, const Vec3& b) { return (a - b).norm() < 1e-12; }

}  // namespace

TEST_CASE("Files that a Nastran file includes are read in its place", "[io][quick]") {
  const TemporaryFolder& folder = nodal_folder();
  std::filesystem::create_directory(folder / "parts");
  folder.file("parts/points.inc", "$ two\nGRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\ninclude 'parts/more.inc'\n");
  folder.file("parts/more.inc", "GRID,3,,0.,1.,0.\nINCLUDE last.inc $ beside this file\n");
  folder.file("parts/last.inc", "GRID,4,,0.,0.,1.\n");
  CHECK(read_nastran("SOL 101\nCEND\nBEGIN BULK\nINCLUDE 'parts/\n  points.inc'\n" + kNastranTet + "ENDDATA\n")
            .num_cells() == 1);
  CHECK(read_nastran("include \"parts\\points.inc\"\n" + kNastranTet).num_cells() == 1);
  folder.file("parts/end.inc", kNastranPoints + kNastranTet + "ENDDATA\n");
  CHECK(read_nastran("INCLUDE 'parts/end.inc'\nnothing\nGRID,1,,x\n").num_cells() == 1);

  CHECK_THAT(nastran_refusal(kNastranPoints + "INCLUDE 'none.inc'\n" + kNastranTet),
             Contains("a.bdf:5: ") && Contains("none.inc: no such file"));
  CHECK_THAT(nastran_refusal("INCLUDE 'a.bdf'\n"), Contains("8 files in one another"));
  CHECK_THAT(nastran_refusal("INCLUDE 'a.bdf\n"), Contains("a.bdf:1: ") && Contains("quote"));
  std::string open_quote = "INCLUDE 'a\n";  // all lines behind it could be parts of the path
  for (int i = 0; i < 20000; ++i) open_quote += "b\n";
  CHECK_THAT(nastran_refusal(open_quote + "'\n"), Contains("a.bdf:1: ") && Contains("quote"));
  folder.file("parts/wrong.inc", "\nGRID,1,,x\n");
  CHECK_THAT(nastran_refusal("INCLUDE 'parts/wrong.inc'\n"), Contains("wrong.inc:2: "));
}

TEST_CASE("Points of Nastran in other coordinate systems are taken into the basic one", "[io][quick]") {
  // System 5 has its origin at (1,2,3), z along x and x along y; 6 is in 5, moved by 1 along its z; 7 names points.
  const std::string systems =
      "CORD2C,5,0,1.,2.,3.,2.,2.,3.\n,1.,3.,3.\n"
      "CORD2S*                6               5              0.              0.\n"
      "*                     1.              0.              0.              2.\n"
      "*                     1.              0.              1.\n"
      "*\n"
      "CORD1R,8,1,4,2,7,10,11,12\n"
      "GRID,10,,1.,1.,1.\nGRID,11,,1.,1.,5.\nGRID,12,6,1.,90.,0.\n";
  const auto point = [&](const std::string& grid) {
    return read_nastran(kNastranPoints + systems + grid + kNastranTet).positions.back();
  };
  CHECK(is_near(point("GRID,9,5,2.,90.,4.\n"), {5, 2, 5}));   // y of system 5 is z
  CHECK(is_near(point("GRID,9,6,2.,0.,30.\n"), {4, 2, 3}));   // toward its z
  CHECK(is_near(point("GRID,9,6,2.,90.,0.\n"), {2, 4, 3}));   // toward its x
  CHECK(is_near(point("GRID,9,6,2.,90.,90.\n"), {2, 2, 5}));  // toward its y
  CHECK(is_near(point("GRID,9,8,1.,2.,3.\n"), {1, 2, 3}));
  CHECK(is_near(point("GRID,9,7,0.,0.,3.\n"), {1, 1, 4}));
  CHECK(is_near(point("GRID,9,0,1.,2.,3.\nGRDSET,,6\n"), {1, 2, 3}));
  const NodalMesh by_default = read_nastran("GRDSET,,5\n" + systems +
                                            "GRID,1,0,0.,0.,0.\nGRID,2,0,1.,0.,0.\n"
                                            "GRID,3,0,0.,1.,0.\nGRID,4,,1.,0.,0.\n" +
                                            kNastranTet);
  CHECK(is_near(by_default.positions.back(), {1, 3, 3}));

  CHECK_THAT(nastran_refusal(kNastranPoints + "GRID,9,3,0.,0.,0.\n"),
             Contains("a.bdf:5: ") && Contains("coordinate system 3, which the file does not have"));
  const std::string user = "GRID,9,3,0.,0.,0.\n" + kNastranPoints;
  CHECK_THAT(nastran_refusal(user + "CORD2R,3,,0.,0.,0.,1.,0.,0.\n,2.,0.,0.\n"),
             Contains("a.bdf:6: ") && Contains("on a line"));
  CHECK_THAT(
      nastran_refusal(user + "CORD2R,3,4,0.,0.,0.,1.,0.,0.\n,0.,1.,0.\nCORD2R,4,3,0.,0.,0.,1.,0.,0.\n,0.,1.,0.\n"),
      Contains("refers to itself"));
  CHECK_THAT(nastran_refusal(user + "CORD1R,3,1,2,7\n"), Contains("GRID 7, which the file does not have"));
  std::string chain = user;
  for (int i = 3; i < 5000; ++i)
    chain += "CORD2R," + std::to_string(i) + "," + std::to_string(i + 1) + ",0.,0.,0.,1.,0.,0.\n,0.,1.,0.\n";
  CHECK_THAT(nastran_refusal(chain), Contains("refers to itself"));
}

TEST_CASE("Cards of Nastran that repeat the one before them are read", "[io][quick]") {
  // Two columns of four points each, and two more, made by repetition; hexes on top of each other.
  const NodalMesh mesh = read_nastran(
      "GRID,1,,0.,0.,0.\n=,*(1),=,=,=,*(1.)\n=(2)\n"
      "GRID,11,,1.,0.,0.\n=,*1,=,=,=,*1.\n=2\n"
      "GRID    21              1.      1.      0.\n=       *(1)    =       =       =       *(1)\n=(2)\n"
      "GRID,31,,0.,1.,0.\n=,*(1),==\n=,*(1),=,=,=,*1.+0\n=(1)\n"
      "GRID,35,,0.,1.,3.\n"
      "CHEXA,1,7,1,11,21,31,2,12\n,22,33\nCHEXA,2,7,2,12,22,33,3,13\n,23,34\n"
      "CTETRA,3,8,3,13,23,4\n=,*(1),*(1),=,=,34,=\n");
  REQUIRE(mesh.num_cells() == 4);
  CHECK(mesh.positions[3] == Vec3(0, 0, 3));
  CHECK(mesh.positions[11] == Vec3(1, 1, 3));
  CHECK(mesh.positions[13] == Vec3(0, 1, 0));
  CHECK(mesh.positions[15] == Vec3(0, 1, 2));
  CHECK(mesh.references == std::vector<int>{7, 7, 8, 9});
  CHECK(mesh.cell(3)[2] == 15);
  CHECK_THAT(nastran_refusal(kNastranPoints + "=,*1,=,=,=,*1.\n=(999999999),\n"),
             Contains("a.bdf:6: ") && Contains("repeated"));
  CHECK_THAT(nastran_refusal(kNastranPoints + "=,*1,=,=,=,*1.\n=(x)\n"), Contains("a.bdf:6: ") && Contains("COUNT"));
  CHECK_THAT(nastran_refusal("=,*1,==\n"), Contains("none before it"));
}

TEST_CASE("Long cards of Nastran are read, but not repeated", "[io][quick]") {
  std::string long_card = "SPC1,1,123\n";
  for (int i = 0; i < 1000; ++i) long_card += ",1,2,3,4,1,2,3,4\n";
  CHECK(read_nastran(kNastranPoints + long_card + kNastranTet).num_cells() == 1);
  for (const char* repeat : {"=,*(1),==\n", "=,==\n=(9)\n"})
    CHECK_THAT(nastran_refusal(kNastranPoints + long_card + repeat + kNastranTet),
               Contains("a.bdf:5: a card of more than 8 lines is repeated"));
}

TEST_CASE("Cells of Nastran may be numbered either way", "[io][quick]") {
  const std::string points = kNastranPoints +
                             "GRID,5,,1.,1.,1.\nGRID,6,,9.,0.,0.\nGRID,7,,8.,0.,0.\nGRID,8,,8.,1.,0.\n"
                             "GRID,9,,8.,0.,1.\n";
  const std::string lone = "CTETRA,3,1,7,8,6,9\n";  // left-handed, without neighbors
  const auto path = nodal_folder().file("b.bdf", points + kNastranTet + "CTETRA,2,1,2,4,3,5\n" + lone);
  std::vector<std::string> warnings;
  const VolumeMesh mesh = read_volume_mesh(path, {.check = false, .warnings = &warnings});
  REQUIRE(mesh.num_cells() == 3);
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings[0], Contains("2 cells are numbered left-handed, as Nastran permits"));
  CHECK(mesh.cell_vertices[0] == 0);
  const auto volume = [&](std::size_t c) {
    const auto x = [&](std::size_t i) { return mesh.positions[mesh.cell_vertices[4 * c + i]]; };
    return (x(1) - x(0)).cross(x(2) - x(0)).dot(x(3) - x(0));
  };
  for (std::size_t c = 0; c < 3; ++c) CHECK(volume(c) > 0);
  CHECK_NOTHROW(read_volume_mesh(path));

  // A cell that its neighbors turn inside out keeps its numbers.
  const NodalMesh inverted = read_nastran(
      "GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID,3,,0.,1.,0.\nGRID,4,,0.,0.,1.\n"
      "GRID,5,,.2,.2,.1\n" +
      kNastranTet + "CTETRA,2,1,1,3,2,5\n");
  CHECK(inverted.warnings.empty());
  CHECK(inverted.cell(1)[1] == 2);
}

TEST_CASE("Sections of Nastran's files are told apart", "[io][quick]") {
  const std::string control = "SOL 101\nCEND\nCMETHOD = 5\nCSCALE = 2\nSET 1 = 1,2\nBEGIN BULK\n";
  const std::string others = "CONV,1,2\nCAERO1,1\nCSET,1\nCBAR,7,1,1,2\nCBAR,8,1,1,2\nRBE2,9,1,123\n";
  const NodalMesh mesh = read_nastran(control + kNastranPoints + kNastranTet + others);
  REQUIRE(mesh.warnings.size() == 1);
  CHECK_THAT(mesh.warnings[0], Contains("2 elements of type CBAR, 1 elements of type RBE2") && !Contains("C M"));
  const std::string further = control + kNastranPoints + kNastranTet + "BEGIN SUPER=1\n";
  CHECK(read_nastran(further + "MAT1,1\n").num_cells() == 1);
  CHECK_THAT(nastran_refusal(further + kNastranPoints), Contains("a.bdf:13: ") && Contains("begins in line 12"));
  CHECK_THAT(nastran_refusal(control + kNastranPoints + "CBAR,7,1,1,2\n"),
             Contains("pyramids in the file; not carried over: 1 elements of type CBAR"));
}

TEST_CASE("Cards of Nastran that are incomplete, doubled or curved pyramids are not read as others", "[io][quick]") {
  const std::string first = "CTETRA         1       1       1       2       3       4                +A\n";
  CHECK(read_nastran(kNastranPoints + first + "+A\n").num_cells() == 1);
  CHECK_THAT(nastran_refusal(kNastranPoints + first + "+B             5\n"),
             Contains("a.bdf:5: ") && Contains("continuation 'B'"));
  CHECK(read_nastran(kNastranPoints + kNastranPoints + kNastranTet).positions.size() == 4);
  CHECK_THAT(nastran_refusal(kNastranPoints + "GRID,2,,1.,0.,.5\n"),
             Contains("a.bdf:5: ") && Contains("second GRID 2"));
  CHECK_THAT(nastran_refusal(kNastranPoints + "CPYRAM,1,1,1,2,3,4,5,6\n"),
             Contains("a.bdf:5: ") && Contains("curved pyramid"));
}

TEST_CASE("Shells of Nastran without cells are a surface", "[io][quick]") {
  const auto path =
      nodal_folder().file("s.bdf", kNastranPoints + "CTRIA3,1,5,1,2,3\nCQUAD4,2,6,1,2,3,4\nCBAR,3,1,1,2\n");
  std::vector<std::string> warnings;
  const FileCells cells = read_cells(path, {.warnings = &warnings});
  const auto* surface = std::get_if<PolygonMesh>(&cells);
  REQUIRE(surface);
  CHECK(surface->num_faces() == 2);
  CHECK(surface->face_groups.groups == std::vector<Group>{{"", 5, 2}, {"", 6, 2}});
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings[0], Contains("CBAR"));
}

TEST_CASE("nodal_mesh: small, large and free fields of Nastran, with its numbers", "[io]") {
  const std::string text =
      "SOL 101\nCEND\nBEGIN BULK\n"
      "GRID           1              0.      0.      0.\n"
      "GRID*                  2                            1.-0             0.\n*                      0.\n"
      "GRID,3,0,0.,1.,0.\n"
      "$ a comment\n"
      "GRID,4,,0.,0.,\n"
      "GRID           5              .5      0.    -1-1\n"
      "CTETRA         1       3       1       2       3       4       5        +A\n"
      "+A\n"
      "PSOLID,3,1\nCQUAD4,9,4,1,2,3,4\nENDDATA\nrubbish\n";
  std::string fixed = text;
  fixed.replace(fixed.find("GRID,4,,0.,0.,"), 14, "GRID,4,,0.,0.,1.+0");
  const NodalMesh mesh = read_nastran(fixed);
  REQUIRE(mesh.num_cells() == 1);
  CHECK(mesh.orders[0] == 2);
  CHECK(mesh.references == std::vector<int>{3});
  CHECK(mesh.face_groups.groups == std::vector<Group>{{"", 4, 2}});
  CHECK(mesh.positions[static_cast<std::size_t>(mesh.cell(0)[4])] == Vec3(0.5, 0, -0.1));
  CHECK(mesh.positions[static_cast<std::size_t>(mesh.cell(0)[5])] == Vec3(0.5, 0.5, 0));  // left out: straight
  CHECK(mesh.positions[static_cast<std::size_t>(mesh.cell(0)[3])] == Vec3(0, 0, 1));
  CHECK_THAT(nastran_refusal("BEGIN BULK\nGRID,1,5,0.,0.,0.\n"), Contains("a.bdf:2:") && Contains("coordinate system"));
  CHECK_THAT(nastran_refusal("GRID,1,,0.,0.,x\n"), Contains("finite number"));
  CHECK_THAT(nastran_refusal("CHEXA,1,1,1,2,3,4,5,6\n"), Contains("number of a point"));
}

TEST_CASE("Pyramids of Nastran have two names, and elements of unknown names are counted") {
  std::string text = "BEGIN BULK\nCORD2R,1\n";
  const Vec3 points[] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0.5, 1}};
  for (int i = 0; i < 5; ++i)
    text += "GRID," + std::to_string(i + 1) + ",," + std::to_string(points[i].x()) + "," +
            std::to_string(points[i].y()) + "," + std::to_string(points[i].z()) + "\n";
  for (const char* name : {"CPYRA", "CPYRAM"}) {
    const NodalMesh mesh = read_nastran(text + name + ",1,1,1,2,3,4,5\nENDDATA\n");
    REQUIRE(mesh.num_cells() == 1);
    CHECK(mesh.warnings.empty());
  }
  const NodalMesh mesh = read_nastran(text + "CPYRA,1,1,1,2,3,4,5\nCTETRX,2,1,1,2,3,5\nENDDATA\n");
  CHECK(mesh.num_cells() == 1);
  REQUIRE(mesh.warnings.size() == 1);
  CHECK_THAT(mesh.warnings[0], Contains("1 elements of type CTETRX"));
}
