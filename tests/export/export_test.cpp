// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/export.h"

#include "subvol/base/error.h"
#include "subvol/export/gltf_writer.h"
#include "subvol/export/polygon_shading.h"
#include "subvol/export/read_back.h"
#include "subvol/export/surface_writer.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/io/surface_io.h"
#include "subvol/subdivision/subdivision.h"
#include "tests/support/glb_reader.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/surface_fixtures.h"
#include "tests/support/temporary_folder.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;
using subvol_tests::GlbFile;

namespace {

VolumeMesh cage_of_two_kinds() {
  VolumeMesh cage = mixed_cells();
  jitter(cage, 0.05);
  return cage;
}

const SceneValues& extras_of(const Scene& scene) { return scene.extras; }

bool has_extra(const Scene& scene, const std::string& key) {
  return std::any_of(extras_of(scene).begin(), extras_of(scene).end(), [&](const auto& e) { return e.first == key; });
}

}  // namespace

TEST_CASE("the scene of a cage holds its limit surface, colored by the finest cells, and the cage's edges") {
  const VolumeMesh cage = cage_of_two_kinds();
  const VolumeMesh finest = subdivide(cage).fine;
  const Scene scene = surface_scene(cage, &finest, {.name = "cage", .max_chord_percent = 0.1, .source = "cage.mesh"});
  REQUIRE(scene.nodes.size() == 2);
  CHECK(scene.nodes[0].name == "surface");
  CHECK(scene.nodes[1].name == "wireframe");
  const ScenePrimitive& surface = scene.nodes[0].primitive;
  CHECK(surface.colors.size() == surface.positions.size());
  REQUIRE(surface.attributes.size() == 1);
  const auto& quality = surface.attributes[0].values;
  const QualityReport report = measure_quality(finest);
  CHECK(*std::min_element(quality.begin(), quality.end()) >= report.min_scaled_jacobian);
  CHECK(*std::max_element(quality.begin(), quality.end()) <= 1);
  for (std::size_t i = 0; i < surface.indices.size(); i += 6) {  // a quad's triangles share their diagonal
    CHECK(surface.indices[i] == surface.indices[i + 3]);
    CHECK(surface.indices[i + 2] == surface.indices[i + 4]);
  }
  for (const char* key : {"source", "color_map", "chord_error"}) CHECK(has_extra(scene, key));
  const GlbFile file(gltf_bytes(scene, GltfContainer::glb));
  CHECK(file.attribute<float>("surface", "POSITION").size() == 3 * surface.positions.size());
  CHECK(gltf_bytes(scene, GltfContainer::glb) ==
        gltf_bytes(surface_scene(cage, &finest, {.name = "cage", .max_chord_percent = 0.1, .source = "cage.mesh"}),
                   GltfContainer::glb));
}

TEST_CASE("a patch has the quality of the child cell at its corner") {
  const VolumeMesh cage = cage_of_two_kinds();
  const MeshTopology topology(cage);
  const VolumeMesh child = subdivide(cage).fine, grandchild = subdivide(child).fine;
  const TessellatedSurface surface = tessellate(cage, 0.05);
  std::vector<double> marks(child.num_cells());
  for (std::size_t c = 0; c < marks.size(); ++c) marks[c] = static_cast<double>(c);
  const std::vector<double> marked = patch_quality(cage, surface, marks);
  REQUIRE(marked.size() == surface.patches.size());
  for (std::size_t p = 0; p < marked.size(); ++p) {
    // The child that is meant has the face's corner, its cell's center, and lies in the face's cell.
    const Index f = topology.boundary_faces()[surface.patches[p].face];
    const Index corner = topology.face(f)[surface.patches[p].corner];
    const auto cell = child.cell(static_cast<std::size_t>(marked[p]));
    CHECK(std::find(cell.begin(), cell.end(), corner) != cell.end());
    const auto face_child = static_cast<Index>(cage.num_vertices() + topology.num_edges()) + f;
    CHECK(std::find(cell.begin(), cell.end(), face_child) != cell.end());
  }
  std::vector<double> ones(grandchild.num_cells(), 1);
  ones[8 * static_cast<std::size_t>(marked[3]) + 5] = -0.5;
  const std::vector<double> spotted = patch_quality(cage, surface, ones);
  CHECK(spotted[3] == -0.5);
  const std::vector<double> own = patch_quality(cage, surface, std::vector<double>(cage.num_cells(), 0.25));
  CHECK(own == std::vector<double>(surface.patches.size(), 0.25));
  CHECK_THROWS_AS(patch_quality(cage, surface, std::vector<double>(cage.num_cells() + 1, 1.0)), InputError);
}

