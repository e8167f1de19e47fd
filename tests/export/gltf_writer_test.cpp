// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/gltf_writer.h"

#include "subvol/base/error.h"
#include "subvol/base/version.h"
#include "subvol/export/color_map.h"
#include "subvol/export/export.h"
#include "tests/support/element_fixtures.h"
#include "tests/support/glb_reader.h"
#include "tests/support/gltf_validator.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

using namespace subvol;
using namespace subvol::test;
using subvol_tests::GlbFile;

namespace {

const double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Two quads that share an edge, with a segment node, far from zero.
Scene two_quads(const Vec3& offset = Vec3(1e5, -2e5, 3e4)) {
  ScenePrimitive quads;
  quads.positions = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0.1}, {0, 1, 0}, {1, 1, 0}, {2, 1, 0.1}};
  for (Vec3& p : quads.positions) p += offset;
  quads.normals.assign(6, Vec3::UnitZ());
  for (const double q : {-0.5, 0.0, 0.25, 0.5, 0.75, 1.0}) quads.colors.push_back(quality_color(q));
  quads.attributes = {{"_SCALED_JACOBIAN", {-0.5, 0.0, 0.25, 0.5, 0.75, 1.0}}};
  quads.indices = {0, 1, 4, 0, 4, 3, 1, 2, 5, 1, 5, 4};
  ScenePrimitive lines{.topology = ScenePrimitive::Topology::lines,
                       .positions = quads.positions,
                       .indices = {0, 1, 1, 2},
                       .material_color = {0, 0, 0, 1}};
  return {.name = "two quads",
          .nodes = {{"surface", quads}, {"wireframe", lines}},
          .origin = offset + Vec3(1, 0.5, 0.05),
          .meters_per_unit = 0.001,
          .extras = {{"source", std::string("quads.mesh")}, {"color_map", std::string(kQualityColorMap)}},
          .options = {{"levels", 3.0}, {"tolerance", 0.005}, {"cage_only", false}}};
}

std::filesystem::path scratch(const std::string& name) {
  const auto folder = std::filesystem::temp_directory_path() / "subvol_gltf_writer_test";
  std::filesystem::create_directories(folder);
  return folder / name;
}

std::string slurp(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream out;
  out << in.rdbuf();
  return out.str();
}

}  // namespace

TEST_CASE("a .glb read back holds the scene's numbers in single precision") {
  const Scene scene = two_quads();
  const GlbFile file(gltf_bytes(scene, GltfContainer::glb));
  const auto positions = file.attribute<float>("surface", "POSITION");
  const ScenePrimitive& surface = scene.nodes[0].primitive;
  REQUIRE(positions.size() == 3 * surface.positions.size());
  for (std::size_t v = 0; v < surface.positions.size(); ++v)
    for (int k = 0; k < 3; ++k)
      CHECK(positions[3 * v + k] == static_cast<float>(surface.positions[v][k] - scene.origin[k]));
  const auto quality = file.attribute<float>("surface", "_SCALED_JACOBIAN");
  CHECK(quality == std::vector<float>{-0.5f, 0.0f, 0.25f, 0.5f, 0.75f, 1.0f});
  const auto indices = file.indices("surface");
  CHECK(std::vector<Index>(indices.begin(), indices.end()) == surface.indices);
  CHECK(file.primitive("surface").at("mode") == 4);
  CHECK(file.primitive("wireframe").at("mode") == 1);
  CHECK(file.indices("wireframe").size() == 4);
}

TEST_CASE("min and max of positions are the exact float32 extremes") {
  const GlbFile file(gltf_bytes(two_quads(Vec3(0.1, 0.2, 0.3)), GltfContainer::glb));
  const auto positions = file.attribute<float>("surface", "POSITION");
  const auto& accessor = file.json["accessors"][file.primitive("surface")["attributes"]["POSITION"].get<int>()];
  for (int k = 0; k < 3; ++k) {
    float low = positions[k], high = positions[k];
    for (std::size_t i = k; i < positions.size(); i += 3)
      low = std::min(low, positions[i]), high = std::max(high, positions[i]);
    CHECK(accessor["min"][k].get<double>() == static_cast<double>(low));
    CHECK(accessor["max"][k].get<double>() == static_cast<double>(high));
  }
}

