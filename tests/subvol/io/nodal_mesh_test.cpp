// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/nodal_mesh.h"

#include "subvol/base/base64.h"
#include "subvol/base/format.h"
#include "subvol/io/cell_lattice.h"
#include "subvol/io/mesh_io.h"
#include "subvol/io/mfem_numbering.h"
#include "subvol/io/nodal_writers.h"
#include "subvol/io/node_points.h"
#include "tests/support/nodal_fixtures.h"

#include <zlib.h>
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;
using Catch::Matchers::Contains;

namespace {

template <class T>
std::string raw(std::initializer_list<T> values) {
  std::string bytes;
  for (const T value : values) bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  return bytes;
}

const std::string kUnitTet = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n";

void require_unit_tet(const NodalMesh& mesh) {
  REQUIRE(mesh.num_cells() == 1);
  REQUIRE(mesh.kinds[0] == CellKind::tet);
  REQUIRE(mesh.cell(0).size() == 4);
  const Vec3 corners[] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (std::size_t i = 0; i < 4; ++i) CHECK(mesh.positions[static_cast<std::size_t>(mesh.cell(0)[i])] == corners[i]);
}

// --- Gmsh -----------------------------------------------------------------------------------------------------------

const std::string kMsh41 =
    "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n2 9 \"inlet\"\n3 7 \"solid part\"\n$EndPhysicalNames\n"
    "$Entities\n0 0 1 1\n5 0 0 0 1 1 0 1 9 0\n1 0 0 0 1 1 1 1 7 1 5\n$EndEntities\n"
    "$Nodes\n2 4 3 90\n2 5 0 2\n90\n3\n0 0 0\n1 0 0\n3 1 1 2\n50\n4\n0 1 0 .1 .2 .3\n0 0 1 .1 .2 .3\n$EndNodes\n"
    "$Elements\n2 2 1 2\n2 5 2 1\n1 90 50 3\n3 1 4 1\n2 90 3 50 4\n$EndElements\n"
    "$Periodic\nwhatever\n$EndPeriodic\n";

}  // namespace

TEST_CASE("nodal_mesh: Gmsh 4.1 with sparse tags, parametric nodes, groups and names", "[io]") {
  const NodalMesh mesh = read_nodal_text("a.msh", kMsh41);
  require_unit_tet(mesh);
  CHECK(mesh.references == std::vector<int>{7});
  REQUIRE(mesh.regions.size() == 1);
  CHECK(mesh.regions[0] == Group{"solid part", 7, 3});
  REQUIRE(mesh.face_groups.groups.size() == 1);
  CHECK(mesh.face_groups.groups[0] == Group{"inlet", 9, 2});
  REQUIRE(mesh.face_groups.faces.size() == 1);
  CHECK(mesh.face_groups.faces[0].face == FaceKey{0, 1, 2, kNoIndex});
}

TEST_CASE("nodal_mesh: a .mesh may be Gmsh's", "[io]") {
  require_unit_tet(read_nodal_text("a.mesh", kMsh41));
  CHECK(read_volume_mesh(nodal_folder() / "a.mesh").num_cells() == 1);
}

TEST_CASE("nodal_mesh: Gmsh 4.0 and 2.2 in text", "[io]") {
  require_unit_tet(read_nodal_text("a.msh",
                                   "$MeshFormat\n4 0 8\n$EndMeshFormat\n$Entities\n0 0 0 1\n1 0 0 0 1 1 1 1 7 0\n"
                                   "$EndEntities\n$Nodes\n1 4\n1 3 0 4\n9 0 0 0\n3 1 0 0\n5 0 1 0\n4 0 0 1\n$EndNodes\n"
                                   "$Elements\n1 1\n1 3 4 1\n2 9 3 5 4\n$EndElements\n"));
  const NodalMesh old = read_nodal_text("b.msh",
                                        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n9 0 0 0\n3 1 0 0\n5 0 1 0\n"
                                        "4 0 0 1\n$EndNodes\n$Elements\n3\n1 15 2 0 1 9\n2 2 2 8 1 9 5 3\n"
                                        "3 4 4 6 1 1 2 9 3 5 4\n$EndElements\n");
  require_unit_tet(old);
  CHECK(old.references == std::vector<int>{6});
  CHECK(old.face_groups.groups == std::vector<Group>{{"", 8, 2}});
}

