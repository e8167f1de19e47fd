// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/surface_io.h"

#include "subvol/base/error.h"
#include "tests/support/require_data.h"
#include "tests/support/temporary_folder.h"

#include <catch2/catch.hpp>

#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <sstream>

using namespace subvol;
using namespace subvol::test;
using Catch::Contains;

namespace {

PolygonMesh read_text(const std::string& name, const std::string& text, std::vector<std::string>* warnings = nullptr) {
  const TemporaryFolder folder;
  return read_polygon_mesh(folder.file(name, text), warnings);
}

TriangleMesh read_triangles(const std::string& name, const std::string& text,
                            std::vector<std::string>* warnings = nullptr) {
  const TemporaryFolder folder;
  return read_triangle_mesh(folder.file(name, text), warnings);
}

std::string surface_refusal(const std::string& name, const std::string& text) {
  try {
    read_triangles(name, text);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

const std::vector<Vec3> kTetPoints = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
const std::vector<std::array<Index, 3>> kTet = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
const std::string kTetOff = "OFF\n4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n";

void check_tet(const TriangleMesh& mesh) {
  CHECK(mesh.positions == kTetPoints);
  CHECK(mesh.triangles == kTet);
}

template <class Number>
void append(std::string& out, Number value, bool big_endian = false) {
  std::array<char, sizeof value> bytes = std::bit_cast<std::array<char, sizeof value>>(value);
  if (big_endian) std::reverse(bytes.begin(), bytes.end());
  out.append(bytes.data(), bytes.size());
}

/// attributes: what follows each facet; count: what the facets say of it.
std::string binary_stl(const std::string& header, std::uint16_t count = 7, const std::string& attributes = "") {
  std::string out = header;
  out.resize(80, ' ');
  append(out, std::uint32_t{4});
  for (const auto& t : kTet) {
    for (int i = 0; i < 3; ++i) append(out, std::numeric_limits<float>::quiet_NaN());
    for (const Index v : t)
      for (int i = 0; i < 3; ++i) append(out, static_cast<float>(kTetPoints[static_cast<std::size_t>(v)][i]));
    append(out, count);
    out += attributes;
  }
  return out;
}

std::string text_stl() {
  std::ostringstream out;
  out << "solid a tet of facet\n";
  for (const auto& t : kTet) {
    out << " facet normal nan nan nan\n  outer loop\n";
    for (const Index v : t) out << "   vertex " << kTetPoints[static_cast<std::size_t>(v)].transpose() << "\n";
    out << "  endloop\n endfacet\n";
  }
  out << "endsolid a tet of facet\n";
  return out.str();
}

const std::string kPlyHeader =
    "comment made here\nelement vertex 4\nproperty uchar red\nproperty float x\nproperty float y\nproperty double z\n"
    "element face 4\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\n"
    "element edge 1\nproperty int vertex1\nend_header\n";

std::string binary_ply(bool big_endian) {
  std::string out = std::string("ply\nformat binary_") + (big_endian ? "big" : "little") + "_endian 1.0\n" + kPlyHeader;
  for (const Vec3& x : kTetPoints) {
    append(out, std::uint8_t{200});
    append(out, static_cast<float>(x.x()), big_endian);
    append(out, static_cast<float>(x.y()), big_endian);
    append(out, x.z(), big_endian);
  }
  for (const auto& t : kTet) {
    append(out, std::uint8_t{3});
    for (const Index v : t) append(out, v, big_endian);
    append(out, std::uint8_t{1});
    append(out, std::numeric_limits<float>::quiet_NaN(), big_endian);
  }
  append(out, std::int32_t{0}, big_endian);
  return out;
}

const std::string kTextPly = "ply\nformat ascii 1.0\n" + kPlyHeader +
                             "9 0 0 0\n9 1 0 0\n9 0 1 0\n9 0 0 1\n3 0 2 1 0\n3 0 1 3 1 nan\n3 1 2 3 0\n3 2 0 3 0\n0\n";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  REQUIRE(text.find(from) != std::string::npos);
  return text.replace(text.find(from), from.size(), to);
}

}  // namespace

TEST_CASE("OFF is read with comments, colors, normals and counts of every kind") {
  check_tet(read_triangles("a.off", kTetOff));
  check_tet(read_triangles("a.OFF", replaced(kTetOff, "OFF\n4 4 6", "OFF # c\n\n# c\n4 4")));
  check_tet(read_triangles("a.off", replaced(kTetOff, "OFF\n4 4 6", "OFF 4 4 6")));
  check_tet(read_triangles("a.off", replaced(kTetOff, "3 0 2 1\n", "3  0\t2 1 255 0 0 # red\r\n")));
  check_tet(read_triangles("a.off",
                           "COFF\n4 4 0\n0 0 0 255 0 0 1\n1 0 0 0 0 0 1\n0 1 0 0 0 0\n0 0 1 .5 .5 .5\n"
                           "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n"));
}

TEST_CASE("OBJ is read with negative numbers, textures, forward references and long lines") {
  check_tet(read_triangles(
      "a.obj",
      "# c\nmtllib m.mtl\no tet\nv 0 0 0\nv 1 0 0 1.0\nv 0 1 0 0.5 0.5 0.5\nvt 0 0\nvn 0 0 1\ng a b\n"
      "usemtl m\ns off\nf 1/1/1 3/1/1 2/1/1\nf 1//1 2//1 4//1\nv 0 0 1\nf -3 -2 \\\n -1\nf 3/1 1/1 4/1\nl 1 2\n"));
}

TEST_CASE("STL is read as text and binary, also when a binary file begins with solid") {
  // Welding numbers the vertices by first appearance: 0 2 1 3.
  const std::string capitals = replaced(replaced(text_stl(), "solid", "SOLID"), "endsolid", "EndSolid");
  for (const std::string& bytes :
       {text_stl(), capitals, "\r\n " + text_stl(), "\xEF\xBB\xBF" + text_stl(), binary_stl("a header"),
        binary_stl("solid but binary"), binary_stl("SOLID but binary"), binary_stl("solid b", 0) + "more",
        binary_stl("b", 0) + "more", binary_stl("solid b", 4, "more"), binary_stl("b", 4, "more")}) {
    const TriangleMesh mesh = read_triangles("a.stl", bytes);
    REQUIRE(mesh.positions.size() == 4);
    CHECK(mesh.positions[1] == kTetPoints[2]);
    CHECK(mesh.triangles == std::vector<std::array<Index, 3>>{{0, 1, 2}, {0, 2, 3}, {2, 1, 3}, {1, 0, 3}});
  }
}

TEST_CASE("vertices of STL that differ by rounding errors of zero are one vertex") {
  std::string text = text_stl();
  // The coordinate of every other vertex is a rounding error where it is zero; 1e-6 is none.
  bool odd = false;
  for (std::size_t at = 0; (at = text.find(" 0", at)) != text.npos; at += 2)
    if (odd = !odd; odd) text.replace(at, 2, text[at - 1] == '0' ? " -2.5e-33" : " 1.2e-17");
  REQUIRE_THAT(text, Contains("e-33") && Contains("e-17"));
  const TriangleMesh mesh = read_triangles("a.stl", text);
  CHECK(mesh.positions.size() == 4);
  CHECK(mesh.triangles == std::vector<std::array<Index, 3>>{{0, 1, 2}, {0, 2, 3}, {2, 1, 3}, {1, 0, 3}});
  std::string far = text_stl();
  far.replace(far.find("vertex 0 0 0"), 12, "vertex 0 0 1e-6");
  CHECK(read_triangles("a.stl", far).positions.size() == 5);
}

TEST_CASE("bytes after the last facet of a binary STL are told, and refused where they could be attributes") {
  std::vector<std::string> warnings;
  read_triangles("a.stl", binary_stl("solid b", 0) + "more", &warnings);
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings[0], Contains("4 bytes after the last facet"));
  for (const std::string header : {"b", "solid b"}) {
    const std::string attributes = binary_stl(header, 4, "more");
    CHECK_THAT(surface_refusal("a.stl", binary_stl(header) + "more"), Contains("byte 284") && Contains("288 bytes"));
    CHECK_THAT(surface_refusal("a.stl", attributes + "x"), Contains("byte 284") && Contains("byte 300"));
    CHECK_THAT(surface_refusal("a.stl", attributes.substr(0, 299)), Contains("byte 284"));
    for (std::size_t n = 85; n < 284; n += 7) {
      CAPTURE(header, n);
      CHECK_THAT(surface_refusal("a.stl", binary_stl(header, 0).substr(0, n)), Contains("byte 80: 4 facets"));
    }
  }
  CHECK_THAT(surface_refusal("a.stl", "solid cube" + std::string(70, ' ')), Contains("80 bytes without a facet"));
}