TEST_CASE("the root node carries scale, place and extras, and the asset the generator") {
  const Scene scene = two_quads();
  const GlbFile file(gltf_bytes(scene, GltfContainer::glb));
  const auto& root = file.json["nodes"][file.json["scenes"][0]["nodes"][0].get<int>()];
  CHECK(root["name"] == "two quads");
  for (int k = 0; k < 3; ++k) {
    CHECK(root["scale"][k] == 0.001);
    CHECK(root["translation"][k].get<double>() == Approx(0.001 * scene.origin[k]).epsilon(1e-15));
  }
  CHECK(file.json["asset"]["generator"] == std::string("subvol ") + version());
  CHECK(root["extras"] == file.json["asset"]["extras"]);
  CHECK(root["extras"]["unit"] == "meter");
  CHECK(root["extras"]["meters_per_input_unit"] == 0.001);
  CHECK(root["extras"]["up_axis"] == "y");
  CHECK(root["extras"]["source"] == "quads.mesh");
  CHECK(root["extras"]["version"] == version());
  CHECK(root["extras"]["options"]["levels"] == 3);
  CHECK(root["extras"]["options"]["tolerance"] == 0.005);
  CHECK(root["extras"]["options"]["cage_only"] == false);
}

TEST_CASE("z up is turned into y up by the root node") {
  Scene scene = two_quads();
  scene.up_axis = UpAxis::z;
  const GlbFile file(gltf_bytes(scene, GltfContainer::glb));
  const auto& root = file.json["nodes"][0];
  const Eigen::Quaterniond turn(root["rotation"][3].get<double>(), root["rotation"][0].get<double>(),
                                root["rotation"][1].get<double>(), root["rotation"][2].get<double>());
  const double kRounding = 1e-12;
  CHECK((turn * Vec3::UnitZ() - Vec3::UnitY()).norm() < kRounding);
  const Vec3 translation(root["translation"][0], root["translation"][1], root["translation"][2]);
  CHECK((translation - turn * (0.001 * scene.origin)).norm() < kRounding * scene.origin.norm());
}

TEST_CASE("colors are linear, normalized and the same for equal quality") {
  const GlbFile file(gltf_bytes(two_quads(), GltfContainer::glb));
  const auto words = file.attribute<std::uint16_t>("surface", "COLOR_0");
  REQUIRE(words.size() == 24);
  CHECK(std::equal(words.begin(), words.begin() + 4, words.begin() + 4));  // -0.5 and 0 are both "inverted"
  CHECK(words[3] == 65535);
  const LinearColor best = quality_color(1.0);
  CHECK(words[20] == std::lround(best[0] * 65535));
  const auto& accessor = file.json["accessors"][file.primitive("surface")["attributes"]["COLOR_0"].get<int>()];
  CHECK(accessor["normalized"] == true);
}

TEST_CASE("lightness of the quality colors rises with quality") {
  const auto luminance = [](double q) {
    const LinearColor c = quality_color(q);
    return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
  };
  for (int i = 1; i < 100; ++i) CHECK(luminance(0.01 * (i + 1)) > luminance(0.01 * i));
  CHECK(quality_color(kNaN) == quality_color(-1.0));
  CHECK(quality_color(2.0) == quality_color(1.0));
}

TEST_CASE("indices are 16 bits wide up to 65535 vertices and 32 bits beyond") {
  for (const std::size_t n : {std::size_t{65535}, std::size_t{65536}}) {
    Scene scene = two_quads();
    scene.nodes.resize(1);
    ScenePrimitive& surface = scene.nodes[0].primitive;
    surface.positions.resize(n, surface.positions[0]);
    surface.normals.resize(n, Vec3::UnitX());
    surface.colors.clear();
    surface.attributes.clear();
    surface.indices.insert(surface.indices.end(), {0, 1, static_cast<Index>(n - 1)});
    const GlbFile file(gltf_bytes(scene, GltfContainer::glb));
    CHECK(file.json["accessors"][file.primitive("surface")["indices"].get<int>()]["componentType"] ==
          (n == 65535 ? 5123 : 5125));
    CHECK(file.indices("surface").back() == n - 1);
  }
}