TEST_CASE("nodal_mesh: binary files of Gmsh", "[io]") {
  const std::string old = "$MeshFormat\n2.2 1 8\n" + raw<std::int32_t>({1}) + "\n$EndMeshFormat\n$Nodes\n4\n" +
                          raw<std::int32_t>({9}) + raw<double>({0, 0, 0}) + raw<std::int32_t>({3}) +
                          raw<double>({1, 0, 0}) + raw<std::int32_t>({5}) + raw<double>({0, 1, 0}) +
                          raw<std::int32_t>({4}) + raw<double>({0, 0, 1}) + "\n$EndNodes\n$Elements\n1\n" +
                          raw<std::int32_t>({4, 1, 2, 1, 6, 1, 9, 3, 5, 4}) + "\n$EndElements\n";
  const NodalMesh mesh = read_nodal_text("a.msh", old);
  require_unit_tet(mesh);
  CHECK(mesh.references == std::vector<int>{6});
  const std::string recent = "$MeshFormat\n4.1 1 8\n" + raw<std::int32_t>({1}) + "\n$EndMeshFormat\n$Entities\n" +
                             raw<std::uint64_t>({0, 0, 0, 1}) + raw<std::int32_t>({1}) +
                             raw<double>({0, 0, 0, 1, 1, 1}) + raw<std::uint64_t>({1}) + raw<std::int32_t>({7}) +
                             raw<std::uint64_t>({0}) + "\n$EndEntities\n$Nodes\n" + raw<std::uint64_t>({1, 4, 3, 9}) +
                             raw<std::int32_t>({3, 1, 0}) + raw<std::uint64_t>({4, 9, 3, 5, 4}) +
                             raw<double>({0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}) + "\n$EndNodes\n$Elements\n" +
                             raw<std::uint64_t>({1, 1, 1, 1}) + raw<std::int32_t>({3, 1, 4}) +
                             raw<std::uint64_t>({1, 2, 9, 3, 5, 4}) + "\n$EndElements\n";
  const NodalMesh other = read_nodal_text("b.msh", recent);
  require_unit_tet(other);
  CHECK(other.references == std::vector<int>{7});
  for (std::size_t size = 0; size < recent.size(); size += 7)
    CHECK_FALSE(nodal_refusal("c.msh", std::string_view(recent).substr(0, size)).empty());
  // In 4.0, each node follows its tag, the dimension of a block follows its entity, and tags are short.
  const std::string between =
      "$MeshFormat\n4 1 8\n" + raw<std::int32_t>({1}) + "\n$EndMeshFormat\n$Entities\n" +
      raw<std::uint64_t>({0, 0, 0, 1}) + raw<std::int32_t>({1}) + raw<double>({0, 0, 0, 1, 1, 1}) +
      raw<std::uint64_t>({1}) + raw<std::int32_t>({7}) + raw<std::uint64_t>({0}) + "\n$EndEntities\n$Nodes\n" +
      raw<std::uint64_t>({1, 4}) + raw<std::int32_t>({1, 3, 0}) + raw<std::uint64_t>({4}) + raw<std::int32_t>({9}) +
      raw<double>({0, 0, 0}) + raw<std::int32_t>({3}) + raw<double>({1, 0, 0}) + raw<std::int32_t>({5}) +
      raw<double>({0, 1, 0}) + raw<std::int32_t>({4}) + raw<double>({0, 0, 1}) + "\n$EndNodes\n$Elements\n" +
      raw<std::uint64_t>({1, 1}) + raw<std::int32_t>({1, 3, 4}) + raw<std::uint64_t>({1}) +
      raw<std::int32_t>({2, 9, 3, 5, 4}) + "\n$EndElements\n";
  const NodalMesh third = read_nodal_text("d.msh", between);
  require_unit_tet(third);
  CHECK(third.references == std::vector<int>{7});
  for (std::size_t size = 0; size < between.size(); size += 7)
    CHECK_FALSE(nodal_refusal("e.msh", std::string_view(between).substr(0, size)).empty());
}