TEST_CASE("positions are written relative to the middle of the bounding box") {
  VolumeMesh cage = lattice(2, 1, 1);
  for (Vec3& p : cage.positions) p += Vec3(1e7, -1e7, 1e7);
  const Scene scene = surface_scene(cage, nullptr, {.max_chord_percent = 0.5, .wireframe = false});
  CHECK(scene.nodes.size() == 1);
  CHECK((scene.origin - Vec3(1e7 + 1, -1e7 + 0.5, 1e7 + 0.5)).norm() < 1e-6);
  const GlbFile file(gltf_bytes(scene, GltfContainer::glb));
  for (const float x : file.attribute<float>("surface", "POSITION")) CHECK(std::abs(x) < 1.01f);
}

TEST_CASE("the scene of a plain mesh has its flat faces, parted where they meet sharply") {
  const Scene scene = boundary_scene(lattice(2, 2, 2), {.meters_per_unit = 0.01});
  const ScenePrimitive& surface = scene.nodes[0].primitive;
  CHECK(surface.positions.size() == 6u * 9u);
  CHECK(surface.indices.size() == 24u * 6u);
  CHECK(scene.nodes[1].primitive.indices.size() == 2u * 48u);
  for (const double q : surface.attributes[0].values) CHECK(q == Approx(1));
  const GlbFile file(gltf_bytes(scene, GltfContainer::glb));
  CHECK(file.json["nodes"][0]["scale"][0] == 0.01);
}

TEST_CASE("polygons without quality have no colors") {
  PolygonMesh square;
  square.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  square.face_vertices = {0, 1, 2, 3};
  square.face_offsets = {0, 4};
  const Scene scene = polygon_scene(square);
  CHECK(scene.nodes[0].primitive.colors.empty());
  CHECK(scene.nodes[0].primitive.attributes.empty());
  for (const Vec3& normal : scene.nodes[0].primitive.normals) CHECK(normal == Vec3::UnitZ());
  CHECK_THROWS_AS(polygon_scene(square, std::vector<double>{1.0, 1.0}), InputError);
  CHECK_THROWS_AS(polygon_scene({}), InputError);
}

TEST_CASE("normals are averaged across blunt edges and parted at sharp ones") {
  // Two squares that meet at an angle of 45 degrees along the y axis.
  PolygonMesh roof;
  roof.positions = {{-1, 0, 0}, {0, 0, 0}, {0, 1, 0}, {-1, 1, 0}, {1, 0, -1}, {1, 1, -1}};
  roof.face_vertices = {0, 1, 2, 3, 1, 4, 5, 2};
  roof.face_offsets = {0, 4, 8};
  CHECK(shade_polygons(roof, 46).positions.size() == 6);
  CHECK(shade_polygons(roof, 44).positions.size() == 8);
  const ShadedPolygons smooth = shade_polygons(roof, 46);
  const Vec3 ridge = smooth.normals[smooth.corner_vertices[1]];
  CHECK((ridge - Vec3(1, 0, 2).normalized()).norm() < 1e-12);  // areas 1 and sqrt(2)
  CHECK_THROWS_AS(shade_polygons(roof, 181), InputError);
}

