// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/export.h"

#include "export/gltf_writer.h"
#include "export/polygon_shading.h"
#include "fit/quality.h"
#include "subvol/error.h"
#include "subvol/subdivision.h"
#include "tests/glb_reader.h"
#include "tests/sample_meshes.h"

#include <catch2/catch.hpp>

#include <algorithm>

using namespace subvol;
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

TEST_CASE("the scene of a cage holds its limit surface, coloured by the finest cells, and the cage's edges") {
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
  for (const char* key : {"source", "colour_map", "chord_error"}) CHECK(has_extra(scene, key));
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
    // The child that is meant has the face's corner, its cell's centre, and lies in the face's cell.
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
  const Scene scene = boundary_scene(lattice(2, 2, 2), {.metres_per_unit = 0.01});
  const ScenePrimitive& surface = scene.nodes[0].primitive;
  CHECK(surface.positions.size() == 6u * 9u);
  CHECK(surface.indices.size() == 24u * 6u);
  CHECK(scene.nodes[1].primitive.indices.size() == 2u * 48u);
  for (const double q : surface.attributes[0].values) CHECK(q == Approx(1));
  const GlbFile file(gltf_bytes(scene, GltfContainer::glb));
  CHECK(file.json["nodes"][0]["scale"][0] == 0.01);
}

TEST_CASE("polygons without quality have no colours") {
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

TEST_CASE("options out of range are refused") {
  const VolumeMesh cage = lattice(1, 1, 1);
  CHECK_THROWS_AS(surface_scene(cage, nullptr, {.max_chord_percent = 0}), InputError);
  const VolumeMesh stranger = lattice(3, 1, 1);
  CHECK_THROWS_AS(surface_scene(cage, &stranger, {}), InputError);
}

TEST_CASE("a scene of sheets has a node for each with its attribute and colours, and one wireframe") {
  const PolygonMesh square{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {0, 4}, {0, 1, 2, 3}};
  PolygonMesh above = square;
  for (Vec3& p : above.positions) p.z() = 1;
  const std::vector<SceneSheet> sheets{{.name = "lower", .mesh = square},
                                       {.name = "upper", .mesh = above, .attribute = {"_HEIGHT", {1, 2, 3, 4}},
                                        .shades = {0, 0.3, 0.6, 1}}};
  const Scene scene = sheet_scene(sheets, "a map");
  REQUIRE(scene.nodes.size() == 3);
  CHECK(scene.nodes[0].name == "lower");
  CHECK(scene.nodes[0].primitive.colors.empty());
  CHECK(scene.nodes[1].name == "upper");
  CHECK(scene.nodes[1].primitive.colors.size() == 4);
  CHECK(scene.nodes[1].primitive.attributes[0].values == std::vector<double>{1, 2, 3, 4});
  CHECK(scene.nodes[2].name == "wireframe");
  CHECK(scene.nodes[2].primitive.indices.size() == 16);
  CHECK(has_extra(scene, "colour_map"));
  CHECK(scene.origin == Vec3(0.5, 0.5, 0.5));
  CHECK_NOTHROW(gltf_bytes(scene, GltfContainer::glb));
  CHECK_THROWS_AS(sheet_scene({}, ""), InputError);
  CHECK_THROWS_AS(sheet_scene(std::vector<SceneSheet>{{.name = "x", .mesh = square, .shades = {1}}}, ""), InputError);
}
