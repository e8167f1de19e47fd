// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/error.h"
#include "subvol/export/obj_writer.h"
#include "subvol/export/read_back.h"
#include "subvol/export/usd_writer.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/surface/boundary.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/usda_reader.h"

#include <catch2/catch.hpp>

#include <limits>
#include <set>
#include <sstream>

using namespace subvol;
using subvol::test::TemporaryFolder;
using subvol_tests::UsdaFile;

namespace {

const double kNotANumber = std::numeric_limits<double>::quiet_NaN();

/// The unit cube's quads, outward, with an awkward coordinate.
PolygonMesh cube() {
  PolygonMesh mesh;
  for (int v = 0; v < 8; ++v) mesh.positions.emplace_back(v & 1, (v >> 1) & 1, v >> 2);
  mesh.positions[7].x() = 0.1 + 0.2;
  mesh.face_vertices = {0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4, 2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5};
  for (std::size_t f = 1; f <= 6; ++f) mesh.face_offsets.push_back(4 * f);
  return mesh;
}

/// A square of infinite creases, a path of two softer ones from it, and a corner.
FeatureTags cube_tags() {
  return {.creases = {{0, 1, 10}, {0, 2, 10}, {0, 4, 2.5}, {1, 3, 10}, {2, 3, 10}, {4, 5, 2.5}},
          .corners = {{5, 1.5}, {7, kInfiniteSharpness}}};
}

std::set<std::tuple<Index, Index, double>> edges_of(const UsdaFile& file) {
  std::set<std::tuple<Index, Index, double>> edges;
  const auto& indices = file.numbers("creaseIndices");
  const auto& lengths = file.numbers("creaseLengths");
  const auto& sharpnesses = file.numbers("creaseSharpnesses");
  std::size_t at = 0;
  for (std::size_t c = 0; c < lengths.size(); ++c, ++at)
    for (int k = 0; k + 1 < lengths[c]; ++k, ++at) {
      const auto a = static_cast<Index>(indices.at(at)), b = static_cast<Index>(indices.at(at + 1));
      edges.emplace(std::min(a, b), std::max(a, b), sharpnesses.at(c));
    }
  CHECK(at == indices.size());
  CHECK(lengths.size() == sharpnesses.size());
  return edges;
}

}  // namespace

TEST_CASE("an .obj keeps the quads and reads back as the same doubles") {
  const PolygonMesh mesh = cube();
  std::istringstream in(obj_text(mesh));
  std::string line;
  std::vector<Vec3> positions;
  std::vector<Index> corners;
  std::size_t num_faces = 0;
  while (std::getline(in, line)) {
    std::istringstream words(line);
    std::string key;
    words >> key;
    if (key == "v") {
      Vec3 p;
      words >> p.x() >> p.y() >> p.z();
      positions.push_back(p);
    } else if (key == "f") {
      ++num_faces;
      for (Index v; words >> v;) corners.push_back(v - 1);
    } else {
      CHECK((key == "#" || key == "o"));
    }
  }
  CHECK(positions == mesh.positions);
  CHECK(corners == mesh.face_vertices);
  CHECK(num_faces == 6);
}

TEST_CASE("a .usda cage read back has the same points and faces and is a Catmull-Clark surface") {
  const PolygonMesh mesh = cube();
  const UsdaFile file(usd_text(mesh, cube_tags(), {.name = "cage_1", .meters_per_unit = 0.01, .up_axis = UpAxis::z}));
  CHECK(file.stage.at("defaultPrim") == "cage_1");
  CHECK(file.prim == "cage_1");
  CHECK(file.stage.at("metersPerUnit") == "0.01");
  CHECK(file.stage.at("upAxis") == "Z");
  CHECK(file.token("subdivisionScheme") == "catmullClark");
  CHECK(file.token("interpolateBoundary") == "edgeAndCorner");
  CHECK(file.token("orientation") == "rightHanded");
  const auto& points = file.numbers("points");
  REQUIRE(points.size() == 24);
  for (std::size_t v = 0; v < 8; ++v)
    for (int k = 0; k < 3; ++k) CHECK(points[3 * v + k] == mesh.positions[v][k]);
  CHECK(file.numbers("faceVertexCounts") == std::vector<double>(6, 4));
  const auto& indices = file.numbers("faceVertexIndices");
  CHECK(std::vector<Index>(indices.begin(), indices.end()) == mesh.face_vertices);
  CHECK(file.numbers("extent") == std::vector<double>{0, 0, 0, 1, 1, 1});
}

TEST_CASE("a .usda of tets holds the cells beside the cage") {
  const VolumeMesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {CellKind::tet}, {0, 4}, {0, 1, 2, 3}};
  CHECK(consists_of_tets(mesh));
  const std::string text = usd_text(boundary_surface(mesh, MeshTopology(mesh)), {}, {.tets = &mesh});
  const std::size_t at = text.find("def TetMesh \"cells\"");
  REQUIRE(at != std::string::npos);
  const std::string cells = text.substr(at);
  CHECK(cells.find("point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]") != std::string::npos);
  CHECK(cells.find("int4[] tetVertexIndices = [(0, 1, 2, 3)]") != std::string::npos);
  CHECK(cells.find("int3[] surfaceFaceVertexIndices = [(") != std::string::npos);
  const VolumeMesh cubes = subvol::test::lattice(1, 1, 1);
  CHECK(!consists_of_tets(cubes));
  CHECK_THROWS_AS(usd_text(cube(), {}, {.tets = &cubes}), InputError);
}

