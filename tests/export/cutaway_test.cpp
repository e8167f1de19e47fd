// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/cutaway.h"

#include "subvol/base/error.h"
#include "subvol/export/color_map.h"
#include "subvol/export/gltf_writer.h"
#include "subvol/fit/quality/high_order_quality.h"
#include "subvol/fit/quality/quality.h"
#include "tests/support/element_fixtures.h"
#include "tests/support/gltf_validator.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/temporary_folder.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <map>
#include <set>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

double area(const ScenePrimitive& primitive) {
  double sum = 0;
  for (std::size_t i = 0; i < primitive.indices.size(); i += 3) {
    const auto p = [&](std::size_t k) -> const Vec3& { return primitive.positions[primitive.indices[i + k]]; };
    sum += (p(1) - p(0)).cross(p(2) - p(0)).norm() / 2;
  }
  return sum;
}

/// Six times the volume that triangles enclose, by the divergence theorem.
double signed_volume(const ScenePrimitive& primitive) {
  double sum = 0;
  for (std::size_t i = 0; i < primitive.indices.size(); i += 3)
    sum += primitive.positions[primitive.indices[i]].dot(
        primitive.positions[primitive.indices[i + 1]].cross(primitive.positions[primitive.indices[i + 2]]));
  return sum;
}

}  // namespace

TEST_CASE("a cutaway of a box of cubes shows the lower half of it, closed by the faces of the cells that went") {
  const VolumeMesh mesh = lattice(4, 3, 2);
  std::vector<double> minima(mesh.num_cells(), 1);
  const Scene scene = cutaway_scene(mesh, minima);  // across z: two layers, one stays
  REQUIRE(scene.nodes.size() == 3);
  CHECK(scene.nodes[0].name == "surface");
  CHECK(scene.nodes[1].name == "cut");
  CHECK(scene.nodes[2].name == "wireframe");
  const ScenePrimitive &surface = scene.nodes[0].primitive, &cut = scene.nodes[1].primitive;
  CHECK(area(surface) == Approx(12 + 14));  // bottom and sides
  CHECK(area(cut) == Approx(12));
  CHECK(cut.positions.size() == 4 * 12);                                 // every face by itself
  CHECK(signed_volume(surface) + signed_volume(cut) == Approx(6 * 12));  // outward, and closed
  for (const Vec3& normal : cut.normals) CHECK(normal.z() == Approx(1));
  // Edges of both, once each: of the bottom, the uprights, and of the cut inside its rim.
  CHECK(scene.nodes[2].primitive.indices.size() == 2 * (31 + 14 + 31));
}

TEST_CASE("the wireframe of a cutaway has the edges of the cells that stay, and no others") {
  VolumeMesh mesh = lattice(5, 4, 3);
  for (std::size_t v = 0; v < mesh.num_vertices(); ++v)
    mesh.positions[v] += 0.1 * mesh.positions[v].y() * Vec3::UnitX();
  const std::vector<double> minima(mesh.num_cells(), 1);
  for (const CutPlane& plane :
       {CutPlane{.axis = 0, .share = 0.6}, CutPlane{.axis = 1}, CutPlane{.axis = 2, .share = 0.3}}) {
    const Scene scene = cutaway_scene(mesh, minima, plane);
    std::set<std::array<double, 6>> of_cells, drawn;
    const auto edge = [](Vec3 a, Vec3 b) {
      if (std::lexicographical_compare(b.begin(), b.end(), a.begin(), a.end())) std::swap(a, b);
      return std::array{a.x(), a.y(), a.z(), b.x(), b.y(), b.z()};
    };
    // What is left of the cells, by the faces that are seen: the surface's and the cut's.
    for (const std::size_t node : {0, 1}) {
      const ScenePrimitive& faces = scene.nodes[node].primitive;
      for (std::size_t i = 0; i < faces.indices.size(); i += 3)
        for (std::size_t k = 0; k < 3; ++k)
          of_cells.insert(edge(faces.positions[faces.indices[i + k]], faces.positions[faces.indices[i + (k + 1) % 3]]));
    }
    const ScenePrimitive& wires = scene.nodes[2].primitive;
    for (std::size_t i = 0; i < wires.indices.size(); i += 2)
      CHECK(drawn.insert(edge(wires.positions[wires.indices[i]], wires.positions[wires.indices[i + 1]])).second);
    for (const auto& wire : drawn) CHECK(of_cells.contains(wire));
    CHECK(drawn.size() > mesh.num_cells() / 2);
  }
}