TEST_CASE("text whose lines end with CR, or CR and LF, is read, and its lines are counted") {
  const auto with_ends = [](std::string text, const std::string& end) {
    for (std::size_t at = 0; (at = text.find('\n', at)) != text.npos; at += end.size()) text.replace(at, 1, end);
    return text;
  };
  const std::string obj = "# c\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\ng a\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
  for (const std::string end : {"\r", "\r\n", "\n"}) {
    CAPTURE(end.size(), end[0]);
    check_tet(read_triangles("a.off", with_ends("# c\n" + kTetOff, end)));
    check_tet(read_triangles("a.obj", with_ends(obj, end)));
    check_tet(read_triangles("a.ply", with_ends(kTextPly, end)));
    CHECK(read_triangles("a.stl", with_ends(text_stl(), end)).triangles.size() == 4);
    CHECK_THAT(surface_refusal("a.obj", with_ends(replaced(obj, "f 2 3 4", "f 2 3 x"), end)), Contains(":9:"));
    CHECK_THAT(surface_refusal("a.off", with_ends(replaced(kTetOff, "3 0 2 1", "3 0 2 9"), end)), Contains(":7:"));
    // The first of the binary numbers may look like the end of a line.
    std::string header = replaced(replaced(kPlyHeader, "uchar red", "uchar r"), "uchar int", "uchar uchar");
    header = with_ends("ply\nformat binary_little_endian 1.0\n" +
                           header.substr(0, header.find("property list uchar f")) + "end_header\n",
                       end);
    std::string numbers;
    for (const Vec3& x : kTetPoints) {
      append(numbers, std::uint8_t{'\n'});
      append(numbers, static_cast<float>(x.x()));
      append(numbers, static_cast<float>(x.y()));
      append(numbers, x.z());
    }
    for (const auto& t : kTet) {
      append(numbers, std::uint8_t{3});
      for (const Index v : t) append(numbers, static_cast<std::uint8_t>(v));
    }
    check_tet(read_triangles("a.ply", header + numbers));
  }
  // One that strays among others ends a line as well: what stands behind it is not lost.
  check_tet(read_triangles("a.obj", replaced(obj, "0 0 0\nv", "0 0 0\rv")));
}

