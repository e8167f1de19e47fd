// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/surface/boundary.h"

#include "tests/support/sample_meshes.h"

#include <catch2/catch.hpp>

#include <set>

using namespace subvol;
using namespace subvol::test;

namespace {

PolygonMesh polygon(std::vector<Vec3> positions) {
  PolygonMesh mesh;
  for (std::size_t i = 0; i < positions.size(); ++i) mesh.face_vertices.push_back(static_cast<Index>(i));
  mesh.face_offsets.push_back(positions.size());
  mesh.positions = std::move(positions);
  return mesh;
}

Vec3 area_vector(const TriangleMesh& mesh, const std::array<Index, 3>& t) {
  const auto& x = mesh.positions;
  return 0.5 * (x[t[1]] - x[t[0]]).cross(x[t[2]] - x[t[0]]);
}

double volume(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles) sum += area_vector(mesh, t).dot(mesh.positions[t[0]]) / 3;
  return sum;
}

}  // namespace

TEST_CASE("the boundary of a mesh is closed, points outwards and holds no inner vertex") {
  const VolumeMesh mesh = lattice(3, 3, 3);
  std::vector<Index> volume_vertex;
  const PolygonMesh surface = boundary_surface(mesh, MeshTopology(mesh), &volume_vertex);
  CHECK(surface.num_faces() == 54);
  REQUIRE(surface.positions.size() == 64 - 8);
  REQUIRE(volume_vertex.size() == 56);
  CHECK(std::is_sorted(volume_vertex.begin(), volume_vertex.end()));
  for (std::size_t v = 0; v < 56; ++v) CHECK(surface.positions[v] == mesh.positions[volume_vertex[v]]);
  CHECK(volume(triangulate(surface)) == Approx(27));
}

TEST_CASE("the boundary of mixed cells keeps triangles and quads and encloses the cells' volume") {
  const VolumeMesh mesh = mixed_cells();
  const PolygonMesh surface = boundary_surface(mesh, MeshTopology(mesh));
  std::vector<Index> origin;
  const TriangleMesh triangles = triangulate(surface, &origin);
  REQUIRE(origin.size() == triangles.triangles.size());
  CHECK(std::is_sorted(origin.begin(), origin.end()));
  // Cube 1, two prisms of 1/2 each, a tet over half a unit square's triangle with height 1.
  CHECK(volume(triangles) == Approx(1 + 0.5 + 0.5 + 0.5 / 3));
}

TEST_CASE("a quad is cut by its shorter diagonal, by the one from its first corner when both are equal") {
  const TriangleMesh square = triangulate(polygon({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}));
  CHECK(square.triangles == std::vector<std::array<Index, 3>>{{0, 1, 2}, {0, 2, 3}});
  const TriangleMesh kite = triangulate(polygon({{0, 0, 0}, {1, -0.2, 0}, {2, 0, 0}, {1, 0.2, 0}}));
  CHECK(kite.triangles == std::vector<std::array<Index, 3>>{{0, 1, 3}, {1, 2, 3}});
}

TEST_CASE("a dart is cut inside even where the outer diagonal is shorter") {
  // Reflex at corner 3; the diagonal 0-2 is shorter than 1-3 but runs outside.
  const TriangleMesh dart = triangulate(polygon({{-0.2, 0, 0}, {0, -3, 0}, {0.2, 0, 0}, {0, -0.5, 0}}));
  for (const auto& t : dart.triangles) CHECK(area_vector(dart, t).z() > 0);
}

TEST_CASE("a concave polygon is cut into triangles of its own area") {
  // A comb with three teeth.
  const PolygonMesh comb = polygon({{0, 0, 0},
                                    {5, 0, 0},
                                    {5, 3, 0},
                                    {4, 3, 0},
                                    {4, 1, 0},
                                    {3, 1, 0},
                                    {3, 3, 0},
                                    {2, 3, 0},
                                    {2, 1, 0},
                                    {1, 1, 0},
                                    {1, 3, 0},
                                    {0, 3, 0}});
  const TriangleMesh cut = triangulate(comb);
  REQUIRE(cut.triangles.size() == 10);
  double area = 0;
  for (const auto& t : cut.triangles) {
    CHECK(area_vector(cut, t).z() > 0);
    area += area_vector(cut, t).z();
  }
  CHECK(area == Approx(11));
}

TEST_CASE("triangulating takes triangles as they are and gives nothing for less than a triangle") {
  PolygonMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.face_vertices = {2, 0, 1, 0, 1};
  mesh.face_offsets = {0, 3, 5};
  CHECK(triangulate(mesh).triangles == std::vector<std::array<Index, 3>>{{2, 0, 1}});
  CHECK(triangulate(PolygonMesh{}).triangles.empty());
}
