// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/volume_writer.h"

#include "subvol/base/error.h"
#include "subvol/export/read_back.h"
#include "subvol/io/mesh_io.h"
#include "tests/support/grouped_meshes.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/temporary_folder.h"

#include <catch2/catch.hpp>

#include <cstring>
#include <limits>
#include <sstream>

using namespace subvol;
using namespace subvol::test;
using Catch::Contains;

namespace {

VolumeMesh referenced_cells() {
  VolumeMesh mesh = mixed_cells();
  jitter(mesh, 0.05);
  mesh.references = {2, 0, 2, 5};
  return mesh;
}

const std::vector<double> kMinima{0.5, 0.25, 0.1 + 0.2, -0.125};

/// The numbers of a named array of a .vtu.
template <class T>
std::vector<T> data_array(const std::string& text, const std::string& name) {
  const std::size_t at = text.find('>', text.find("Name=\"" + name + "\"")) + 1;
  const std::string digits = text.substr(at, text.find('<', at) - at);
  std::string bytes;
  std::uint32_t word = 0;
  int bits = 0;
  for (const char c : digits) {
    if (c == '=') break;
    const std::string alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    word = word << 6 | static_cast<std::uint32_t>(alphabet.find(c));
    bits += 6;
    if (bits >= 8) bytes += static_cast<char>(word >> (bits -= 8) & 255);
  }
  std::uint64_t size = 0;
  std::memcpy(&size, bytes.data(), 8);
  REQUIRE(bytes.size() == 8 + size);
  std::vector<T> values(size / sizeof(T));
  std::memcpy(values.data(), bytes.data() + 8, size);
  return values;
}

}  // namespace

TEST_CASE("a .vtu holds points, plain cells and cell data bit by bit") {
  const VolumeMesh mesh = referenced_cells();
  const std::string text = vtu_text(mesh, kMinima);
  CHECK(text.find("version=\"1.0\"") != std::string::npos);
  const auto points = data_array<double>(text, "Points");
  REQUIRE(points.size() == 3 * mesh.num_vertices());
  for (std::size_t v = 0; v < mesh.num_vertices(); ++v)
    for (int k = 0; k < 3; ++k) CHECK(points[3 * v + k] == mesh.positions[v][k]);
  const auto corners = data_array<std::int64_t>(text, "connectivity");
  std::vector<Index> turned = mesh.cell_vertices;  // a wedge sees its first triangle from outside
  for (const std::size_t prism : {8, 14})
    for (const std::size_t i : {1, 4}) std::swap(turned[prism + i], turned[prism + i + 1]);
  CHECK(std::vector<Index>(corners.begin(), corners.end()) == turned);
  CHECK(data_array<std::int64_t>(text, "offsets") == std::vector<std::int64_t>{8, 14, 20, 24});
  CHECK(data_array<std::uint8_t>(text, "types") == std::vector<std::uint8_t>{12, 13, 13, 10});
  CHECK(data_array<std::int32_t>(text, "reference") == std::vector<std::int32_t>{2, 0, 2, 5});
  CHECK(data_array<std::int32_t>(text, "material") == std::vector<std::int32_t>{2, 0, 2, 5});
  CHECK(text.find("<CellData Scalars=\"material\">") != std::string::npos);  // for MFEM
  CHECK(data_array<double>(text, "scaled_jacobian") == kMinima);
  CHECK(vtu_text(mesh).find("scaled_jacobian") == std::string::npos);
}

TEST_CASE("a .msh holds the cells by volume and kind, with physical groups and element data") {
  const VolumeMesh mesh = referenced_cells();
  std::istringstream in(msh_text(mesh, kMinima));
  const auto expect = [&](const std::string& expected) {
    std::string word;
    in >> word;
    REQUIRE(word == expected);
  };
  const auto line = [&](const std::string& words) {
    std::istringstream expected(words);
    for (std::string word; expected >> word;) expect(word);
  };
  const auto skip = [&](int n) {
    for (std::string word; n > 0; --n) in >> word;
  };
  line(
      "$MeshFormat 4.1 0 8 $EndMeshFormat $PhysicalNames 3 3 1 \"reference 0\" 3 2 \"reference 2\" 3 5 \"reference "
      "5\"");
  line("$EndPhysicalNames $Entities 0 0 0 3 1");
  skip(6);
  line("1 1 0 2");
  skip(6);
  line("1 2 0 3");
  skip(6);
  line("1 5 0 $EndEntities $Nodes 1 13 1 13 3 1 0 13");
  for (int v = 1; v <= 13; ++v) expect(std::to_string(v));
  for (const Vec3& p : mesh.positions)
    for (const double expected : p) {
      double x;
      in >> x;
      CHECK(x == expected);
    }
  line("$EndNodes $Elements 4 4 1 4");
  line("3 1 6 1 1 2 9 3 6 10 7");   // reference 0: prism
  line("3 2 6 1 2 4 11 1 8 12 5");  // reference 2: prism, hex
  line("3 2 5 1 3");
  for (const Index v : mesh.cell(0)) expect(std::to_string(v + 1));
  line("3 3 4 1 4 6 10 7 13 $EndElements $ElementData 1 \"scaled_jacobian\" 1 0 3 0 1 4");
  line("1 0.25 2 0.30000000000000004 3 0.5 4 -0.125 $EndElementData");
}

