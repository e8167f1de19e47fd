// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/error.h"
#include "subvol/io/mesh_io.h"
#include "subvol/mesh/validate.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/temporary_folder.h"

#include <catch2/catch.hpp>

#include <bit>
#include <cstdint>
#include <limits>
#include <sstream>

using namespace subvol;
using namespace subvol::test;
using Catch::Contains;

namespace {

/// What a VTK file of the cells below is to look like.
struct Style {
  std::string version = "3.0";
  bool binary = false;
  std::string point_type = "double";
  bool offsets = false;  ///< OFFSETS and CONNECTIVITY of 5.x
};

template <class Number>
void append_big_endian(std::string& out, Number value) {
  for (std::size_t i = sizeof value; i-- > 0;) {
    using Bits = std::conditional_t<sizeof(Number) == 8, std::uint64_t, std::uint32_t>;
    out += static_cast<char>(std::bit_cast<Bits>(value) >> (8 * i));
  }
}

template <class Number>
std::string array_of(const std::vector<Number>& values, bool binary) {
  std::string out;
  if (binary)
    for (const Number value : values) append_big_endian(out, value);
  else
    for (const Number value : values) out += std::to_string(value) + " ";
  return out + "\n";
}

/// A file made from first principles: cells as VTK numbers them.
std::string vtk_file(const Style& style, const std::vector<double>& coordinates,
                     const std::vector<std::vector<std::int32_t>>& cells, const std::vector<std::int32_t>& types) {
  std::string out = "# vtk DataFile Version " + style.version + "\na title\n" + (style.binary ? "BINARY" : "ASCII") +
                    "\nDATASET UNSTRUCTURED_GRID\nPOINTS " + std::to_string(coordinates.size() / 3) + " " +
                    style.point_type + "\n";
  if (style.point_type == "float")
    out += array_of(std::vector<float>(coordinates.begin(), coordinates.end()), style.binary);
  else
    out += array_of(coordinates, style.binary);
  if (style.version == "4.2") out += "METADATA\nINFORMATION 1\nNAME L2 LOCATION x\nDATA 2 0 1\n\n";
  std::vector<std::int32_t> counted;
  std::vector<std::int64_t> offsets{0}, corners;
  for (const auto& cell : cells) {
    counted.push_back(static_cast<std::int32_t>(cell.size()));
    counted.insert(counted.end(), cell.begin(), cell.end());
    corners.insert(corners.end(), cell.begin(), cell.end());
    offsets.push_back(static_cast<std::int64_t>(corners.size()));
  }
  if (style.offsets)
    out += "CELLS " + std::to_string(offsets.size()) + " " + std::to_string(corners.size()) +
           "\nOFFSETS vtktypeint64\n" + array_of(offsets, style.binary) + "CONNECTIVITY vtktypeint64\n" +
           array_of(corners, style.binary);
  else
    out += "CELLS " + std::to_string(cells.size()) + " " + std::to_string(counted.size()) + "\n" +
           array_of(counted, style.binary);
  return out + "CELL_TYPES " + std::to_string(types.size()) + "\n" + array_of(types, style.binary);
}

const std::vector<double> kPoints = {0, 0, 0, 1, 0, 0, 1, 1, 0,   0, 1, 0,   0, 0,   1,   1, 0,
                                     1, 1, 1, 1, 0, 1, 1, 2, 0.5, 0, 2, 0.5, 1, 1.5, 0.5, 2};
// In VTK's numbering: the normal of the wedge's first triangle points away from the second.
const std::vector<std::vector<std::int32_t>> kCells = {
    {0, 1, 2, 3, 4, 5, 6, 7}, {1, 2, 8, 5, 6, 9}, {5, 9, 6, 10}, {0, 3, 2, 1}, {4}};
const std::vector<std::int32_t> kTypes = {12, 13, 10, 9, 1};

VolumeMesh read_bytes(const std::string& bytes, std::vector<std::string>* warnings = nullptr) {
  const TemporaryFolder folder;
  return read_volume_mesh(folder.file("in.vtk", bytes), {.warnings = warnings});
}

std::string vtk_refusal(const std::string& bytes) {
  try {
    read_bytes(bytes);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

std::string vtk_replaced(std::string text, const std::string& from, const std::string& to) {
  REQUIRE(text.find(from) != std::string::npos);
  return text.replace(text.find(from), from.size(), to);
}

}  // namespace

TEST_CASE("every flavour of legacy VTK gives the same mesh, cells right-handed and wedges turned over") {
  const Style style = GENERATE(
      Style{"2.0", false, "float", false}, Style{"3.0", false, "double", false}, Style{"3.0", true, "float", false},
      Style{"4.2", true, "double", false}, Style{"4.2", false, "float", false}, Style{"5.0", false, "double", true},
      Style{"5.1", false, "float", true}, Style{"5.1", true, "double", true}, Style{"5.1", true, "float", true});
  CAPTURE(style.version, style.binary, style.point_type);
  std::vector<std::string> warnings;
  const VolumeMesh mesh = read_bytes(vtk_file(style, kPoints, kCells, kTypes), &warnings);
  REQUIRE(warnings.size() == 1);  // the quad and the vertex; no inverted cells
  CHECK_THAT(warnings[0], Contains("2 cells of lower dimension"));
  CHECK(validate(mesh).empty());
  CHECK(mesh.kinds == std::vector<CellKind>{CellKind::hex, CellKind::prism, CellKind::tet});
  CHECK(mesh.cell_vertices == std::vector<Index>{0, 1, 2, 3, 4, 5, 6, 7, 1, 8, 2, 5, 9, 6, 5, 9, 6, 10});
  for (std::size_t i = 0; i < kPoints.size(); ++i) CHECK(mesh.positions[i / 3][static_cast<int>(i % 3)] == kPoints[i]);
}

TEST_CASE("wedges numbered in the other order are numbered anew, beside hexes and alone") {
  std::vector<std::vector<std::int32_t>> cells = kCells;
  std::swap(cells[1][1], cells[1][2]);
  std::swap(cells[1][4], cells[1][5]);
  std::vector<std::string> warnings;
  const VolumeMesh mesh = read_bytes(vtk_file({}, kPoints, cells, kTypes), &warnings);
  REQUIRE(warnings.size() == 2);
  CHECK_THAT(warnings[0] + warnings[1], Contains("all prisms, 1 cells are left-handed"));
  CHECK(validate(mesh).empty());
  CHECK(mesh.cell_vertices == read_bytes(vtk_file({}, kPoints, kCells, kTypes)).cell_vertices);
  CHECK(validate(read_bytes(vtk_file({}, kPoints, {cells[1]}, {13}))).size() == 5);  // the points of no cell
}

TEST_CASE("a voxel becomes a hex of positive volume") {
  const VolumeMesh mesh =
      read_bytes(vtk_file({}, {kPoints.begin(), kPoints.begin() + 24}, {{0, 1, 3, 2, 4, 5, 7, 6}}, {11}));
  CHECK(mesh.cell_vertices == std::vector<Index>{0, 1, 2, 3, 4, 5, 6, 7});
}

TEST_CASE("whole-number cell data become references, in whatever form they come") {
  const bool binary = GENERATE(false, true);
  const std::string base = vtk_file({"3.0", binary}, kPoints, kCells, kTypes);
  const std::string values = array_of(std::vector<std::int32_t>{5, 6, 7, 8, 9}, binary);
  const std::string floats = array_of(std::vector<float>(5, 0.5f), binary);
  const std::string others = array_of(std::vector<float>(11, std::numeric_limits<float>::quiet_NaN()), binary);
  const std::string after = GENERATE_COPY("CELL_DATA 5\nSCALARS part int 1\nLOOKUP_TABLE default\n" + values,
                                          "POINT_DATA 11\nSCALARS q float\nLOOKUP_TABLE default\n" + others +
                                              "CELL_DATA 5\nFIELD FieldData 2\nq 1 5 float\n" + floats +
                                              "METADATA\nINFORMATION 0\n\npart 1 5 int\n" + values,
                                          "CELL_DATA 5\nSCALARS part int\nLOOKUP_TABLE default\n" + values +
                                              "VECTORS v float\n" + array_of(std::vector<float>(15, 0.5f), binary));
  CHECK(read_bytes(base + after).references == std::vector<int>{5, 6, 7});
}

TEST_CASE("references come from the cell data that are meant, and from those that are asked for") {
  const bool binary = GENERATE(false, true);
  const auto ints = [&](const std::string& name, std::int32_t first) {
    return name + " 1 5 int\n" + array_of(std::vector<std::int32_t>{first, first + 1, first + 2, 8, 9}, binary);
  };
  const auto reals = [&](const std::string& name, double first, double step) {
    return name + " 1 5 double\n" + array_of(std::vector<double>{first, first + step, first + 2 * step, 8, 9}, binary);
  };
  const auto read = [&](const std::vector<std::string>& arrays, const std::string& name = "",
                        std::vector<std::string>* warnings = nullptr) {
    std::string bytes = vtk_file({"3.0", binary}, kPoints, kCells, kTypes) + "CELL_DATA 5\nFIELD f " +
                        std::to_string(arrays.size()) + "\n";
    for (const std::string& array : arrays) bytes += array;
    const TemporaryFolder folder;
    return read_volume_mesh(folder.file("in.vtk", bytes), {.warnings = warnings, .references = name}).references;
  };
  const std::vector<int> wanted{5, 6, 7};
  for (const char* other : {"vtkGhostType", "vtkOriginalCellIds", "GlobalIds", "GlobalElementId", "PedigreeIds",
                            "cell_id", "ids", "avtGhostZones"}) {
    CAPTURE(other);
    CHECK(read({ints(other, 40), ints("color", 5)}) == wanted);
    CHECK(read({ints(other, 40)}).empty());
    CHECK(read({ints("MaterialIds", 40), ints(other, 5)}, other) == wanted);
  }
  for (const char* known : {"reference", "MaterialIds", "material", "medit:ref", "gmsh:physical", "CellEntityIds",
                            "Region%20Id", "attribute"}) {
    CAPTURE(known);
    CHECK(read({ints("first", 40), ints("vtkOriginalCellIds", 50), reals(known, 5, 1)}) == wanted);
    CHECK(read({ints("first", 40), ints(known, 5)}) == wanted);
  }
  CHECK(read({ints("gmsh:geometrical", 40), ints("gmsh:physical", 5)}) == wanted);
  CHECK(read({reals("pressure", 5, 1)}).empty());  // nobody knows that it is none
  CHECK(read({reals("pressure", 5, 1)}, "pressure") == wanted);
  CHECK(read({reals("MaterialIds", 5, 0.5)}).empty());  // 5.5 is no reference
  CHECK(read({ints("Region%20Id", 5)}, "region id") == wanted);
  std::vector<std::string> warnings;
  read({ints("color", 5), ints("shade", 40)}, "", &warnings);
  REQUIRE(warnings.size() == 3);  // of lower dimension, of the other array, and which was taken
  CHECK_THAT(warnings[0] + warnings[1] + warnings[2], Contains("'color'") && Contains("--references"));
  CHECK_THROWS_WITH(read({ints("color", 5), reals("q", 0, 0.5)}, "material"),
                    Contains("in.vtk") && Contains("'material'") && Contains("'color'") && Contains("'q'"));
  const TemporaryFolder folder;
  write_volume_mesh(folder / "a.mesh", lattice(1, 1, 1));
  CHECK_THROWS_WITH(read_volume_mesh(folder / "a.mesh", {.references = "material"}), Contains("without a name"));
}

TEST_CASE("cell data become references whatever attributes stand before them") {
  const bool binary = GENERATE(false, true);
  const auto numbers = [&](std::size_t n) { return array_of(std::vector<float>(n, -0.5f), binary); };
  const auto colors = [&](std::size_t n) { return binary ? std::string(n, '\x7f') + "\n" : numbers(n); };
  const auto ids = [&](std::size_t n) { return array_of(std::vector<std::int64_t>(n, 1'000'000'000'000), binary); };
  const std::string bytes =
      vtk_file({"3.0", binary}, kPoints, kCells, kTypes) + "POINT_DATA 11\nVECTORS v float\n" + numbers(3 * 11) +
      "NORMALS n float\n" + numbers(3 * 11) + "METADATA\nINFORMATION 0\n\nTENSORS t float\n" + numbers(9 * 11) +
      "TEXTURE_COORDINATES uv 2 float\n" + numbers(2 * 11) + "SCALARS q float\nLOOKUP_TABLE table\n" + numbers(11) +
      "LOOKUP_TABLE table 3\n" + colors(4 * 3) + "COLOR_SCALARS c 3\n" + colors(3 * 11) +
      "GLOBAL_IDS g vtktypeint64\n" + ids(11) + "CELL_DATA 5\nGLOBAL_IDS g vtktypeint64\n" + ids(5) +
      "VECTORS v float\n" + numbers(3 * 5) + "SCALARS part int\nLOOKUP_TABLE default\n" +
      array_of(std::vector<std::int32_t>{5, 6, 7, 8, 9}, binary);
  std::vector<std::string> warnings;
  CHECK(read_bytes(bytes, &warnings).references == std::vector<int>{5, 6, 7});
  REQUIRE(warnings.size() == 2);  // of the quad and the vertex, and of the arrays
  CHECK_THAT(warnings[0] + warnings[1], Contains("9 data arrays"));
}

TEST_CASE("attributes that cannot be passed over end the reading of a VTK file, and that is said") {
  const std::string base = vtk_file({}, kPoints, kCells, kTypes);
  const std::string part = "SCALARS part int\nLOOKUP_TABLE default\n5 6 7 8 9\n";
  for (const std::string attribute : {"NEW_KIND v int\n1 2 3 4 5\n", "VECTORS v of\n", "SCALARS v bit\n1 0 1 0 1\n",
                                      "FIELD f 1\nv 1 5 bit\n1 0 1 0 1\n"}) {
    CAPTURE(attribute);
    std::vector<std::string> warnings;
    CHECK(read_bytes(base + "CELL_DATA 5\n" + attribute + part, &warnings).references.empty());
    REQUIRE(warnings.size() == 2);
    CHECK_THAT(warnings[0] + warnings[1], Contains("attributes from"));
    warnings.clear();
    CHECK(read_bytes(base + "CELL_DATA 5\n" + part + attribute, &warnings).references == std::vector<int>{5, 6, 7});
    CHECK(warnings.size() == 1);
  }
  CHECK_THAT(vtk_refusal(base + "POINT_DATA 11\nVECTORS v float\n1 2 3\n"), Contains("the file ends"));
  CHECK_THAT(vtk_refusal(base + "POINT_DATA 11\nLOOKUP_TABLE t 999999999\n"), Contains("999999999"));
  CHECK_THAT(vtk_refusal(base + "POINT_DATA 11\nCOLOR_SCALARS c -1\n"), Contains("negative"));
}

TEST_CASE("references that do not fit become 0, with a warning") {
  const bool binary = GENERATE(false, true);
  const std::vector<std::int64_t> values{5, 3'000'000'000, -9'000'000'000'000'000'000, 8, 9};
  std::vector<std::string> warnings;
  const VolumeMesh mesh = read_bytes(vtk_file({"3.0", binary}, kPoints, kCells, kTypes) +
                                         "CELL_DATA 5\nFIELD f 1\nzone 1 5 vtktypeint64\n" + array_of(values, binary),
                                     &warnings);
  CHECK(mesh.references == std::vector<int>{5, 0, 0});
  REQUIRE(warnings.size() == 2);
  CHECK_THAT(warnings[0] + warnings[1], Contains("references of 2 cells"));
}

TEST_CASE("a mesh of all kinds survives a VTK round trip bit by bit") {
  VolumeMesh mesh = mixed_cells();
  jitter(mesh, 0.05);
  mesh.references = {1, 2, 3, -4};
  const TemporaryFolder folder;
  write_volume_mesh(folder / "out.vtk", mesh);
  std::vector<std::string> warnings;
  const VolumeMesh again = read_volume_mesh(folder / "out.vtk", {.warnings = &warnings});
  CHECK(warnings.empty());
  CHECK(again.positions == mesh.positions);
  CHECK(again.kinds == mesh.kinds);
  CHECK(again.cell_vertices == mesh.cell_vertices);
  CHECK(again.references == mesh.references);
}

TEST_CASE("what is malformed in a VTK file is refused with its line") {
  const std::string good = vtk_file({}, kPoints, kCells, kTypes);
  REQUIRE(vtk_refusal(good).empty());
  CHECK_THAT(vtk_refusal(""), Contains(":1:"));
  CHECK_THAT(vtk_refusal("hello\n"), Contains(":1:") && Contains("vtk DataFile"));
  CHECK_THAT(vtk_refusal(vtk_replaced(good, "Version 3.0", "Version 6.0")), Contains("2.0 to 5.1"));
  CHECK_THAT(vtk_refusal(vtk_replaced(good, "ASCII", "UTF8")), Contains(":3:"));
  CHECK_THAT(vtk_refusal(vtk_replaced(good, "UNSTRUCTURED_GRID", "POLYDATA")),
             Contains(":4:") && Contains("'POLYDATA'"));
  CHECK_THAT(vtk_refusal(vtk_replaced(good, "POINTS 11", "POINTS 999999999999")),
             Contains(":5:") && Contains("999999999999"));
  CHECK_THAT(vtk_refusal(vtk_replaced(good, "POINTS 11", "POINTS -1")), Contains("negative"));
  CHECK_THAT(vtk_refusal(vtk_replaced(good, "POINTS 11", "POINTS 10")), Contains("expected a section"));
  CHECK_THAT(vtk_refusal(vtk_replaced(good, "double", "bit")), Contains("'bit'"));
  CHECK_THAT(vtk_refusal(vtk_replaced(good, "0.500000", "nan")), Contains(":6:") && Contains("'nan'"));
  CHECK_THAT(vtk_refusal(vtk_replaced(good, "0.5", "x")), Contains(":6:"));
  CHECK_THAT(vtk_refusal(vtk_replaced(good, "CELLS 5", "CELLS 6")), Contains("fewer cells"));
  CHECK_THAT(vtk_refusal(vtk_replaced(good, "CELLS 5", "CELLS 4")), Contains("larger than its cells"));
  CHECK_THAT(vtk_refusal(vtk_replaced(good, "8 0 1 2", "88 0 1 2")), Contains("88 corners"));
  CHECK_THAT(vtk_refusal(vtk_replaced(good, "8 0 1 2", "8 0 1 11")), Contains("point 11 of 11"));
  CHECK_THAT(vtk_refusal(vtk_replaced(good, "8 0 1 2", "8 0 1 -2")), Contains("point -2"));
  CHECK_THAT(vtk_refusal(vtk_replaced(good, "CELL_TYPES 5\n12", "CELL_TYPES 5\n27")), Contains("curved pyramid"));
  CHECK_THAT(vtk_refusal(vtk_replaced(good, "CELL_TYPES 5\n12", "CELL_TYPES 5\n25")), Contains("type 25"));
  CHECK_THAT(vtk_refusal(vtk_replaced(good, "CELL_TYPES 5\n12", "CELL_TYPES 5\n10")), Contains("expected 4"));
  CHECK_THAT(vtk_refusal(vtk_replaced(good, "CELL_TYPES 5\n12", "CELL_TYPES 4\n")),
             Contains("4 cell types for 5 cells"));
  CHECK_THAT(vtk_refusal(good.substr(0, good.find("CELL_TYPES"))), Contains("CELL_TYPES"));
  CHECK_THAT(vtk_refusal(good.substr(0, good.find("CELLS"))), Contains("CELLS"));
  CHECK_THAT(vtk_refusal(vtk_file({}, kPoints, {{0, 3, 2, 1}}, {9})), Contains("no hexes"));
  CHECK_THAT(vtk_refusal(vtk_file({}, kPoints, {}, {})), Contains("no hexes"));
  CHECK_THAT(vtk_refusal(good + "CELL_DATA 4\n"), Contains("expected 5"));
  const std::string offsets = vtk_file({"5.1", false, "double", true}, kPoints, kCells, kTypes);
  CHECK_THAT(vtk_refusal(vtk_replaced(offsets, "0 8 14", "0 14 8")), Contains("OFFSETS must rise"));
  CHECK_THAT(vtk_refusal(vtk_replaced(offsets, "CONNECTIVITY", "CONNECTED")), Contains("'CONNECTED'"));
}

TEST_CASE("a binary VTK file with bytes that are no coordinates, or cut short anywhere, is refused") {
  for (const Style& style : {Style{"4.2", true, "double", false}, Style{"5.1", true, "float", true}}) {
    const std::string good = vtk_file(style, kPoints, kCells, kTypes);
    for (std::size_t n = 0; n < good.size() - 1; ++n) {
      CAPTURE(n);
      CHECK_THROWS_AS(read_bytes(good.substr(0, n)), InputError);
    }
    std::vector<double> points = kPoints;
    points[4] = std::numeric_limits<double>::quiet_NaN();
    CHECK_THAT(vtk_refusal(vtk_file(style, points, kCells, kTypes)), Contains("point 1 "));
    points[4] = -std::numeric_limits<double>::infinity();
    CHECK_THAT(vtk_refusal(vtk_file(style, points, kCells, kTypes)), Contains("not finite"));
  }
}