TEST_CASE("text in UTF-16 is named as such by every reader") {
  const auto wide = [](const std::string& text, bool big_endian, bool mark) {
    std::string bytes = mark ? (big_endian ? "\xFE\xFF" : "\xFF\xFE") : "";
    for (const char c : text) bytes += big_endian ? std::string{'\0', c} : std::string{c, '\0'};
    return bytes;
  };
  const std::string long_stl = text_stl() + text_stl() + text_stl();
  for (const bool big_endian : {false, true})
    for (const bool mark : {false, true})
      for (const auto& [name, text] : {std::pair("a.off", kTetOff),
                                       {"a.obj", "v 0 0 0\n"},
                                       {"a.stl", text_stl()},
                                       {"a.stl", long_stl},
                                       {"a.stl", "solid"},
                                       {"a.ply", kTextPly}}) {
        CAPTURE(name, big_endian, mark);
        CHECK_THAT(surface_refusal(name, wide(text, big_endian, mark)), Contains(name) && Contains("UTF-16"));
      }
  // A binary file may have any header.
  std::string bytes = binary_stl(wide("solid", false, true), 0);
  CHECK(read_triangles("a.stl", bytes).triangles.size() == 4);
}

TEST_CASE("PLY is read as text and binary of both byte orders, whatever else it carries") {
  check_tet(read_triangles("a.ply", kTextPly));
  check_tet(read_triangles("a.ply", binary_ply(false)));
  check_tet(read_triangles("a.ply", binary_ply(true)));
}