TEST_CASE("nodal_mesh: what is wrong with a .msh is said with its line", "[io]") {
  const auto changed = [](const std::string& from, const std::string& to) {
    std::string text = kMsh41;
    return text.replace(text.find(from), from.size(), to);
  };
  CHECK_THAT(nodal_refusal("a.msh", changed("4.1 0", "3.0 0")), Contains("2.2, 4.0 or 4.1"));
  CHECK_THAT(nodal_refusal("a.msh", changed("90\n3\n0 0 0", "90\n90\n0 0 0")), Contains("second node 90"));
  CHECK_THAT(nodal_refusal("a.msh", changed("2 90 3 50 4\n", "2 90 3 50 5\n")),
             Contains(".msh:") && Contains("names node 5"));
  CHECK_THAT(nodal_refusal("a.msh", changed("3 1 4 1\n2 90 3 50 4", "3 1 19 1\n2 90 3 50 4 3")),
             Contains("curved pyramid"));
  CHECK_THAT(nodal_refusal("a.msh", changed("3 1 4 1\n", "3 1 4 1000000000\n")), Contains("more than the rest"));
  CHECK_THAT(nodal_refusal("a.msh", changed("0 1 0 .1", "nan 1 0 .1")), Contains("finite"));
}

// --- VTK XML --------------------------------------------------------------------------------------------------------

namespace {

enum class Compressor { none, zlib, lz4 };

struct Encoding {
  bool appended, base64;
  Compressor compressor;
  bool wide_header;
};

std::string packed_by_zlib(const std::string& bytes) {
  std::string packed(compressBound(bytes.size()), '\0');
  uLongf size = packed.size();
  compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
  packed.resize(size);
  return packed;
}

/// Returns a block of LZ4 that repeats nothing: one sequence of literals.
std::string packed_by_lz4(const std::string& bytes) {
  constexpr std::size_t kInToken = 15, kInByte = 255;  // lengths from which on more bytes hold the rest
  std::string packed(1, static_cast<char>(std::min(bytes.size(), kInToken) << 4));
  if (bytes.size() >= kInToken) {
    std::size_t rest = bytes.size() - kInToken;
    for (; rest >= kInByte; rest -= kInByte) packed += '\xff';
    packed += static_cast<char>(rest);
  }
  return packed + bytes;
}

/// The unit tet with a cell array of references, encoded in one of the ways that VTK has.
std::string vtu(const Encoding& how) {
  std::string appended, arrays[5];
  const auto header = [&](std::uint64_t value) {
    return how.wide_header ? raw<std::uint64_t>({value}) : raw<std::uint32_t>({static_cast<std::uint32_t>(value)});
  };
  const auto encode = [&](const std::string& bytes) {
    if (!how.base64) return bytes;
    std::string text;
    append_base64(text, bytes);
    return text;
  };
  const auto put = [&](const std::string& attributes, const std::string& bytes) {
    std::string content;
    if (how.compressor != Compressor::none) {  // two blocks, the second of them smaller
      const std::size_t block = bytes.size() / 2 + 1;
      std::vector<std::string> parts{bytes.substr(0, block), bytes.substr(block)};
      if (parts[1].empty()) parts.pop_back();
      std::string lengths = header(parts.size()) + header(block) + header(bytes.size() - block), data;
      for (const std::string& part : parts) {
        const std::string packed = how.compressor == Compressor::zlib ? packed_by_zlib(part) : packed_by_lz4(part);
        lengths += header(packed.size());
        data += packed;
      }
      content = encode(lengths) + encode(data);
    } else {
      content = encode(header(bytes.size()) + bytes);
    }
    if (!how.appended) return "<DataArray " + attributes + " format=\"binary\">\n " + content + "\n</DataArray>";
    std::string array =
        "<DataArray " + attributes + " format=\"appended\" offset=\"" + std::to_string(appended.size()) + "\"/>";
    appended += content;
    return array;
  };
  std::string text = std::string(
                         "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" "
                         "byte_order=\"LittleEndian\" header_type=\"") +
                     (how.wide_header ? "UInt64\"" : "UInt32\"") +
                     (how.compressor == Compressor::zlib  ? " compressor=\"vtkZLibDataCompressor\""
                      : how.compressor == Compressor::lz4 ? " compressor=\"vtkLZ4DataCompressor\""
                                                          : "") +
                     "><UnstructuredGrid><Piece NumberOfPoints=\"4\" NumberOfCells=\"1\"><Points>";
  text += put("type=\"Float32\" NumberOfComponents=\"3\"", raw<float>({0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}));
  text += "</Points><Cells>" + put("type=\"Int32\" Name=\"connectivity\"", raw<std::int32_t>({0, 1, 2, 3}));
  text += put("type=\"Int64\" Name=\"offsets\"", raw<std::int64_t>({4}));
  text += put("type=\"UInt8\" Name=\"types\"", raw<std::uint8_t>({10})) + "</Cells><CellData>";
  text += put("type=\"Int16\" Name=\"CellEntityIds\"", raw<std::int16_t>({12}));
  text += "</CellData></Piece></UnstructuredGrid>";
  if (how.appended)
    text += std::string("<AppendedData encoding=\"") + (how.base64 ? "base64" : "raw") + "\">\n_" + appended +
            "\n</AppendedData>";
  return text + "</VTKFile>\n";
}

}  // namespace