TEST_CASE("the plane of a cutaway stands where it is told to") {
  const VolumeMesh mesh = lattice(4, 3, 2);
  const std::vector<double> minima(mesh.num_cells(), 1);
  const auto extent = [&](const CutPlane& plane) {
    Eigen::AlignedBox3d box;
    const Scene scene = cutaway_scene(mesh, minima, plane);
    for (const Vec3& p : scene.nodes[0].primitive.positions) box.extend(p);
    return Vec3(box.sizes());
  };
  CHECK(extent({.axis = 0}).x() == Approx(2));
  CHECK(extent({.axis = 0, .share = 0.9}).x() == Approx(3));
  CHECK(extent({.axis = 1, .share = 0.1}).y() == Approx(1));
  CHECK(cutaway_scene(lattice(4, 3, 1), std::vector<double>(12, 1)).nodes.size() == 2);  // nothing to take off
}

TEST_CASE("cut faces have the color of their own cell, the surface the least around") {
  const VolumeMesh mesh = lattice(3, 3, 2);
  std::vector<double> minima;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) minima.push_back(0.05 * static_cast<double>(c));
  const Scene scene = cutaway_scene(mesh, minima);
  const auto& values = scene.nodes[1].primitive.attributes.at(0).values;
  REQUIRE(values.size() == 4 * 9);
  std::map<double, int> times;
  for (const double value : values) ++times[value];
  CHECK(times.size() == 9);
  for (const auto& [value, count] : times) CHECK(count == 4);
  const auto& least = scene.nodes[0].primitive.attributes.at(0).values;
  CHECK(*std::min_element(least.begin(), least.end()) == 0);
}

TEST_CASE("a cutaway of several regions has a part and a color for each, and keeps the quality") {
  const VolumeMesh mesh = lattice(2, 3, 2);
  CellRegions regions{{{"core", 3, 3}, {"shell", 8, 3}}, {}};
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) regions.of_cell.push_back(static_cast<Index>(c % 2));  // by x
  const std::vector<double> minima(mesh.num_cells(), 0.5);
  const Scene scene = cutaway_scene(mesh, minima, {.axis = 2}, {}, regions);
  REQUIRE(scene.nodes.size() == 3);
  for (std::size_t n : {0, 1}) {
    const ScenePrimitive& primitive = scene.nodes[n].primitive;
    REQUIRE(primitive.parts.size() == 2);
    CHECK(primitive.parts[0].name == "core");
    CHECK(primitive.parts[1].name == "shell");
    CHECK(primitive.parts[1].number == 8);
    for (const ScenePart& part : primitive.parts)
      for (std::size_t i = part.first; i < part.first + part.size; ++i)
        CHECK(primitive.colors[primitive.indices[i]] == quality_color(part.number == 3 ? 0.25 : 0.75));
    for (const double value : primitive.attributes.at(0).values) CHECK(value == 0.5);
  }
  regions.of_cell.pop_back();
  CHECK_THROWS_AS(cutaway_scene(mesh, minima, {}, {}, regions), InputError);
}

TEST_CASE("cutaways of cells of every kind, straight and curved, are files without fault") {
  const TemporaryFolder folder;
  VolumeMesh mesh = mixed_cells();
  jitter(mesh, 0.05);
  const CutPlane plane{.axis = 0, .share = 0.3};
  const Scene straight = cutaway_scene(mesh, measure_quality(mesh).cell_minima, plane);
  REQUIRE(straight.nodes.size() == 3);
  CHECK(straight.nodes[1].primitive.positions.size() == 4);  // one quad is laid open
  write_gltf(folder / "straight.glb", straight);
  PointSource source(3);
  HighOrderMesh curved(ElementSpace(mesh, Basis::legendre, 3), mesh);
  for (std::size_t i = mesh.num_vertices(); i < curved.coefficients.size(); ++i)
    curved.coefficients[i] = 0.02 * source.vector();
  const Scene scene = cutaway_scene(curved, measure_quality(curved).cell_minima, plane);
  REQUIRE(scene.nodes.size() == 3);
  CHECK(scene.nodes[1].primitive.positions.size() == 7 * 7);  // and cut finely where it is curved
  write_gltf(folder / "curved.glb", scene);
  check_with_validator({folder / "straight.glb", folder / "curved.glb"});
}

TEST_CASE("cutaways refuse what they cannot show") {
  const VolumeMesh mesh = lattice(2, 2, 2);
  const std::vector<double> minima(8, 1);
  CHECK_THROWS_AS(cutaway_scene(VolumeMesh{}, {}), InputError);
  CHECK_THROWS_AS(cutaway_scene(mesh, std::vector<double>(7, 1)), InputError);
  CHECK_THROWS_AS(cutaway_scene(mesh, minima, {.axis = 3}), InputError);
  CHECK_THROWS_AS(cutaway_scene(mesh, minima, {.share = 0}), InputError);
  CHECK_THROWS_AS(cutaway_scene(mesh, minima, {.share = 1}), InputError);
}