TEST_CASE("corners are shaded together where smooth edges lead from one to the other") {
  RandomPoints random(6);
  PolygonMesh soup;  // edges of many faces, faces that come to a vertex twice
  soup.positions = random.points(9);
  soup.face_offsets = {0};
  for (int f = 0; f < 60; ++f) {
    for (int k = 0; k < 3 + f % 3; ++k)
      soup.face_vertices.push_back(static_cast<Index>(random.number(0, static_cast<double>(soup.positions.size()))));
    soup.face_offsets.push_back(soup.face_vertices.size());
  }
  const auto area = [&](std::size_t f) {
    const auto at = [&](std::size_t k) { return soup.positions[soup.face_vertices[k]]; };
    Vec3 sum = Vec3::Zero();
    for (std::size_t k = soup.face_offsets[f] + 1; k + 1 < soup.face_offsets[f + 1]; ++k)
      sum += (at(k) - at(soup.face_offsets[f])).cross(at(k + 1) - at(soup.face_offsets[f]));
    return sum;
  };
  struct Corner {
    Index vertex, before, after;
    std::size_t face;
  };
  std::vector<Corner> corners;
  for (std::size_t f = 0; f < soup.num_faces(); ++f)
    for (std::size_t first = soup.face_offsets[f], end = soup.face_offsets[f + 1], k = first; k < end; ++k)
      corners.push_back({soup.face_vertices[k], soup.face_vertices[k == first ? end - 1 : k - 1],
                         soup.face_vertices[k + 1 == end ? first : k + 1], f});
  for (const double angle : {5.0, 15.0, 40.0}) {
    // Each corner's group: the least number that gets to it.
    std::vector<std::size_t> group(corners.size());
    for (std::size_t i = 0; i < group.size(); ++i) group[i] = i;
    for (bool changed = true; changed;) {
      changed = false;
      for (std::size_t i = 0; i < corners.size(); ++i)
        for (std::size_t j = 0; j < corners.size(); ++j) {
          const Corner &a = corners[i], &b = corners[j];
          if (a.vertex != b.vertex || group[i] <= group[j]) continue;
          if (a.before != b.before && a.before != b.after && a.after != b.before && a.after != b.after) continue;
          const Vec3 p = area(a.face), q = area(b.face);
          if (!(p.dot(q) > std::cos(angle * std::numbers::pi / 180) * p.norm() * q.norm())) continue;
          group[i] = group[j];
          changed = true;
        }
    }
    const ShadedPolygons shaded = shade_polygons(soup, angle);
    std::size_t groups = 0;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      groups += group[i] == i;
      CHECK(shaded.corner_vertices[i] == shaded.corner_vertices[group[i]]);
    }
    CHECK(shaded.positions.size() == groups);
    CHECK(groups > soup.positions.size());
    CHECK(groups < corners.size());
  }
}

TEST_CASE("a vertex of very many faces is shaded by its sharp edges alone") {
  constexpr Index kFaces = 5000;
  PolygonMesh cone;  // two thirds of its faces lie flat
  cone.positions = {{0, 0, 0}};
  cone.face_offsets = {0};
  for (Index k = 0; k < kFaces; ++k) {
    const double angle = 2 * std::numbers::pi * k / kFaces;
    cone.positions.push_back({std::cos(angle), std::sin(angle), 3 * k < kFaces ? 0.5 : 0});
    cone.face_vertices.insert(cone.face_vertices.end(), {0, k + 1, (k + 1) % kFaces + 1});
    cone.face_offsets.push_back(cone.face_vertices.size());
  }
  const ShadedPolygons shaded = shade_polygons(cone, 30);
  std::set<Index> at_tip;
  for (std::size_t k = 0; k < cone.face_vertices.size(); k += 3) at_tip.insert(shaded.corner_vertices[k]);
  CHECK(at_tip.size() == 4);  // flat, steep, and the two faces between
}

TEST_CASE("options out of range are refused") {
  const VolumeMesh cage = lattice(1, 1, 1);
  CHECK_THROWS_AS(surface_scene(cage, nullptr, {.max_chord_percent = 0}), InputError);
  const VolumeMesh stranger = lattice(3, 1, 1);
  CHECK_THROWS_AS(surface_scene(cage, &stranger, {}), InputError);
}