TEST_CASE("nodal_mesh: VTK XML in every encoding", "[io]") {
  for (const bool appended : {false, true})
    for (const bool base64 : {false, true})
      for (const Compressor compressor : {Compressor::none, Compressor::zlib, Compressor::lz4})
        for (const bool wide : {false, true}) {
          if (!appended && !base64) continue;  // there are no raw data within XML
          CAPTURE(appended, base64, static_cast<int>(compressor), wide);
          const std::string text = vtu({appended, base64, compressor, wide});
          if (compressor == Compressor::lz4 && !nodal_refusal("a.vtu", text).empty()) {
            CHECK_THAT(nodal_refusal("a.vtu", text), Contains("built without"));
            WARN("SKIPPED: LZ4, which the library was built without (liblz4-dev)");
            continue;
          }
          const NodalMesh mesh = read_nodal_text("a.vtu", text);
          require_unit_tet(mesh);
          CHECK(mesh.references == std::vector<int>{12});
          for (std::size_t size = 0; size + 30 < text.size(); size += 13) nodal_refusal("b.vtu", text.substr(0, size));
        }
}

TEST_CASE("nodal_mesh: blocks that claim to be huge are refused", "[io]") {
  std::string text = vtu({true, false, Compressor::zlib, true});
  const std::size_t lengths = text.find("\n_") + 2;
  const std::uint64_t huge = std::uint64_t{1} << 40;
  std::memcpy(text.data() + lengths + 8, &huge, sizeof huge);
  CHECK_THAT(nodal_refusal("a.vtu", text), Contains("larger than its data can be"));
  CHECK_THAT(nodal_refusal("a.vtu", "<VTKFile"), Contains("not whole XML"));
  CHECK_THAT(nodal_refusal("a.vtu", "<VTKFile type=\"PolyData\"/>"), Contains("UnstructuredGrid"));
}

TEST_CASE("nodal_mesh: quadratic cells of VTK that lack some nodes", "[io]") {
  // Types 31, a prism that is straight from the bottom to the top, and 33, a hex without the insides of two faces.
  const auto text_of = [](int type, const std::vector<Vec3>& nodes) {
    std::string text = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS " +
                       std::to_string(nodes.size()) + " double\n";
    for (const Vec3& p : nodes) text += formatted("%.17g %.17g %.17g\n", p.x(), p.y(), p.z());
    text += "CELLS 1 " + std::to_string(nodes.size() + 1) + "\n" + std::to_string(nodes.size());
    for (std::size_t i = 0; i < nodes.size(); ++i) text += " " + std::to_string(i);
    return text + "\nCELL_TYPES 1\n" + std::to_string(type) + "\n";
  };
  const auto require_map = [](const NodalMesh& mesh, CellKind kind, const auto& map) {
    REQUIRE(mesh.num_cells() == 1);
    REQUIRE(mesh.kinds[0] == kind);
    REQUIRE(mesh.orders[0] == 2);
    const std::vector<LatticePoint> lattice = cell_lattice(kind, 2, NodeOrdering::vtk);
    REQUIRE(mesh.cell(0).size() == lattice.size());
    for (std::size_t i = 0; i < lattice.size(); ++i)
      CHECK((mesh.positions[mesh.cell(0)[i]] - map(lattice[i].cast<double>() / 2)).norm() < 1e-14);
  };
  // The polynomials of these cells hold all of degree 2, and the prism's all that are linear in w.
  const auto curved = [](const Vec3& u) {
    return Vec3(u + 0.1 * Vec3(u.y() * u.y(), u.z() * u.x(), u.x() * u.x() + u.y() * u.z()));
  };
  const auto upright = [](const Vec3& u) {
    return Vec3(u + 0.1 * Vec3(u.y() * u.y(), u.x() * u.x() * u.z(), u.x() * u.y() * (1 + u.z())));
  };
  std::vector<Vec3> of_hex, of_prism;
  const std::vector<LatticePoint> hex = cell_lattice(CellKind::hex, 2, NodeOrdering::vtk);
  for (std::size_t i = 0; i < 24; ++i) of_hex.push_back(curved(hex[i].cast<double>() / 2));
  // VTK's plain wedges have the other direction of rotation: the second and the third corner change places.
  const Vec3 places[] = {{0, 0, 0},   {0, 1, 0},   {1, 0, 0},   {0, 0, 1},   {0, 1, 1},   {1, 0, 1},
                         {0, 0.5, 0}, {.5, .5, 0}, {0.5, 0, 0}, {0, 0.5, 1}, {.5, .5, 1}, {0.5, 0, 1}};
  for (const Vec3& u : places) of_prism.push_back(upright(u));
  require_map(read_nodal_text("a.vtk", text_of(33, of_hex)), CellKind::hex, curved);
  require_map(read_nodal_text("b.vtk", text_of(31, of_prism)), CellKind::prism, upright);
  of_hex.pop_back();
  CHECK_THAT(nodal_refusal("c.vtk", text_of(33, of_hex)), Contains("has 23 points, expected 24"));
}