TEST_CASE("polygons stay polygons until they are asked for as triangles") {
  const std::string text = "OFF\n5 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0.5 2 0\n4 0 1 2 3\n3 3 2 4\n";
  const PolygonMesh polygons = read_text("a.off", text);
  CHECK(polygons.num_faces() == 2);
  CHECK(polygons.face_offsets == std::vector<std::size_t>{0, 4, 7});
  CHECK(read_triangles("a.off", text).triangles.size() == 3);
}

TEST_CASE("what is dropped is said: unused vertices, repeated corners, faces without area, duplicates") {
  std::vector<std::string> warnings;
  const std::string text =
      "OFF\n7 7 0\n9 9 9\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n0 0 1\n2 0 0\n"
      "3 1 2 3\n4 1 1 2 4\n2 1 2\n3 1 2 1\n3 1 2 6\n3 2 3 1\n3 2 1 5\n";
  const TriangleMesh mesh = read_triangles("a.off", text, &warnings);
  CHECK(mesh.triangles.size() == 2);
  CHECK(mesh.positions.size() == 4);
  std::string all;
  for (const std::string& warning : warnings) all += warning + "\n";
  CHECK_THAT(all, Contains("1 vertex belongs to no face") && Contains("1 face repeats a corner") &&
                      Contains("2 faces have fewer than three") && Contains("1 triangle has no area") &&
                      Contains("2 triangles are there more than once"));
  CHECK(warnings.size() == 5);
}

TEST_CASE("a polygon whose hole is joined to its outline is cut into triangles") {
  const std::string points = "OFF\n8 1 0\n0 0 0\n4 0 0\n4 4 0\n0 4 0\n1 1 0\n3 1 0\n3 3 0\n1 3 0\n";
  std::vector<std::string> warnings;
  const TriangleMesh mesh = read_triangles("a.off", points + "10 0 1 2 3 0 4 7 6 5 4\n", &warnings);
  CHECK(mesh.triangles.size() == 8);
  double area = 0;
  for (const auto& t : mesh.triangles) {
    const Vec3 x = mesh.positions[t[0]];
    area += (mesh.positions[t[1]] - x).cross(mesh.positions[t[2]] - x).z() / 2;
  }
  CHECK(area == Approx(12));
  CHECK(warnings == std::vector<std::string>{warnings.at(0)});
  CHECK_THAT(warnings.at(0), Contains("1 polygon with holes is cut into triangles"));
  CHECK_THAT(surface_refusal("a.off", points + "8 0 1 2 3 0 1 2 3\n"),  // twice around
             Contains("no usable faces: all 1 have fewer than three different corners or name one twice"));
}

TEST_CASE("a file without faces is refused with what it holds instead") {
  CHECK_THAT(surface_refusal("a.obj", "v 0 0 0\nv 1 0 0\n"), Contains("no faces, only 2 vertices") && Contains(".xyz"));
  CHECK_THAT(surface_refusal("a.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n"), Contains("1 lines"));
}

TEST_CASE("what a surface file holds beside its polygons is counted in one warning") {
  const auto told = [](const std::string& name, const std::string& text) {
    std::vector<std::string> warnings;
    read_triangles(name, text, &warnings);
    REQUIRE(warnings.size() <= 1);
    return warnings.empty() ? "" : warnings[0];
  };
  CHECK(told("a.off", kTetOff).empty());
  CHECK(told("a.stl", text_stl()).empty());
  CHECK(told("a.stl", binary_stl("b", 0)).empty());
  CHECK(told("a.off", replaced(kTetOff, "3 0 2 1\n", "3 0 2 1 # none\n")).empty());
  std::string one_color = kTetOff;  // colors that tell faces apart are groups
  for (const char* face : {"3 0 2 1\n", "3 0 1 3\n", "3 1 2 3\n", "3 2 0 3\n"})
    if (one_color.find(face) != std::string::npos)
      one_color = replaced(one_color, face, std::string(face, 7) + " 255 0 0\n");
  CHECK_THAT(told("a.off", one_color), Contains("4 colors of faces"));
  CHECK_THAT(told("a.off",
                  "COFF\n4 4 0\n0 0 0 255 0 0 1\n1 0 0 0 0 0 1\n0 1 0 0 0 0\n0 0 1 .5 .5 .5\n"
                  "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n"),
             Contains("4 colors of vertices"));
  CHECK_THAT(told("a.obj",
                  "mtllib m.mtl\no tet\nv 0 0 0\nv 1 0 0 1.0\nv 0 1 0 0.5 0.5 0.5\nv 0 0 1\nvt 0 0\nvn 0 0 1\n"
                  "g a\nusemtl m\ns off\nf 1/1/1 3/1/1 2/1/1\nf 1 2 4\ng b\nf 2 3 4\nf 3 1 4\nl 1 2\n"),
             Contains("1 colors of vertices, 1 texture coordinates, 1 lines, 1 uses of materials"));
  CHECK_THAT(told("a.stl", binary_stl("b")), Contains("4 facets' attributes"));
  CHECK_THAT(told("a.stl", binary_stl("b", 4, "more")), Contains("4 facets' attributes"));
  CHECK_THAT(told("a.ply", kTextPly),
             Contains("1 properties of vertex, 1 properties of face, 1 properties of element 'edge'"));
}