TEST_CASE("a scene of sheets has a node for each with its attribute and colors, and one wireframe") {
  const PolygonMesh square{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {0, 4}, {0, 1, 2, 3}};
  PolygonMesh above = square;
  for (Vec3& p : above.positions) p.z() = 1;
  const std::vector<SceneSheet> sheets{
      {.name = "lower", .mesh = square},
      {.name = "upper", .mesh = above, .attribute = {"_HEIGHT", {1, 2, 3, 4}}, .shades = {0, 0.3, 0.6, 1}}};
  const Scene scene = sheet_scene(sheets, "a map");
  REQUIRE(scene.nodes.size() == 3);
  CHECK(scene.nodes[0].name == "lower");
  CHECK(scene.nodes[0].primitive.colors.empty());
  CHECK(scene.nodes[1].name == "upper");
  CHECK(scene.nodes[1].primitive.colors.size() == 4);
  CHECK(scene.nodes[1].primitive.attributes[0].values == std::vector<double>{1, 2, 3, 4});
  CHECK(scene.nodes[2].name == "wireframe");
  CHECK(scene.nodes[2].primitive.indices.size() == 16);
  CHECK(has_extra(scene, "color_map"));
  CHECK(scene.origin == Vec3(0.5, 0.5, 0.5));
  CHECK_NOTHROW(gltf_bytes(scene, GltfContainer::glb));
  CHECK_THROWS_AS(sheet_scene({}, ""), InputError);
  CHECK_THROWS_AS(sheet_scene(std::vector<SceneSheet>{{.name = "x", .mesh = square, .shades = {1}}}, ""), InputError);
}

TEST_CASE("A surface far from the origin is written to .stl without loss") {
  PolygonMesh triangle;
  const Vec3 origin(5e5, 4.5e6, 100);
  triangle.positions = {origin, origin + Vec3(0.1, 0, 0), origin + Vec3(0, 0.1, 0)};
  triangle.face_vertices = {0, 1, 2};
  triangle.face_offsets = {0, 3};
  const std::string text = surface_bytes(".stl", triangle);
  CHECK(text.starts_with("solid "));
  CHECK(text.find("4500000.1") != std::string::npos);
  for (Vec3& p : triangle.positions) p -= origin;
  CHECK_FALSE(surface_bytes(".stl", triangle).starts_with("solid "));
}

TEST_CASE("Coordinates beyond single precision are written to .stl as text, and come back") {
  const TemporaryFolder folder;
  for (const double size : {1e39, 1.0, 1e-37}) {
    CAPTURE(size);
    PolygonMesh triangle;
    triangle.positions = {Vec3(0, 0, 0), Vec3(size, 0, 0), Vec3(0, size, 0)};
    triangle.face_vertices = {0, 1, 2};
    triangle.face_offsets = {0, 3};
    write_surface(folder / "a.stl", triangle);
    CHECK_NOTHROW(require_written(folder / "a.stl", triangle));
    CHECK(surface_bytes(".stl", triangle).starts_with("solid ") == (size != 1));
    const PolygonMesh found = read_polygon_mesh(folder / "a.stl");
    CHECK(found.positions == triangle.positions);
  }
}

TEST_CASE("Solids of an .stl have names of their own, also that of the faces of no group") {
  PolygonMesh surface;
  for (int i = 0; i < 4; ++i) {
    surface.positions.insert(surface.positions.end(), {Vec3(i, 0, 0), Vec3(i, 1, 0), Vec3(i, 0, 1)});
    for (int k = 0; k < 3; ++k) surface.face_vertices.push_back(3 * i + k);
    surface.face_offsets.push_back(surface.face_vertices.size());
  }
  surface.face_groups = {{{"none", 1, 2}, {"wall", 2, 2}, {"wall", 3, 2}}, {1, kNoIndex, 2, 0}};
  const TemporaryFolder folder;
  write_surface(folder / "a.stl", surface);
  const PolygonMesh found = read_polygon_mesh(folder / "a.stl");
  std::vector<std::string> names;
  for (const Group& group : found.face_groups.groups) names.push_back(group.name);
  CHECK(names == std::vector<std::string>{"none", "wall", "wall 2", "none 2"});
  CHECK(found.face_groups.of_face == std::vector<Index>{0, 1, 2, 3});
}