// --- Abaqus ---------------------------------------------------------------------------------------------------------

TEST_CASE("nodal_mesh: sets, sets of sets, ranges, surfaces and included files of Abaqus", "[io]") {
  nodal_folder().file("nodes.txt",
                      "*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,1\n6,1.,0.,1.D0\n7,1,1,1\n8,0,1,1\n"
                      "9,0,0,2\n10,1,0,2\n11,1,1,2\n12,0,1,2\n");
  const std::string text =
      "*Heading\n*INCLUDE, INPUT=nodes.txt\n*Elset, elset=both\nupper, LOWER\n*Elset, elset=lower, generate\n10, 14, "
      "2\n"
      "*Element, type=C3D8R, elset=Body\n10, 1,2,3,4,\n5,6,7,8\n20, 5,6,7,8, 9,10,11,12\n"
      "*Element, type=S4\n99, 1,2,3,4\n*Elset, elset=Upper\n20,\n"
      "*Solid Section, elset=upper, material=steel\n*Solid Section, elset=lower, material=wood\n,\n"
      "*Surface, name=bottom\n10, S1\n*Surface, name=\"side wall\", type=element\nboth, S4\n";
  const NodalMesh mesh = read_nodal_text("a.inp", text);
  REQUIRE(mesh.num_cells() == 2);
  CHECK(mesh.cell(1)[6] == 10);
  REQUIRE(mesh.references.size() == 2);
  CHECK(mesh.references[0] != mesh.references[1]);
  std::set<std::string> names;
  for (const Group& region : mesh.regions) names.insert(region.name);
  CHECK(names == std::set<std::string>{"Upper", "lower"});
  REQUIRE(mesh.face_groups.groups.size() == 2);
  CHECK(mesh.face_groups.groups[1].name == "side wall");
  CHECK(mesh.face_groups.faces.size() == 3);
  CHECK(group_of(mesh.face_groups, std::array<Index, 4>{0, 1, 2, 3}) == 0);
  CHECK(group_of(mesh.face_groups, std::array<Index, 4>{1, 2, 5, 6}) == 1);
}

