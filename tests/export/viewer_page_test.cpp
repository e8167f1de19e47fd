// SPDX-License-Identifier: GPL-3.0-or-later
// What the viewer's page holds: the points of straight and curved cells, packed arrays, fields.

#include "subvol/export/viewer_page.h"
#include "subvol/base/base64.h"
#include "subvol/base/error.h"
#include "subvol/export/packed_array.h"
#include "subvol/export/viewer_content.h"
#include "tests/support/sample_meshes.h"

#include <zlib.h>
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include <bit>
#include <cmath>
#include <limits>
#include <random>

using namespace subvol;
using namespace subvol::internal;

namespace {

/// The numbers of an array as the page holds it, decoded as export/viewer/data.js does.
std::vector<std::uint32_t> unpacked(const nlohmann::json& array) {
  const std::size_t size = array.at("size"), stride = array.at("stride");
  const std::optional<std::string> deflated = decode_base64(array.at("data").get<std::string>());
  REQUIRE(deflated);
  std::string planes(4 * size + 1, '\0');
  uLongf length = planes.size();
  REQUIRE(uncompress(reinterpret_cast<Bytef*>(planes.data()), &length, reinterpret_cast<const Bytef*>(deflated->data()),
                     deflated->size()) == Z_OK);
  REQUIRE(length == 4 * size);
  std::vector<std::uint32_t> values(size);
  for (std::size_t i = 0; i < size; ++i) {
    for (std::size_t k = 0; k < 4; ++k)
      values[i] |= static_cast<std::uint32_t>(static_cast<unsigned char>(planes[k * size + i])) << (8 * k);
    if (i >= stride) values[i] += values[i - stride];
  }
  return values;
}

/// The data of a page.
nlohmann::json data_of(const std::string& page) {
  const std::string opening = "<script type=\"application/json\">";
  const std::size_t begin = page.find(opening) + opening.size();
  return nlohmann::json::parse(page.substr(begin, page.find("</script>", begin) - begin));
}

/// A hex, a prism on its side and a tet on that, curved at random.
HighOrderMesh curved_mixture(Basis basis, int order) {
  VolumeMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0},   {0, 1, 0},   {0, 0, 1},    {1, 0, 1},
                    {1, 1, 1}, {0, 1, 1}, {2, 0.5, 0}, {2, 0.5, 1}, {1.7, 0.5, 2}};
  mesh.add_cell(CellKind::tet, std::array<Index, 4>{5, 9, 6, 10});
  mesh.add_cell(CellKind::hex, std::array<Index, 8>{0, 1, 2, 3, 4, 5, 6, 7});
  mesh.add_cell(CellKind::prism, std::array<Index, 6>{1, 8, 2, 5, 9, 6});
  HighOrderMesh curved(ElementSpace(mesh, basis, order), mesh);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> displacement(-0.05, 0.05);
  for (std::size_t a = mesh.num_vertices(); a < curved.coefficients.size(); ++a)
    for (int k = 0; k < 3; ++k) curved.coefficients[a][k] = displacement(random);
  return curved;
}

/// The place of a vertex in a cell, in canonical coordinates.
Vec3 corner(const ElementSpace& space, std::size_t c, Index vertex) {
  const auto vertices = space.vertices(c);
  const auto at = std::find(vertices.begin(), vertices.end(), vertex);
  REQUIRE(at != vertices.end());
  return canonical_vertices(space.kind(c))[static_cast<std::size_t>(at - vertices.begin())];
}

}  // namespace

TEST_CASE("The viewer's points of curved cells lie where every cell has them", "[viewer]") {
  const Basis basis = GENERATE(Basis::legendre, Basis::fourier);
  const HighOrderMesh mesh = curved_mixture(basis, 4);
  const ElementSpace& space = mesh.space;
  const MeshTopology& topology = space.topology();
  const int n = GENERATE(2, 3, 5);
  const ViewerMesh shown = viewer_mesh("a", mesh, n);
  CHECK(shown.num_vertices == 11);
  CHECK(shown.num_edges == topology.num_edges());
  std::size_t edge_place = 0, face_place = 0;
  for (std::size_t c = 0; c < space.num_cells(); ++c) {
    for (const Index e : topology.cell_edges(c)) {
      REQUIRE(shown.edges.at(edge_place++) == e);
      const auto [a, b] = topology.edge(e);
      for (int i = 1; i < n; ++i) {
        const Vec3 at = (corner(space, c, a) * (n - i) + corner(space, c, b) * i) / n;
        const std::size_t place = shown.num_vertices + static_cast<std::size_t>(e * (n - 1) + i - 1);
        CHECK((shown.points.at(place) - mesh.position(c, at)).norm() < 1e-13);
      }
    }
    for (const Index f : topology.cell_faces(c)) {
      REQUIRE(shown.faces.at(face_place++) == f);
      std::size_t place = shown.num_vertices + shown.num_edges * static_cast<std::size_t>(n - 1);
      for (Index g = 0; g < f; ++g)
        place += static_cast<std::size_t>(topology.face(g).size() == 4 ? (n - 1) * (n - 1) : (n - 1) * (n - 2) / 2);
      std::vector<Index> v(topology.face(f).begin(), topology.face(f).end());
      std::rotate(v.begin(), std::min_element(v.begin(), v.end()), v.end());
      const bool is_quad = v.size() == 4;
      if (is_quad ? v[3] < v[1] : v[2] < v[1]) std::reverse(v.begin() + 1, v.end());
      const Vec3 origin = corner(space, c, v[0]), to_i = corner(space, c, v[1]) - origin,
                 to_j = corner(space, c, is_quad ? v[3] : v[2]) - origin;
      for (int j = 1; j < n; ++j)
        for (int i = 1; is_quad ? i < n : i + j < n; ++i)
          CHECK((shown.points.at(place++) - mesh.position(c, origin + to_i * i / n + to_j * j / n)).norm() < 1e-13);
    }
  }
  CHECK(viewer_mesh("a", mesh, 1).points.size() == 11);
  CHECK_THROWS_AS(viewer_mesh("a", mesh, 0), InputError);
  CHECK(viewer_intervals(mesh) == 8);
  CHECK(viewer_intervals(mesh, 10) == 2);
  CHECK(viewer_intervals(curved_mixture(basis, 1)) == 1);
}