TEST_CASE("a soup keeps its separate vertices") {
  const TriangleMesh mesh =
      read_triangles("a.off", "OFF\n6 2 0\n0 0 0\n1 0 0\n0 1 0\n1 0 0\n0 1 0\n1 1 0\n3 0 1 2\n3 3 5 4\n");
  CHECK(mesh.positions.size() == 6);
  CHECK(mesh.triangles.size() == 2);
}

TEST_CASE("what is malformed in an OFF file is refused with its line") {
  CHECK_THAT(surface_refusal("a.off", ""), Contains(":1:") && Contains("empty"));
  CHECK_THAT(surface_refusal("a.off", "4 4 6\n"), Contains("expected OFF"));
  CHECK_THAT(surface_refusal("a.off", "OFF BINARY\n"), Contains("binary"));
  CHECK_THAT(surface_refusal("a.off", "OFF\n4000000000 4000000000 0\n0 0 0\n"),
             Contains(":2:") && Contains("4000000000"));
  CHECK_THAT(surface_refusal("a.off", "OFF\n1 -1 0\n0 0 0\n"), Contains("negative"));
  CHECK_THAT(surface_refusal("a.off", replaced(kTetOff, "3 0 2 1", "3 0 2 4")),
             Contains(":7:") && Contains("number 4"));
  CHECK_THAT(surface_refusal("a.off", replaced(kTetOff, "3 0 2 1", "3 0 2 -1")), Contains(":7:"));
  CHECK_THAT(surface_refusal("a.off", replaced(kTetOff, "3 0 2 1", "2000000000 0 2 1")), Contains(":7:"));
  CHECK_THAT(surface_refusal("a.off", replaced(kTetOff, "1 0 0", "1 nan 0")), Contains(":4:") && Contains("'nan'"));
  CHECK_THAT(surface_refusal("a.off", replaced(kTetOff, "4 4 6", "4 3 6")),
             Contains(":10:") && Contains("more than the counts"));
  CHECK_THAT(surface_refusal("a.off", replaced(kTetOff, "4 4 6", "4 5 6")), Contains("the file ends"));
  CHECK_THAT(surface_refusal("a.off", "OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n"), Contains("no faces"));
}

TEST_CASE("what is malformed in an OBJ file is refused with its line") {
  const std::string points = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  CHECK_THAT(surface_refusal("a.obj", ""), Contains("no faces"));
  CHECK_THAT(surface_refusal("a.obj", points + "f 0 1 2\n"), Contains(":4:") && Contains("number 0"));
  CHECK_THAT(surface_refusal("a.obj", points + "f -1 -2 -7\n"), Contains(":4:") && Contains("-7"));
  CHECK_THAT(surface_refusal("a.obj", points + "f 1 2 4\n"), Contains(":4:") && Contains("number 4 of 3"));
  CHECK_THAT(surface_refusal("a.obj", points + "f 1 2 x\n"), Contains(":4:") && Contains("'x'"));
  CHECK_THAT(surface_refusal("a.obj", points + "f 1 2 99999999999999999999\n"), Contains(":4:"));
  CHECK_THAT(surface_refusal("a.obj", "v 0 0\nf 1 1 1\n"), Contains(":1:"));
  CHECK_THAT(surface_refusal("a.obj", "v 0 0 inf\n"), Contains(":1:") && Contains("'inf'"));
  CHECK_THAT(surface_refusal("a.obj", std::string("\0\1\2 x\n", 6)), Contains(":1:") && Contains("unknown"));
  std::string fan = "f";
  std::string circle;
  for (int i = 1; i <= 1001; ++i) {
    circle += "v " + std::to_string(i) + " " + std::to_string(i * i) + " 0\n";
    fan += " " + std::to_string(i);
  }
  CHECK_THAT(surface_refusal("a.obj", circle + fan), Contains("1001 corners"));
}