TEST_CASE("nodal_mesh: what is wrong with a .inp is said with its line", "[io]") {
  const std::string nodes = "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n";
  CHECK_THAT(nodal_refusal("a.inp", nodes + "*ELEMENT, TYPE=C3D4\n1,1,2,3,5\n"),
             Contains("a.inp:7: ") && Contains("node 5"));
  CHECK_THAT(nodal_refusal("a.inp", nodes + "*ELEMENT, TYPE=C3D4\n1,1,2,3\n"), Contains("ends within an element"));
  CHECK_THAT(nodal_refusal("a.inp", nodes + "*ELEMENT, TYPE=C3D13\n"), Contains("pyramid"));
  CHECK_THAT(nodal_refusal("a.inp", nodes + "*INCLUDE, INPUT=a.inp\n"), Contains("8 files in one another"));
  CHECK_THAT(nodal_refusal("a.inp", nodes + "*ELEMENT, TYPE=C3D4, ELSET=e\n1,1,2,3,4\n*ELSET, ELSET=e\ne\n"),
             Contains("includes itself"));
  CHECK_THAT(nodal_refusal("a.inp", nodes + "*ELEMENT, TYPE=C3D4\n1,1,2,3,4\n*SURFACE, NAME=s\nnone, S1\n"),
             Contains("no element set 'none'"));
  CHECK_THAT(nodal_refusal("a.inp", nodes + "*PART, NAME=a\n*PART, NAME=b\n"), Contains("a part within a part"));
  const std::string part = "*PART, NAME=a\n" + nodes + "*END PART\n*ASSEMBLY, NAME=all\n";
  CHECK_THAT(nodal_refusal("a.inp", part + "*INSTANCE, NAME=b, PART=c\n*END INSTANCE\n"),
             Contains("a.inp:9: ") && Contains("no part 'c'"));
  CHECK_THAT(nodal_refusal("a.inp", part + "*INSTANCE, NAME=b, PART=a\n0,0,x\n*END INSTANCE\n"),
             Contains("expected a number, found 'x'"));
  CHECK_THAT(nodal_refusal("a.inp", part + "*INSTANCE, NAME=b, PART=a\n0,0,0\n0,0,0,0,0,0,90\n*END INSTANCE\n"),
             Contains("two points of the axis are one"));
  // Lines of a part before its first keyword belong to no keyword, also not to the one behind the instance.
  CHECK_THAT(nodal_refusal("a.inp", "*PART, NAME=p\n1, 2\n*END PART\n*INSTANCE, NAME=q, PART=p\n*NSET, NSET=s\n"),
             Contains("no hexes"));
  CHECK_THAT(nodal_refusal("a.inp", part + "*NSET, NSET=s, INSTANCE=d\n1\n"), Contains("no instance 'd'"));
}

TEST_CASE("nodal_mesh: parts of Abaqus at several places, with the sets of each", "[io]") {
  const std::string text =
      "*Part, name=block\n*Node\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,1\n6,1,0,1\n7,1,1,1\n8,0,1,1\n"
      "*Element, type=C3D8\n1, 1,2,3,4, 5,6,7,8\n*Elset, elset=whole\n1,\n*Nset, nset=high, generate\n5, 8\n"
      "*Surface, name=base\nwhole, S1\n*Solid Section, elset=whole, material=steel\n*End Part\n"
      "*Part, name=wedge\n*Node\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n*Element, type=C3D4, elset=tip\n7, 1,2,3,4\n"
      "*Solid Section, elset=tip, material=wood\n*End Part\n*Part, name=spare\n*End Part\n*Assembly, name=all\n"
      "*Instance, name=b-1, part=block\n*End Instance\n"
      "*Instance, name=b-2, part=block\n3., 0., 0.\n3., 0., 0., 3., 0., 1., 90.\n*End Instance\n"
      "*Instance, name=w, part=wedge\n0., 5., 0.\n*End Instance\n"
      "*Nset, nset=held, instance=b-2\n1, 2, 5, 6\n*Nset, nset=one, instance=b-1\n1,\n"
      "*Surface, name=lids\nb-1.whole, S2\nb-2.1, S2\n*End Assembly\n";
  const NodalMesh mesh = read_nodal_text("a.inp", text);
  REQUIRE(mesh.num_cells() == 3);
  CHECK((mesh.positions[mesh.cell(1)[1]] - Vec3(3, 1, 0)).norm() < 1e-14);
  CHECK((mesh.positions[mesh.cell(1)[7]] - Vec3(2, 0, 1)).norm() < 1e-14);
  CHECK((mesh.positions[mesh.cell(2)[0]] - Vec3(0, 5, 0)).norm() < 1e-14);
  std::map<std::string, int> regions, groups;
  for (const Group& region : mesh.regions) regions[region.name] = region.number;
  CHECK(regions.size() == 3);  // a set that two instances have keeps the instance in its name
  for (std::size_t c = 0; c < 3; ++c)
    CHECK(mesh.references[c] == regions.at(std::array{"b-1.whole", "b-2.whole", "tip"}[c]));
  for (const GroupedFace& face : mesh.face_groups.faces)
    ++groups[mesh.face_groups.groups[static_cast<std::size_t>(face.group)].name];
  CHECK(groups == std::map<std::string, int>{
                      {"b-1.base", 1}, {"b-2.base", 1}, {"lids", 2}, {"held", 1}, {"b-1.high", 1}, {"b-2.high", 1}});
  const auto held = std::ranges::find(mesh.face_groups.groups, "held", &Group::name) - mesh.face_groups.groups.begin();
  const auto second = mesh.cell(1);
  CHECK(group_of(mesh.face_groups, std::array<Index, 4>{second[0], second[1], second[4], second[5]}) == held);
  REQUIRE(mesh.warnings.size() == 1);
  CHECK_THAT(mesh.warnings[0], Contains("1 parts without an instance") && Contains("1 node sets of no faces"));
}