TEST_CASE("a .usda cage beyond single precision is refused") {
  PolygonMesh mesh = cube();
  for (Vec3& p : mesh.positions) p *= 1e39;
  CHECK_THROWS_AS(usd_text(mesh, {}), InputError);
}

TEST_CASE("a .usda cage far from the origin keeps its shape in single precision") {
  PolygonMesh mesh = cube();
  for (Vec3& p : mesh.positions) p = 0.5 * p + Vec3(5e6, 5e6, 100);
  const std::string text = usd_text(mesh, {});
  CHECK(text.find("double3 xformOp:translate = (5000000.25, 5000000.25, 100.25)") != std::string::npos);
  CHECK(text.find("uniform token[] xformOpOrder = [\"xformOp:translate\"]") != std::string::npos);
  CHECK(text.find("float3[] extent = [(-0.25, -0.25, -0.25), (0.25, 0.25, 0.25)]") != std::string::npos);
  const TemporaryFolder folder;
  write_usd(folder / "cage.usda", mesh, {});
  CHECK_NOTHROW(require_written(folder / "cage.usda", mesh));
  mesh.positions[3].x() += 1e-3;
  CHECK_THROWS_AS(require_written(folder / "cage.usda", mesh), IoError);
}

TEST_CASE("creases and corners survive the way through .usda, chained where sharpness is equal") {
  const FeatureTags tags = cube_tags();
  const UsdaFile file(usd_text(cube(), tags));
  std::set<std::tuple<Index, Index, double>> expected;
  for (const CreaseEdge& edge : tags.creases) expected.emplace(edge.v0, edge.v1, edge.sharpness);
  CHECK(edges_of(file) == expected);
  CHECK(file.numbers("creaseLengths") == std::vector<double>{5, 3});
  CHECK(file.numbers("cornerIndices") == std::vector<double>{5, 7});
  CHECK(file.numbers("cornerSharpnesses") == std::vector<double>{1.5, 10});
}

TEST_CASE("a crease chain ends where other than two edges meet") {
  const FeatureTags tags{.creases = {{0, 1, 10}, {0, 2, 10}, {0, 4, 10}}, .corners = {}};
  const UsdaFile file(usd_text(cube(), tags));
  CHECK(file.numbers("creaseLengths") == std::vector<double>{2, 2, 2});
  CHECK(edges_of(file).size() == 3);
}

TEST_CASE("every edge of a cube can be a crease, each written once") {
  FeatureTags tags;
  for (Index v = 0; v < 8; ++v)
    for (const Index bit : {1, 2, 4})
      if (!(v & bit)) tags.creases.push_back({v, v | bit, 100});
  const auto edges = edges_of(UsdaFile(usd_text(cube(), tags)));
  CHECK(edges.size() == 12);
  for (const auto& edge : edges) CHECK(std::get<2>(edge) == kInfiniteSharpness);
}

TEST_CASE("a cage without tags has empty crease arrays") {
  const UsdaFile file(usd_text(cube(), {}));
  CHECK(file.numbers("creaseIndices").empty());
  CHECK(file.numbers("cornerSharpnesses").empty());
}

TEST_CASE("cages that cannot be written are refused") {
  const auto refused = [](auto spoil) {
    PolygonMesh mesh = cube();
    FeatureTags tags = cube_tags();
    UsdOptions options;
    spoil(mesh, tags, options);
    CHECK_THROWS_AS(usd_text(mesh, tags, options), InputError);
  };
  using M = PolygonMesh;
  using T = FeatureTags;
  using O = UsdOptions;
  refused([](M& m, T&, O&) { m = {}; });
  refused([](M& m, T&, O&) { m.positions[2].z() = kNotANumber; });
  refused([](M& m, T&, O&) { m.face_vertices[5] = 8; });
  refused([](M& m, T&, O&) { m.face_vertices[5] = -1; });
  refused([](M& m, T&, O&) { m.face_vertices.pop_back(); });
  refused([](M& m, T&, O&) { m.face_offsets = {0, 2, 24}; });
  refused([](M&, T& t, O&) { t.creases.push_back({0, 7, 10}); });
  refused([](M&, T& t, O&) { t.creases[0].sharpness = 0; });
  refused([](M&, T& t, O&) { t.creases[0].sharpness = kNotANumber; });
  refused([](M&, T& t, O&) { t.corners[0].vertex = 8; });
  refused([](M&, T& t, O&) { t.corners[0].sharpness = -1; });
  refused([](M&, T&, O& o) { o.name = "1cage"; });
  refused([](M&, T&, O& o) { o.name = "my cage"; });
  refused([](M&, T&, O& o) { o.name = ""; });
  refused([](M&, T&, O& o) { o.meters_per_unit = 0; });
  PolygonMesh broken = cube();
  broken.positions[0].x() = kNotANumber;
  CHECK_THROWS_AS(obj_text(broken), InputError);
  CHECK_THROWS_AS(obj_text({}), InputError);
  CHECK_THROWS_AS(write_usd("cage.usdc", cube(), {}), InputError);
}