TEST_CASE("what is malformed in an STL file is refused with its line or byte") {
  CHECK_THAT(surface_refusal("a.stl", ""), Contains("no faces"));
  CHECK_THAT(surface_refusal("a.stl", "hello"), Contains(":1:") && Contains("solid"));
  CHECK_THAT(surface_refusal("a.stl", replaced(text_stl(), "outer", "inner")), Contains(":3:") && Contains("'inner'"));
  CHECK_THAT(surface_refusal("a.stl", replaced(text_stl(), "vertex 0", "vertex x")), Contains(":4:"));
  CHECK_THAT(surface_refusal("a.stl", replaced(text_stl(), "endsolid", "")), Contains("facet or endsolid"));
  CHECK_THAT(surface_refusal("a.stl", replaced(" SOLID" + text_stl().substr(5), "outer", "inner")),
             Contains("'inner'"));
  std::string bytes = binary_stl("x");
  CHECK_THAT(surface_refusal("a.stl", bytes.substr(0, bytes.size() - 1)), Contains("byte 80"));
  bytes[83] = '\x7f';
  CHECK_THAT(surface_refusal("a.stl", bytes), Contains("byte 80"));
  bytes = binary_stl("x");
  for (int i = 0; i < 4; ++i) bytes[static_cast<std::size_t>(84 + 12 + i)] = '\xff';
  CHECK_THAT(surface_refusal("a.stl", bytes), Contains("byte 96") && Contains("not finite"));
}

TEST_CASE("strips of triangles in PLY become triangles with their orientation") {
  const auto with_strips = [](const std::string& strips, int count) {
    return "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
           "element face 0\nproperty list uchar int vertex_indices\nelement tristrips " +
           std::to_string(count) + "\nproperty list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n" +
           strips;
  };
  const std::vector<std::array<Index, 3>> outward{{0, 2, 1}, {1, 2, 3}, {1, 3, 0}, {0, 3, 2}};
  for (const auto& [strips, count] :
       {std::pair("6 0 2 1 3 0 2\n", 1), std::pair("9 0 2 1 3 -1 1 3 0 2\n", 1), std::pair("4 0 2 1 3\n4 1 3 0 2\n", 2),
        std::pair("10 0 2 1 3 3 1 1 3 0 2\n", 1)}) {
    CAPTURE(strips);
    const TriangleMesh mesh = read_triangles("a.ply", with_strips(strips, count));
    CHECK(mesh.positions.size() == 4);
    CHECK(mesh.triangles == outward);
  }
  CHECK_THAT(surface_refusal("a.ply", with_strips("3 0 2 7\n", 1)), Contains("vertex 7 of 4"));
  CHECK_THAT(surface_refusal("a.ply", with_strips("3 0 2 -2\n", 1)), Contains("out of range"));
  CHECK_THAT(surface_refusal("a.ply", replaced(with_strips("3 0 2 1\n", 1), "face 0", "face 1")),
             Contains("more than one element"));
}