TEST_CASE("nodal_mesh: numbers of a .inp have twenty characters at most, which is what CalculiX reads", "[io]") {
  VolumeMesh mesh;
  mesh.positions = {{-5.528368325320092e-06, 0, 0}, {1, -1.2345678901234567e-300, 0}, {0, 1, 0}, {0, 0, 1.0 / 3}};
  mesh.add_cell(CellKind::tet, std::vector<Index>{0, 1, 2, 3});
  const std::string text = inp_text(nodal_mesh(mesh));
  CHECK(text.find("1, -5.5283683253201e-06, 0, 0\n") != std::string::npos);
  const NodalMesh back = read_nodal_text("b.inp", text);
  for (std::size_t v = 0; v < 4; ++v) CHECK((back.positions[v] - mesh.positions[v]).norm() <= 1e-15);
}

TEST_CASE("nodal_mesh: groups and references come back from a .inp", "[io]") {
  NodalMesh mesh = read_nodal_text("a.msh", kMsh41);
  mesh.references = {-4};
  mesh.regions = {{"solid part", -4, 3}};
  const NodalMesh back = read_nodal_text("b.inp", inp_text(mesh));
  CHECK(back.references == mesh.references);
  CHECK(back.regions == std::vector<Group>{{"solid_part", -4, 3}});
  CHECK(back.face_groups.faces == mesh.face_groups.faces);
  CHECK(back.face_groups.groups[0].name == "inlet");
  CHECK(inp_text(mesh).find("*NSET, NSET=inlet\n1, 2, 3\n") != std::string::npos);
  const NodalMesh mfem = read_nodal_text("b.mfem", mfem_text(mesh));
  CHECK(mfem.face_groups.faces.size() == 4);  // the boundary is listed whole
  CHECK(group_of(mfem.face_groups, std::array<Index, 3>{0, 1, 2}) !=
        group_of(mfem.face_groups, std::array<Index, 3>{0, 1, 3}));
}

TEST_CASE("Continuum shells are cells, and a .inp without parts may name instances", "[io][quick]") {
  const std::string nodes = "*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,1\n6,1,0,1\n7,1,1,1\n8,0,1,1\n";
  const std::string set = "*NSET, NSET=base, INSTANCE=GONE-1, GENERATE\n1, 4, 1\n";
  for (const char* type : {"C3D8I", "SC8R", "CSS8", "EC3D8R"}) {
    const NodalMesh mesh = read_nodal_text("a.inp", nodes + "*ELEMENT, TYPE=" + type + "\n1,1,2,3,4,5,6,7,8\n" + set);
    REQUIRE(mesh.num_cells() == 1);
    REQUIRE(mesh.face_groups.groups.size() == 1);
    CHECK(mesh.face_groups.groups[0].name == "base");
    CHECK(mesh.face_groups.faces.size() == 1);
  }
  const NodalMesh prism = read_nodal_text("a.inp", nodes + "*ELEMENT, TYPE=SC6R\n1,1,2,3,5,6,7\n");
  CHECK(prism.kinds[0] == CellKind::prism);
  CHECK_THAT(nodal_refusal("a.inp", nodes + "*INCLUDE, INPUT=none.txt\n"),
             Contains("a.inp:10: ") && Contains("none.txt: no such file"));
}

TEST_CASE("A file without cells is refused with what it has instead", "[io][quick]") {
  CHECK_THAT(nodal_refusal("a.inp", "*NODE\n1,0,0,0\n2,1,0,0\n*ELEMENT, TYPE=B31\n1,1,2\n"),
             Contains("no hexes, prisms, tets or pyramids in the file; not carried over: 1 elements of type B31"));
  const std::string pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n";
  for (const char* name : {"a.msh", "a.vtu", "a.mesh", "a.e"})
    CHECK_THAT(nodal_refusal(name, pointer), Contains("git lfs pull"));
}

// --- MFEM -----------------------------------------------------------------------------------------------------------