TEST_CASE("equal scenes give equal bytes") {
  for (const auto container : {GltfContainer::glb, GltfContainer::gltf})
    CHECK(gltf_bytes(two_quads(), container) == gltf_bytes(two_quads(), container));
}

TEST_CASE("a scene that cannot be written is refused with the name of the node and the array") {
  using Catch::Matchers::Contains;
  const auto refusal = [](auto spoil) {
    Scene scene = two_quads();
    spoil(scene, scene.nodes[0].primitive);
    try {
      gltf_bytes(scene, GltfContainer::glb);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  using P = ScenePrimitive;
  CHECK_THAT(refusal([](Scene& s, P&) { s.nodes.clear(); }), Contains("at least one node"));
  CHECK_THAT(refusal([](Scene&, P& p) { p.positions.clear(); }), Contains("\"surface\": positions"));
  CHECK_THAT(refusal([](Scene&, P& p) { p.positions[3].y() = kNaN; }), Contains("\"surface\": positions"));
  CHECK_THAT(refusal([](Scene&, P& p) { p.positions[3].y() = 1e39; }), Contains("float32"));
  CHECK_THAT(refusal([](Scene&, P& p) { p.normals[2] = Vec3(1, 1, 0); }), Contains("normals: expected length 1"));
  CHECK_THAT(refusal([](Scene&, P& p) { p.normals[2].x() = kNaN; }), Contains("normals"));
  CHECK_THAT(refusal([](Scene&, P& p) { p.normals.pop_back(); }), Contains("normals: expected 6 entries"));
  CHECK_THAT(refusal([](Scene&, P& p) { p.colors[0][1] = 1.5; }), Contains("colors"));
  CHECK_THAT(refusal([](Scene&, P& p) { p.colors[0][1] = kNaN; }), Contains("colors"));
  CHECK_THAT(refusal([](Scene&, P& p) { p.attributes[0].values[1] = kNaN; }), Contains("_SCALED_JACOBIAN"));
  CHECK_THAT(refusal([](Scene&, P& p) { p.attributes[0].values.pop_back(); }), Contains("_SCALED_JACOBIAN"));
  CHECK_THAT(refusal([](Scene&, P& p) { p.attributes[0].name = "quality"; }), Contains("underscore"));
  CHECK_THAT(refusal([](Scene&, P& p) { p.indices.clear(); }), Contains("multiple of 3"));
  CHECK_THAT(refusal([](Scene&, P& p) { p.indices.pop_back(); }), Contains("multiple of 3"));
  CHECK_THAT(refusal([](Scene&, P& p) { p.indices[4] = 6; }), Contains("from 0 to 5, got 6"));
  CHECK_THAT(refusal([](Scene&, P& p) { p.indices[4] = -1; }), Contains("got -1"));
  CHECK_THAT(refusal([](Scene&, P& p) { p.material_color[0] = -1; }), Contains("material_color"));
  CHECK_THAT(refusal([](Scene& s, P&) { s.meters_per_unit = 0; }), Contains("meters_per_unit"));
  CHECK_THAT(refusal([](Scene& s, P&) { s.origin.x() = kNaN; }), Contains("origin"));
  CHECK_THAT(refusal([](Scene& s, P&) { s.options[1].second = kNaN; }), Contains("tolerance"));
  CHECK_THAT(refusal([](Scene& s, P&) { s.name = "\xff"; }), Contains("UTF-8"));
  CHECK_THROWS_AS(write_gltf("scene.stl", two_quads()), InputError);
  CHECK_THROWS_AS(write_gltf(scratch("no_such_folder") / "a.glb", two_quads()), IoError);
}

TEST_CASE("a scene beyond single precision is refused, quantized or not") {
  for (const bool quantize : {false, true})
    for (const double size : {5e38, 1e-38}) {
      Scene scene = two_quads();
      scene.quantize = quantize;
      scene.origin = Vec3::Zero();
      for (SceneNode& node : scene.nodes)
        for (Vec3& p : node.primitive.positions) p *= size;
      CAPTURE(quantize, size);
      CHECK_THROWS_WITH(gltf_bytes(scene, GltfContainer::glb), Catch::Matchers::Contains("float32"));
    }
  Scene scene = two_quads();
  scene.origin = Vec3(1e30, 0, 0);
  scene.meters_per_unit = 1e10;
  CHECK_THROWS_WITH(gltf_bytes(scene, GltfContainer::glb), Catch::Matchers::Contains("float32"));
}

TEST_CASE("the Khronos validator has nothing to say about the files") {
  const auto glb = scratch("scene.glb"), text = scratch("scene.gltf"), turned = scratch("turned.glb");
  Scene scene = two_quads();
  write_gltf(glb, scene);
  write_gltf(text, scene);
  scene.up_axis = UpAxis::z;
  scene.nodes[0].primitive.colors.clear();
  write_gltf(turned, scene);
  CHECK(slurp(glb) == gltf_bytes(two_quads(), GltfContainer::glb));
  const auto curved = scratch("curved.glb");
  PointSource source(1);
  HighOrderMesh mesh(ElementSpace(mixed_cells(), Basis::fourier, 3), mixed_cells());
  for (std::size_t i = mesh.space.num_vertices(); i < mesh.coefficients.size(); ++i)
    mesh.coefficients[i] = 0.1 * source.vector();
  write_gltf(curved, surface_scene(mesh, std::vector<double>{0.1, 0.4, 0.7, 1}, {.max_chord_percent = 0.1}));
  check_with_validator({glb, text, turned, curved});
}

TEST_CASE("shapes become morph targets that an animation goes through to the scene itself") {
  Scene scene = two_quads(Vec3(0.5, 0.25, -2));
  const ScenePrimitive& surface = scene.nodes[0].primitive;
  for (const double lift : {2.0, 1.0}) {
    SceneShape shape{"lifted by " + std::to_string(static_cast<int>(lift)), surface.positions, surface.normals};
    for (Vec3& p : shape.positions) p.z() += lift;
    scene.nodes[0].shapes.push_back(std::move(shape));
  }
  scene.nodes[0].shapes[0].normals.assign(6, Vec3::UnitX());
  scene.seconds_per_shape = 0.25;
  const GlbFile file(gltf_bytes(scene, GltfContainer::glb));
  const auto targets = file.primitive("surface").at("targets");
  REQUIRE(targets.size() == 2);
  const auto rise = file.numbers<float>(targets[0].at("POSITION"));
  for (std::size_t i = 0; i < rise.size(); ++i) CHECK(rise[i] == (i % 3 == 2 ? 2.0F : 0.0F));
  const auto turn = file.numbers<float>(targets[0].at("NORMAL"));
  for (std::size_t i = 0; i < turn.size(); ++i) CHECK(turn[i] == (i % 3 == 2 ? -1.0F : i % 3 == 0 ? 1.0F : 0.0F));
  CHECK(!file.primitive("wireframe").contains("targets"));
  const auto& mesh = file.json["meshes"][0];
  CHECK(mesh["extras"]["targetNames"] == nlohmann::json({"lifted by 2", "lifted by 1"}));
  CHECK(mesh["weights"] == nlohmann::json({0.0, 0.0}));
  REQUIRE(file.json["animations"].size() == 1);
  const auto& sampler = file.json["animations"][0]["samplers"][0];
  CHECK(file.numbers<float>(sampler["input"]) == std::vector<float>{0, 0.25, 0.5});
  CHECK(file.numbers<float>(sampler["output"]) == std::vector<float>{1, 0, 0, 1, 0, 0});
  CHECK(file.json["animations"][0]["channels"][0]["target"]["path"] == "weights");

  const auto path = scratch("shapes.glb");
  write_gltf(path, scene);
  check_with_validator({path});

  const auto refused = [&](auto spoil) {
    Scene bad = scene;
    spoil(bad);
    CHECK_THROWS_AS(gltf_bytes(bad, GltfContainer::glb), InputError);
  };
  refused([](Scene& s) { s.nodes[0].shapes[1].positions.pop_back(); });
  refused([](Scene& s) { s.nodes[0].shapes[1].normals.clear(); });
  refused([](Scene& s) { s.nodes[1].shapes = {{"line", s.nodes[1].primitive.positions}}; });
  refused([](Scene& s) { s.seconds_per_shape = 0; });
  refused([](Scene& s) { s.seconds_per_shape = 1e-60; });  // in float32 all at the same time
  refused([](Scene& s) { s.seconds_per_shape = 3e38; });
}

TEST_CASE("times of an animation start at 0 and rise, whatever the shapes are", "[slow]") {
  Scene scene = two_quads();
  const ScenePrimitive& surface = scene.nodes[0].primitive;
  for (std::size_t num_shapes = 1; num_shapes <= 3; ++num_shapes) {
    scene.nodes[0].shapes.push_back({"as it is", surface.positions, surface.normals});  // all of them the same
    scene.seconds_per_shape = 0.1;
    const GlbFile file(gltf_bytes(scene, GltfContainer::glb));
    const auto& sampler = file.json["animations"][0]["samplers"][0];
    const auto times = file.numbers<float>(sampler["input"]);
    REQUIRE(times.size() == num_shapes + 1);
    CHECK(times[0] == 0);
    for (std::size_t k = 0; k < num_shapes; ++k) CHECK(times[k] < times[k + 1]);
    const auto& accessor = file.json["accessors"][sampler["input"].get<int>()];
    CHECK(accessor["min"] == nlohmann::json::array({0}));
    CHECK(accessor["max"][0].get<float>() == times.back());
    CHECK(file.numbers<float>(sampler["output"]).size() == times.size() * num_shapes);
    const auto path = scratch("same.glb");
    write_gltf(path, scene);
    check_with_validator({path});
  }
  scene.nodes[0].shapes.clear();
  CHECK(!GlbFile(gltf_bytes(scene, GltfContainer::glb)).json.contains("animations"));
}

TEST_CASE("a quantized scene is within half a step of the scene, in fewer bytes") {
  Scene scene = two_quads();
  scene.origin.x() += 0.5;
  const std::string exact = gltf_bytes(scene, GltfContainer::glb);
  scene.quantize = true;
  const std::string bytes = gltf_bytes(scene, GltfContainer::glb);
  CHECK(bytes.size() < exact.size() + 400);  // what the JSON grows by
  const GlbFile file(bytes);
  CHECK(file.json["extensionsRequired"] == nlohmann::json({"KHR_mesh_quantization"}));
  CHECK(file.binary.size() < GlbFile(exact).binary.size());
  const auto& accessor = file.json["accessors"][file.primitive("surface")["attributes"]["POSITION"].get<int>()];
  const auto& view = file.json["bufferViews"][accessor["bufferView"].get<int>()];
  CHECK(accessor["componentType"] == 5122);
  CHECK(accessor["normalized"] == true);
  REQUIRE(view["byteStride"] == 8);
  const double unit = file.json.at("nodes").at(1).at("scale").at(0);
  CHECK(unit == Approx(1.5));
  const ScenePrimitive& surface = scene.nodes[0].primitive;
  for (std::size_t v = 0; v < surface.positions.size(); ++v) {
    std::array<std::int16_t, 3> q;
    std::memcpy(q.data(), file.binary.data() + view.value("byteOffset", std::size_t{0}) + 8 * v, sizeof q);
    const Vec3 found = unit / 32767 * Vec3(q[0], q[1], q[2]);
    CHECK((found - (surface.positions[v] - scene.origin)).cwiseAbs().maxCoeff() <= 0.5 * unit / 32767 * (1 + 1e-6));
  }
  const auto path = scratch("quantized.glb");
  write_gltf(path, scene);
  check_with_validator({path});
}