TEST_CASE("what is malformed in a PLY file is refused with its line or byte") {
  CHECK_THAT(surface_refusal("a.ply", ""), Contains(":1:"));
  CHECK_THAT(surface_refusal("a.ply", "ply\nelement vertex 1\nend_header\n"), Contains("no format"));
  CHECK_THAT(surface_refusal("a.ply", replaced(kTextPly, "ascii 1.0", "ascii 2.0")), Contains(":2:"));
  CHECK_THAT(surface_refusal("a.ply", replaced(kTextPly, "property float x", "property half x")), Contains("'half'"));
  CHECK_THAT(surface_refusal("a.ply", replaced(kTextPly, "property float x", "property float u")),
             Contains("without x, y and z"));
  CHECK_THAT(surface_refusal("a.ply", replaced(kTextPly, "vertex_indices", "corners")),
             Contains("without vertex_indices"));
  CHECK_THAT(surface_refusal("a.ply", replaced(kTextPly, "vertex 4", "vertex 4000000000")), Contains(":4:"));
  CHECK_THAT(surface_refusal("a.ply", replaced(kTextPly, "3 0 2 1 0", "3 0 2 4 0")), Contains("vertex 4 of 4"));
  CHECK_THAT(surface_refusal("a.ply", replaced(kTextPly, "3 0 2 1 0", "3 0 2 -1 0")), Contains("out of range"));
  CHECK_THAT(surface_refusal("a.ply", replaced(kTextPly, "3 0 2 1 0", "2000000000 0 2 1 0")),
             Contains("impossible length"));
  CHECK_THAT(surface_refusal("a.ply", replaced(kTextPly, "9 1 0 0", "9 inf 0 0")), Contains("'inf'"));
  const std::string good = binary_ply(false);
  for (std::size_t n = 0; n < good.size(); ++n) {
    CAPTURE(n);
    CHECK_THROWS_AS(read_triangles("a.ply", good.substr(0, n)), InputError);
  }
}

TEST_CASE("A surface with a stray vertex is refused with its place") {
  std::string text = "OFF\n5 6 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\nFAR 0 0\n";
  text += "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 4\n3 2 3 4\n3 3 1 4\n";
  const auto with = [&](const std::string& far) { return std::string(text).replace(text.find("FAR"), 3, far); };
  CHECK_THROWS_WITH(
      read_triangles("a.off", with("1e30")),
      Contains("the vertex at (1e+30, 0, 0) is") && Contains("times as far from the middle as three quarters"));
  CHECK(read_triangles("a.off", with("1000")).triangles.size() == 6);
}

TEST_CASE("surfaces without extent, or whose areas leave the range of a double, are refused") {
  CHECK_THAT(surface_refusal("a.off", "OFF\n3 1 0\n5 5 5\n5 5 5\n5 5 5\n3 0 1 2\n"), Contains("one place"));
  CHECK_THAT(surface_refusal("a.off", "OFF\n3 1 0\n0 0 0\n1e300 0 0\n0 1e300 0\n3 0 1 2\n"), Contains("1e+300"));
  CHECK_THAT(surface_refusal("a.off", "OFF\n3 1 0\n0 0 0\n1e-200 0 0\n0 1e-200 0\n3 0 1 2\n"), Contains("1e-200"));
  CHECK_THAT(surface_refusal("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n2 0 0\n3 0 1 2\n"),
             Contains("no triangle has any area"));
  CHECK(read_triangles("a.off", "OFF\n3 1 0\n0 0 0\n1e-39 0 0\n0 1e-39 0\n3 0 1 2\n").triangles.size() == 1);
  CHECK(read_triangles("a.off", "OFF\n3 1 0\n0 0 0\n1e39 0 0\n0 1e39 0\n3 0 1 2\n").triangles.size() == 1);
}

TEST_CASE("free-form surfaces of .obj are refused as what they are") {
  const std::string text = "v 0 0 0\nv 1 0 0\nv 0 1 0\ncstype bezier\ndeg 1 1\nsurf 0 1 0 1 1 2 3 3\nend\n";
  CHECK_THAT(surface_refusal("a.obj", text), Contains(":4: free-form curves and surfaces ('cstype') are not read"));
}