TEST_CASE("every cell of a .msh is in a physical group, whatever the references are") {
  VolumeMesh mesh = referenced_cells();
  const auto entities = [&](std::vector<int> references) {
    mesh.references = std::move(references);
    const std::string text = msh_text(mesh);
    const std::size_t begin = text.find("$Entities\n") + 10;
    std::istringstream lines(text.substr(begin, text.find("$EndEntities") - begin));
    std::vector<std::vector<int>> found;  // number of the volume, and its groups
    std::string line;
    for (std::getline(lines, line); std::getline(lines, line);) {
      std::istringstream words(line);
      int number = 0, num_groups = 0;
      double coordinate;
      words >> number;
      for (int i = 0; i < 6; ++i) words >> coordinate;
      words >> num_groups;
      found.push_back({number});
      for (int group; num_groups > 0 && words >> group; --num_groups) found.back().push_back(group);
    }
    return found;
  };
  using Volumes = std::vector<std::vector<int>>;
  CHECK(entities({}) == Volumes{{1, 1}});
  CHECK(entities({0, 0, 0, 0}) == Volumes{{1, 1}});
  CHECK(entities({1, 0, 1, 0}) == Volumes{{1, 2}, {2, 1}});
  CHECK(entities({-3, 0, 1, 3}) == Volumes{{1, 2}, {2, 4}, {3, 1}, {4, 3}});
  CHECK(entities({-1, -1, 2147483647, 7}) == Volumes{{1, 1}, {2, 7}, {3, 2147483647}});
}

TEST_CASE("meshes that cannot be written as volumes are refused") {
  const auto refused = [](auto spoil) {
    VolumeMesh mesh = referenced_cells();
    std::vector<double> minima = kMinima;
    spoil(mesh, minima);
    CHECK_THROWS_AS(vtu_text(mesh, minima), InputError);
    CHECK_THROWS_AS(msh_text(mesh, minima), InputError);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refused([](VolumeMesh& m, std::vector<double>&) { m = {}; });
  refused([](VolumeMesh& m, std::vector<double>&) { m.cell_vertices.pop_back(); });
  refused([](VolumeMesh& m, std::vector<double>&) { m.references.pop_back(); });
  refused([](VolumeMesh& m, std::vector<double>&) { m.kinds[0] = CellKind::tet; });
  refused([](VolumeMesh& m, std::vector<double>&) { m.cell_vertices[3] = 13; });
  refused([nan](VolumeMesh& m, std::vector<double>&) { m.positions[2].x() = nan; });
  refused([](VolumeMesh&, std::vector<double>& q) { q.pop_back(); });
  refused([nan](VolumeMesh&, std::vector<double>& q) { q[0] = nan; });
  CHECK_THROWS_AS(write_volume("mesh.vtk", referenced_cells()), InputError);
}

TEST_CASE("fields stand at the vertices of a .vtu and a .msh") {
  const VolumeMesh mesh = referenced_cells();
  VertexField field{"thickness", {}};
  for (std::size_t v = 0; v < mesh.num_vertices(); ++v) field.values.push_back(0.1 * static_cast<double>(v));
  const std::vector<VertexField> fields{field};
  CHECK(data_array<double>(vtu_text(mesh, {}, fields), "thickness") == field.values);
  CHECK(msh_text(mesh, {}, fields).find("$NodeData\n1\n\"thickness\"\n") != std::string::npos);
  CHECK_THROWS_AS(vtu_text(mesh, {}, std::vector<VertexField>{{"short", {1}}}), InputError);
  field.values[0] = std::numeric_limits<double>::infinity();
  CHECK_THROWS_AS(msh_text(mesh, {}, std::vector<VertexField>{field}), InputError);
}

TEST_CASE("a .msh of version 2.2 has the physical group of every element") {
  VolumeMesh mesh = with_floor_and_roof(mixed_cells(), 1);
  mesh.face_groups.groups[1].number = 9;
  mesh.face_groups.faces.push_back({mesh.face_groups.faces[0].face, 1});  // a face of two groups
  normalize(mesh.face_groups);
  mesh.references.assign(mesh.num_cells(), 3);
  mesh.references[0] = 0;
  mesh.regions = {{"steel", 3, 3}};
  const TemporaryFolder folder;
  const std::vector<double> minima(mesh.num_cells(), 0.5);
  for (const MshVersion version : {MshVersion::v2_2, MshVersion::v4_1}) {
    write_volume(folder / "a.msh", mesh, minima, {}, version);
    CHECK_NOTHROW(require_written(folder / "a.msh", mesh, version));
    std::vector<std::string> warnings;
    const VolumeMesh found = read_volume_mesh(folder / "a.msh", {.warnings = &warnings});
    CHECK(warnings.empty());
    CHECK(found.positions == mesh.positions);
    CHECK(found.face_groups == mesh.face_groups);
    CHECK(found.regions == mesh.regions);
    CHECK(found.references[0] == 0);
    CHECK(found.references.back() == 3);
  }
  CHECK_THAT(content_of(folder / "a.msh"), Contains("$MeshFormat\n4.1 0 8"));
  const std::string old = msh_text(mesh, minima, {}, MshVersion::v2_2);
  CHECK_THAT(old, Contains("$MeshFormat\n2.2 0 8") && Contains("$PhysicalNames") && !Contains("$Entities"));
  const std::size_t elements = mesh.num_cells() + mesh.face_groups.faces.size();
  CHECK_THAT(old, Contains("$Elements\n" + std::to_string(elements) + "\n") && !Contains("$ElementData"));
  VolumeMesh other = mesh;
  other.face_groups.faces.pop_back();
  write_volume(folder / "b.msh", mesh, {}, {}, MshVersion::v2_2);
  CHECK_THROWS_AS(require_written(folder / "b.msh", other, MshVersion::v2_2), IoError);
}