TEST_CASE("nodal_mesh: MFEM meshes, and what is not read of them", "[io]") {
  const std::string head =
      "MFEM mesh v1.0\n\n# comment\ndimension\n3\n\nelements\n1\n4 4 0 1 2 3\n\nboundary\n1\n"
      "6 2 0 2 1\n\nvertices\n4\n";
  const NodalMesh mesh = read_nodal_text("a.mesh", head + "3\n" + kUnitTet);
  require_unit_tet(mesh);
  CHECK(mesh.references == std::vector<int>{4});
  CHECK(mesh.face_groups.groups == std::vector<Group>{{"", 6, 2}});
  CHECK(read_volume_mesh(nodal_folder() / "a.mesh").num_cells() == 1);
  const std::string nodes =
      head + "\nnodes\nFiniteElementSpace\nFiniteElementCollection: H1_3D_P1\nVDim: 3\nOrdering: ";
  require_unit_tet(read_nodal_text("b.mesh", nodes + "1\n" + kUnitTet));
  require_unit_tet(read_nodal_text("b.mesh", nodes + "0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"));
  CHECK_THAT(nodal_refusal("b.mesh", nodes + "1\n0 0 0\n"), Contains("ends"));
  CHECK_THAT(nodal_refusal("b.mesh", "MFEM NURBS mesh v1.0\n"), Contains("NURBS"));
  CHECK_THAT(nodal_refusal("b.mesh", "MFEM mesh v1.0\ndimension\n2\n"), Contains("dimension 3"));
  CHECK_THAT(nodal_refusal("b.mesh",
                           "MFEM mesh v1.0\ndimension\n3\nelements\n1\n1 7 0 1 2 3 4\nboundary\n0\n"
                           "vertices\n5\nnodes\nFiniteElementSpace\n"
                           "FiniteElementCollection: H1_3D_P2\n"),
             Contains("straight edges only"));
}

TEST_CASE("nodal_mesh: MFEM's nodes of neighbors are the same on what they share", "[io]") {
  // Two hexes with a common face that they see in different ways, at their places in space.
  std::vector<Vec3> x;
  for (int k = 0; k < 2; ++k)
    for (int j = 0; j < 2; ++j)
      for (int i = 0; i < 3; ++i) x.emplace_back(i, j, k);
  VolumeMesh mesh;
  mesh.positions = x;
  mesh.add_cell(CellKind::hex, std::array<Index, 8>{0, 1, 4, 3, 6, 7, 10, 9});
  mesh.add_cell(CellKind::hex, std::array<Index, 8>{10, 11, 8, 7, 4, 5, 2, 1});  // turned about the axis x
  for (const int order : {1, 2, 3, 4}) {
    const MfemNodes nodes = number_mfem_nodes(12, mesh.kinds, mesh.cell_offsets, mesh.cell_vertices, order);
    const auto n = static_cast<std::size_t>(order);
    CHECK(nodes.count == (2 * n + 1) * (n + 1) * (n + 1));
    std::vector<Vec3> at(nodes.count, Vec3::Constant(-1));
    const std::vector<Vec3> points = node_points(CellKind::hex, order, NodeOrdering::vtk, NodeSpacing::lobatto);
    for (std::size_t c = 0; c < 2; ++c)
      for (std::size_t q = 0; q < points.size(); ++q) {
        const Vec3& u = points[q];
        const auto corner = [&](std::size_t i) -> const Vec3& { return x[static_cast<std::size_t>(mesh.cell(c)[i])]; };
        const Vec3 p = corner(0) + u[0] * (corner(1) - corner(0)) + u[1] * (corner(3) - corner(0)) +
                       u[2] * (corner(4) - corner(0));
        Vec3& place = at[static_cast<std::size_t>(nodes.nodes[nodes.offsets[c] + q])];
        if (place[0] < 0) place = p;
        CHECK((place - p).norm() < 1e-14);
      }
    for (const Vec3& p : at) CHECK(p[0] >= 0);
  }
}

TEST_CASE("nodal_mesh: Gauss-Lobatto points are those of the tables", "[io]") {
  CHECK(lobatto_points(1) == std::vector<double>{0, 1});
  CHECK(lobatto_points(2) == std::vector<double>{0, 0.5, 1});
  CHECK(lobatto_points(3)[1] == Approx((1 - 1 / std::sqrt(5.0)) / 2).epsilon(1e-15));
  CHECK(lobatto_points(4)[1] == Approx((1 - std::sqrt(3.0 / 7)) / 2).epsilon(1e-15));
  for (int order = 1; order <= 16; ++order) {
    const std::vector<double> points = lobatto_points(order);
    for (std::size_t i = 1; i < points.size(); ++i) CHECK(points[i] > points[i - 1]);
  }
}