TEST_CASE("variants of .off are read, or refused as what they are") {
  const std::string vertices = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n", faces = "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n";
  for (const std::string header : {"OFF 4 4 6\n", "OFF\n4 4\n", "OFF\n4 4\n6\n", "OFF # all\n4 4 6 # of it\n",
                                   "\xEF\xBB\xBFOFF\n4 4 6\n", "# first\n\nOFF\n4 4 6\n"}) {
    CAPTURE(header);
    check_tet(read_triangles("a.off", header + vertices + faces));
  }
  const TemporaryFolder folder;
  std::vector<std::string> warnings;
  const auto colored =
      folder.file("colored.off", "OFF\n4 4 6\n0 0 0 255 0 0\n1 0 0 255 0 0\n0 1 0 255 0 0\n0 0 1 255 0 0\n" + faces);
  CHECK(read_polygon_mesh(colored, &warnings).positions[3] == Vec3(0, 0, 1));
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings[0], Contains("4 values behind the coordinates of vertices"));
  CHECK_THAT(surface_refusal("a.off", "4OFF\n4 4 6\n"), Contains("another dimension ('4OFF')"));
  CHECK_THAT(surface_refusal("a.off", "nOFF\n3\n4 4 6\n"), Contains("another dimension ('nOFF')"));
  CHECK_THAT(surface_refusal("a.off", "OFF BINARY\n"), Contains("binary OFF cannot be read"));
  CHECK_THAT(surface_refusal("a.off", "OFF4 4 6\n" + vertices + faces), Contains("a word of its own, found 'OFF4'"));
  CHECK_THAT(surface_refusal("a.off", "OFF\n4 5 6\n" + vertices + faces), Contains("the file ends"));
  CHECK_THAT(surface_refusal("a.off", "OFF\n4 3 6\n" + vertices + faces), Contains("more than the counts say: '3'"));
}

TEST_CASE("rows of a text .ply that hold more values than the header says are read, with a warning") {
  const std::string header =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 4\nproperty list uchar int vertex_indices\nend_header\n";
  const std::string vertices = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n";
  const TemporaryFolder folder;
  std::vector<std::string> warnings;
  const auto path =
      folder.file("more.ply", header + vertices + "3 0 2 1 6 0.5 0.25\n3 0 1 3 6 1 1\n3 1 2 3\n3 2 0 3\n");
  CHECK(read_polygon_mesh(path, &warnings).face_vertices == std::vector<Index>{0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3});
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings[0], Contains("2 rows have more values than the header says, the first in line 14"));
  // Several elements in a row are none too many.
  warnings.clear();
  const auto packed = folder.file("packed.ply", header + "0 0 0 1 0 0\n0 1 0 0 0 1\n3 0 2 1 3 0 1 3\n3 1 2 3 3 2 0 3");
  CHECK(read_polygon_mesh(packed, &warnings).num_faces() == 4);
  CHECK(warnings.empty());
  CHECK_THAT(surface_refusal("a.ply", header + "0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n"),
             Contains(":10: expected all values of an element 'vertex' in this line, found fewer"));
  CHECK_THAT(surface_refusal("a.ply", header + vertices + "3 0 2 1\n3 0 1\n3 1 2 3\n3 2 0 x\n"),
             Contains(":15: expected all values of an element 'face'"));
  CHECK_THAT(surface_refusal("a.ply", header + vertices + "3 0 2 1 6 0.5\n3 0 1 x\n"), Contains(":15:"));
}

TEST_CASE("an unknown surface extension is refused with the known ones") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(read_triangle_mesh(folder.file("a.xyz", "")),
                    Contains("'.xyz'") && Contains(".off") && Contains(".ply"));
  CHECK_THROWS_WITH(read_triangle_mesh(folder / "none.off"), Contains("no such file"));
}

TEST_CASE("every bad surface of the collection gets the outcome it asks for, and the real ones load") {
  const auto data = require_data();
  if (!data) return;
  std::istringstream lines(content_of(*data / "bad" / "EXPECT.txt"));
  std::size_t num_tried = 0, num_read = 0;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string name, expected;
    words >> name >> expected;
    const std::string extension = std::filesystem::path(name).extension().string();
    if (extension != ".off" && extension != ".obj") continue;
    CAPTURE(line);
    ++num_tried;
    std::vector<std::string> warnings;
    try {
      read_triangle_mesh(*data / "bad" / name, &warnings);
      CHECK((expected == "accept-or-reject" || (expected == "reject-or-warn" && !warnings.empty())));
    } catch (const InputError&) {
    }
  }
  CHECK(num_tried > 10);
  for (const char* kind : {"fit", "shell", "dirty"})
    for (const auto& file : std::filesystem::recursive_directory_iterator(*data / kind)) {
      const std::string extension = file.path().extension().string();
      if (extension != ".off" && extension != ".obj") continue;
      CAPTURE(file.path().string());
      CHECK(read_triangle_mesh(file.path()).triangles.size() >= 760);
      ++num_read;
    }
  CHECK(num_read > 40);
}