TEST_CASE("Packed arrays come back to the bit", "[viewer]") {
  const std::vector<std::uint32_t> numbers{5, 0, 4294967295u, 7, 7, 8, 1u << 31};
  for (const std::size_t stride : {std::size_t{1}, std::size_t{3}, std::size_t{100}}) {
    std::string json;
    append_packed(json, numbers, stride);
    CHECK(unpacked(nlohmann::json::parse(json)) == numbers);
  }
  const std::vector<float> values{0, -0.0f, 1e-40f, std::numeric_limits<float>::quiet_NaN(), -3.5f};
  std::string json;
  append_packed(json, values, 1);
  const auto array = nlohmann::json::parse(json);
  CHECK(array["type"] == "f32");
  const std::vector<std::uint32_t> bits = unpacked(array);
  for (std::size_t i = 0; i < values.size(); ++i) CHECK(bits[i] == std::bit_cast<std::uint32_t>(values[i]));
  json.clear();
  append_packed(json, std::vector<float>{}, 3);
  CHECK(unpacked(nlohmann::json::parse(json)).empty());
}

TEST_CASE("A page holds its meshes, and nothing ends its data early", "[viewer]") {
  ViewerContent content{.title = "</script><b>\xff"};
  if (!has_viewer()) {
    content.meshes.push_back(viewer_mesh("m", test::lattice(1, 1, 1)));
    CHECK_THROWS_AS(viewer_page(content), std::logic_error);
    return;
  }
  CHECK_THROWS_AS(viewer_page(content), InputError);
  content.meshes.push_back(viewer_mesh("two cells", test::lattice(2, 1, 1)));
  ViewerMesh& mesh = content.meshes.front();
  mesh.fields.push_back({.name = "region",
                         .label = "Region",
                         .colors = ViewerField::Colors::regions,
                         .values = {3, 4},
                         .region_names = {{3, "steel"}}});
  mesh.inverted = {1};
  content.target = viewer_surface({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}, {}});
  const std::string page = viewer_page(content);
  CHECK(page.starts_with("<!DOCTYPE html>"));
  CHECK(page.find("<title>&lt;/script&gt;&lt;b&gt;") != std::string::npos);
  const nlohmann::json data = data_of(page);
  CHECK(data["title"].get<std::string>().starts_with("</script><b>"));
  CHECK(data["origin"] == nlohmann::json({1.0, 0.5, 0.5}));
  const nlohmann::json& first = data["meshes"][0];
  CHECK(first["kind"] == 2);
  CHECK(first["num_cells"] == 2);
  CHECK(unpacked(first["corners"]) == std::vector<std::uint32_t>(mesh.corners.begin(), mesh.corners.end()));
  CHECK(unpacked(first["inverted"]) == std::vector<std::uint32_t>{1});
  const std::vector<std::uint32_t> points = unpacked(first["points"]);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto axis = static_cast<Eigen::Index>(i % 3);
    CHECK(std::bit_cast<float>(points[i]) == mesh.points[i / 3][axis] - (axis == 0 ? 1 : 0.5));
  }
  CHECK(first["fields"][0]["names"]["3"] == "steel");
  CHECK(unpacked(data["target"]["triangles"]) == std::vector<std::uint32_t>{0, 1, 2});

  mesh.fields.front().values.pop_back();
  CHECK_THROWS_AS(viewer_page(content), InputError);
  mesh.fields.clear();
  mesh.points[0].x() = std::numeric_limits<double>::infinity();
  CHECK_THROWS_AS(viewer_page(content), InputError);
}

TEST_CASE("A page of positions beyond single precision is refused", "[viewer]") {
  if (!has_viewer()) return;
  for (const double size : {1e39, 1e-38}) {
    VolumeMesh mesh = subvol::test::lattice(1, 1, 1);
    for (Vec3& p : mesh.positions) p *= size;
    ViewerContent content;
    content.meshes.push_back(viewer_mesh("cube", mesh));
    CHECK_THROWS_WITH(viewer_page(content), Catch::Contains("float32"));
  }
}

TEST_CASE("Surfaces and limit surfaces become what the viewer draws", "[viewer]") {
  PolygonMesh surface;
  surface.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 2, 0}};
  surface.face_offsets = {0, 4, 7};
  surface.face_vertices = {0, 1, 2, 3, 3, 2, 4};
  CHECK(viewer_mesh("s", surface).kinds == std::vector<std::uint8_t>{5, 4});
  surface.face_offsets = {0, 5};
  surface.face_vertices = {0, 1, 2, 4, 3};
  CHECK(viewer_mesh("s", surface).kinds == std::vector<std::uint8_t>{4, 4, 4});

  const VolumeMesh cage = test::lattice(2, 2, 2);
  const ViewerSurface limit = viewer_limit(cage, std::vector<double>(8, 0.5), 0.01);
  CHECK(limit.values == std::vector<float>(limit.points.size(), 0.5f));
  CHECK(!limit.wires.empty());
  CHECK(limit.triangles.size() % 2 == 0);
  CHECK(viewer_limit(cage, {}, 0.01).values.empty());
  CHECK(viewer_wires(cage).wires.size() == 48);
}
