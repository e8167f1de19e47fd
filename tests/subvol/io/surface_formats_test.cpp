// SPDX-License-Identifier: GPL-3.0-or-later
// Surfaces of .vtp, .3mf, .glb, .gltf, .msh and .inp, and the surfaces that we write.

#include "subvol/base/error.h"
#include "subvol/export/export.h"
#include "subvol/export/gltf_writer.h"
#include "subvol/export/read_back.h"
#include "subvol/export/surface_writer.h"
#include "subvol/io/mesh_io.h"
#include "subvol/io/surface_io.h"
#include "subvol/io/zip_archive.h"
#include "subvol/surface/boundary.h"
#include "tests/support/grouped_meshes.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/temporary_folder.h"

#include <catch2/catch.hpp>

#include <map>

#include <sys/stat.h>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;
using Catch::Contains;
using namespace std::string_literals;

namespace {

const TemporaryFolder& format_folder() {
  static const TemporaryFolder kFolder;
  return kFolder;
}

PolygonMesh grouped_surface() {
  const VolumeMesh mesh = with_floor_and_roof(lattice(2, 1, 1), 1);
  return boundary_surface(mesh, MeshTopology(mesh));
}

/// Area of the faces of each name; faces of no group have none.
std::map<std::string, double> areas(const PolygonMesh& mesh) {
  std::map<std::string, double> result;
  const TriangleMesh triangles = triangulate(mesh);
  for (std::size_t t = 0; t < triangles.triangles.size(); ++t) {
    const auto x = [&](int k) -> const Vec3& { return triangles.positions[triangles.triangles[t][k]]; };
    const Index group = triangles.face_groups.empty() ? kNoIndex : triangles.face_groups.of_face[t];
    result[group == kNoIndex ? "" : label_of(triangles.face_groups.groups[group])] +=
        (x(1) - x(0)).cross(x(2) - x(0)).norm() / 2;
  }
  return result;
}

std::string format_refusal(const std::string& name, std::string_view bytes) {
  try {
    read_polygon_mesh(format_folder().file(name, bytes));
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

/// Reads a surface and returns its warnings, one line each.
std::string warnings_of(const std::string& name, std::string_view bytes, PolygonMesh* mesh = nullptr) {
  std::vector<std::string> warnings;
  PolygonMesh found = read_polygon_mesh(format_folder().file(name, bytes), &warnings);
  if (mesh) *mesh = std::move(found);
  std::string text;
  for (const std::string& warning : warnings) text += warning + "\n";
  return text;
}

/// Volume that a closed surface encloses; negative if its normals point inward.
double signed_volume(const PolygonMesh& mesh) {
  const TriangleMesh triangles = triangulate(mesh);
  double volume = 0;
  for (const auto& t : triangles.triangles)
    volume += triangles.positions[t[0]].dot(triangles.positions[t[1]].cross(triangles.positions[t[2]])) / 6;
  return volume;
}

std::string with_part_replaced(std::string text, const std::string& from, const std::string& to) {
  REQUIRE(text.find(from) != std::string::npos);
  return text.replace(text.find(from), from.size(), to);
}

/// An archive of models by their paths.
std::string models_archive(const std::map<std::string, std::string>& models) {
  ZipWriter zip;
  for (const auto& [path, model] : models) zip.add(path, model);
  return zip.take();
}

/// A tetrahedron of volume 1/6 as an object of a .3mf.
std::string tet_object(const std::string& id, const std::string& attributes = "", const std::string& of_first = "") {
  return "<object id=\"" + id + "\" " + attributes +
         "><mesh><vertices><vertex x=\"0\" y=\"0\" z=\"0\"/><vertex x=\"1\" y=\"0\" z=\"0\"/>"
         "<vertex x=\"0\" y=\"1\" z=\"0\"/><vertex x=\"0\" y=\"0\" z=\"1\"/></vertices><triangles>"
         "<triangle v1=\"0\" v2=\"2\" v3=\"1\" " +
         of_first +
         "/><triangle v1=\"0\" v2=\"1\" v3=\"3\"/>"
         "<triangle v1=\"1\" v2=\"2\" v3=\"3\"/><triangle v1=\"2\" v2=\"0\" v3=\"3\"/></triangles></mesh></object>";
}

std::string model_of(const std::string& resources, const std::string& build, const std::string& attributes = "") {
  return "<model " + attributes + "><resources>" + resources + "</resources><build>" + build + "</build></model>";
}

}  // namespace

TEST_CASE("surface formats: surfaces that are written come back with their groups", "[io]") {
  PolygonMesh surface = grouped_surface();
  surface.face_groups.groups[0].name = "in & \"out\" <1>";
  const std::map<std::string, double> wanted = areas(surface);
  for (const std::string extension : {".stl", ".ply", ".vtp", ".3mf"}) {
    CAPTURE(extension);
    const auto path = format_folder().path() / ("a" + extension);
    write_surface(path, surface);
    CHECK_NOTHROW(require_written(path, surface));
    std::vector<std::string> warnings;
    const PolygonMesh found = read_polygon_mesh(path, &warnings);
    CHECK(warnings.empty());
    CHECK(found.positions.size() == surface.positions.size());
    auto names = areas(found);
    if (extension == ".stl") names[""] = std::exchange(names["none"], 0), names.erase("none");
    if (extension == ".ply") {
      CHECK(names.at("group 1") == Approx(wanted.at("in & \"out\" <1>")));
      CHECK(names.at("group 2") == Approx(wanted.at("roof")));
      continue;
    }
    REQUIRE(names.size() == wanted.size());
    for (const auto& [name, area] : wanted) CHECK(names.at(name) == Approx(area));
    PolygonMesh other = surface;
    other.positions[0][0] += 1;
    CHECK_THROWS_AS(require_written(path, other), IoError);
  }
  surface.face_groups = {};
  for (const std::string extension : {".stl", ".ply", ".vtp", ".3mf"}) {
    write_surface(format_folder().path() / ("b" + extension), surface);
    const PolygonMesh found = read_polygon_mesh(format_folder().path() / ("b" + extension));
    CHECK(found.face_groups.empty());
    CHECK(areas(found).at("") == Approx(10));
  }
  CHECK_THROWS_AS(surface_bytes(".obj", surface), InputError);
  surface.face_vertices[0] = 99;
  CHECK_THROWS_AS(surface_bytes(".stl", surface), InputError);
}

TEST_CASE("surface formats: glTF is read in place, without its lines, with materials as groups", "[io]") {
  const VolumeMesh mesh = with_floor_and_roof(lattice(2, 1, 1), 1);
  for (const char* name : {"a.glb", "a.gltf"})
    for (const bool quantize : {false, true}) {
      CAPTURE(name, quantize);
      SurfaceSceneOptions options;
      options.up_axis = UpAxis::y;
      options.quantize = quantize;
      write_gltf(format_folder() / name, boundary_scene(mesh, options));
      const PolygonMesh found = read_polygon_mesh(format_folder() / name);
      CHECK(found.positions.size() == 12);
      const auto names = areas(found);
      CHECK(names.at("floor") == Approx(2).epsilon(1e-3));
      CHECK(names.at("roof") == Approx(2).epsilon(1e-3));
      Vec3 low = found.positions[0], high = low;
      for (const Vec3& x : found.positions) low = low.cwiseMin(x), high = high.cwiseMax(x);
      CHECK((low - Vec3(0, 0, 0)).norm() < 1e-3);
      CHECK((high - Vec3(2, 1, 1)).norm() < 1e-3);
    }
  const std::string glb = content_of(format_folder() / "a.glb");
  for (std::size_t size = 0; size < glb.size(); size += 1 + glb.size() / 60)
    CHECK_FALSE(format_refusal("cut.glb", std::string_view(glb).substr(0, size)).empty());
  CHECK_THAT(format_refusal("a.gltf", R"({"asset":{"version":"2.0"},"extensionsRequired":["KHR_draco_mesh_compression"],
    "extensionsUsed":["KHR_draco_mesh_compression"]})"),
             Contains("KHR_draco_mesh_compression"));
  CHECK_THAT(
      format_refusal("b.gltf", R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"children":[0]}]})"),
      Contains("children of themselves"));
}

TEST_CASE("surface formats: glTF of a tetrahedron: mirrors, sparse accessors, and what is not read", "[io][quick]") {
  std::string bytes;
  const auto append = [&](auto... values) {
    const auto one = [&](auto value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof value); };
    (one(values), ...);
  };
  append(0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f);                              // byte 0: positions
  for (const int v : {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3}) append(static_cast<std::uint16_t>(v));  // byte 48
  append(std::uint16_t{3}, std::uint16_t{0}, 0.f, 0.f, 2.f);  // byte 72: vertex 3 moves to (0, 0, 2)
  format_folder().file("tet.bin", bytes);
  const std::string text = R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},
{"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}],
"bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":24},
{"buffer":0,"byteOffset":72,"byteLength":4},{"buffer":0,"byteOffset":76,"byteLength":12}],
"buffers":[{"uri":"tet.bin","byteLength":88}]})";
  const auto changed = [&](const std::string& from, const std::string& to) {
    return with_part_replaced(text, from, to);
  };
  PolygonMesh found;
  CHECK(warnings_of("t.gltf", text, &found).empty());
  CHECK(signed_volume(found) == Approx(1.0 / 6));
  warnings_of("t.gltf", changed(R"({"mesh":0})", R"({"mesh":0,"scale":[-2,1,1]})"), &found);
  CHECK(signed_volume(found) == Approx(1.0 / 3));
  const std::string
      positions = R"("count":4,"type":"VEC3")",
      sparse = positions +
               R"(,"sparse":{"count":1,"indices":{"bufferView":2,"componentType":5123},"values":{"bufferView":3}})";
  warnings_of("t.gltf", changed(positions, sparse), &found);
  CHECK(signed_volume(found) == Approx(1.0 / 3));
  const std::string of_no_vertex = R"("byteOffset":86,"byteLength":2)";  // vertex 16384
  CHECK_THAT(format_refusal("t.gltf", with_part_replaced(changed(positions, sparse),
                                                         R"("byteOffset":72,"byteLength":4)", of_no_vertex)),
             Contains("replaces an entry that does not exist"));
  CHECK_THAT(warnings_of("t.gltf", changed(R"("POSITION":0)", R"("POSITION":0,"TEXCOORD_0":0,"COLOR_0":0,"_HEAT":0)")),
             Contains("4 colors of vertices, 4 texture coordinates, 4 attributes of vertices"));
  CHECK_THAT(warnings_of("t.gltf", changed(R"("meshes":[{)", R"("meshes":[{"weights":[0,0.5],)")),
             Contains("1 weights of morph targets"));
  CHECK_THAT(warnings_of("t.gltf", changed(R"({"mesh":0})", R"({"mesh":0,"skin":0})")), Contains("1 skins"));
  CHECK_THAT(warnings_of("t.gltf", changed(R"("primitives":[{"attributes")",
                                           R"("primitives":[{"mode":1,"attributes":{"POSITION":0}}]},
{"primitives":[{"attributes")")
                                       .replace(text.find(R"({"mesh":0})"), 10, R"({"mesh":1})")),
             Contains("1 meshes outside the scene"));
  const std::string version1 = changed(R"("2.0")", R"("1.0")"), lines = changed(R"("indices":1)", R"("mode":1)");
  CHECK_THAT(format_refusal("t.gltf", version1), Contains("glTF 1.0 is not read"));
  CHECK_THAT(format_refusal("t.gltf", lines), Contains("no faces") && Contains("1 primitives of points or lines"));
  const auto requiring = [&](const std::string& extension) {
    return changed(R"("scenes")", "\"extensionsUsed\":[\"" + extension + "\"],\"extensionsRequired\":[\"" + extension +
                                      "\"],\"scenes\"");
  };
  CHECK(warnings_of("t.gltf", requiring("KHR_techniques_webgl")).empty());
  const std::string compressed =
      with_part_replaced(requiring("KHR_draco_mesh_compression"), R"({"bufferView":1,)", "{");
  CHECK_THAT(format_refusal("t.gltf", compressed),
             Contains("KHR_draco_mesh_compression") && Contains("save the file without compression"));
}

TEST_CASE("surface formats: glTF that names pipes, repeats itself or is nested too deeply is refused", "[io][quick]") {
  const std::string head = R"({"asset":{"version":"2.0"},)";
  ::mkfifo((format_folder() / "pipe.bin").c_str(), 0600);
  for (const auto& [uri, why] :
       std::map<std::string, std::string>{{"pipe.bin", "is a pipe"}, {".", "is a folder"}, {"none.bin", "not found"}})
    CHECK_THAT(format_refusal("t.gltf", head + R"("buffers":[{"uri":")" + uri + R"(","byteLength":36}]})"),
               Contains(why));
  const auto list = [](const std::string& entry, std::size_t times) {
    std::string text = entry;
    for (std::size_t i = 1; i < times; ++i) text += "," + entry;
    return "[" + text + "]";
  };
  const std::string deep = head + R"("extras":)" + std::string(600, '[') + std::string(600, ']') + "}";
  CHECK_THAT(format_refusal("t.gltf", deep), Contains("500 deep"));
  CHECK_THAT(format_refusal("t.glb", std::string("glTF\2\0\0\0\0\0\0\0\xff\xff\xff\xffJSON", 20) + deep),
             Contains("500 deep"));
  const std::string shallow = head + R"("extras":"\"[)" + std::string(600, '[') + "\"}";
  CHECK_THAT(format_refusal("t.gltf", shallow), Contains("no faces"));
  const std::string weights = R"("meshes":[{"primitives":[],"weights":)" + list("0", 100000) + "}],";
  CHECK_THAT(format_refusal("t.gltf", head + weights + "\"nodes\":" + list("{\"mesh\":0}", 400) + "}"),
             Contains("repeat meshes"));
  // The time is not quadratic in the number of nodes.
  CHECK_THAT(format_refusal("t.gltf", head + "\"nodes\":" + list("{}", 50000) + "}"), Contains("no faces"));
}

/// Returns an archive of one file as ZIP64: all sizes and places stand in fields of 64 bits.
std::string as_zip64(const std::string& archive) {
  const std::size_t directory = archive.find("PK\1\2"), end = archive.find("PK\5\6");
  const auto number = [](std::size_t value, std::size_t size) {
    std::string bytes;
    for (std::size_t i = 0; i < size; ++i) bytes += static_cast<char>(value >> (8 * i) & 255);
    return bytes;
  };
  const auto value_at = [&](std::size_t at) {
    std::size_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) value |= std::size_t(static_cast<unsigned char>(archive[at + i])) << (8 * i);
    return value;
  };
  const std::string unused(4, '\xff'), other_field = number(7, 2) + number(1, 2) + "x";
  const std::string extra = other_field + number(1, 2) + number(24, 2) + number(value_at(directory + 24), 8) +
                            number(value_at(directory + 20), 8) + number(0, 8);
  std::string entry = archive.substr(directory, end - directory);
  entry.replace(20, 8, unused + unused).replace(30, 2, number(extra.size(), 2)).replace(42, 4, unused);
  const std::string record =
      "PK\6\6" + std::string(28, '\0') + number(1, 8) + std::string(8, '\0') + number(directory, 8);
  return archive.substr(0, directory) + entry + extra + record + "PK\6\7" + std::string(4, '\0') +
         number(directory + entry.size() + extra.size(), 8) + std::string(4, '\0') +
         archive.substr(end).replace(10, 2, "\xff\xff").replace(16, 4, unused);
}

TEST_CASE("surface formats: COLLADA is read in place, with materials as groups", "[io]") {
  if (!has_assimp()) return;
  const std::string text = R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="meter" meter="1"/><up_axis>Y_UP</up_axis></asset>
<library_effects><effect id="e"><profile_COMMON><technique sid="c"><lambert/></technique></profile_COMMON></effect>
</library_effects>
<library_materials><material id="m1" name="floor"><instance_effect url="#e"/></material>
<material id="m2" name="roof"><instance_effect url="#e"/></material></library_materials>
<library_geometries><geometry id="g" name="box"><mesh>
<source id="p"><float_array id="pa" count="24">0 0 0 2 0 0 2 1 0 0 1 0 0 0 1 2 0 1 2 1 1 0 1 1</float_array>
<technique_common><accessor source="#pa" count="8" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<polylist material="a" count="2"><input semantic="VERTEX" source="#v" offset="0"/><vcount>4 4</vcount>
<p>0 3 2 1 0 1 5 4</p></polylist>
<polylist material="b" count="4"><input semantic="VERTEX" source="#v" offset="0"/><vcount>4 4 4 4</vcount>
<p>4 5 6 7 1 2 6 5 2 3 7 6 3 0 4 7</p></polylist></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n"><translate>10 0 0</translate><instance_geometry url="#g">
<bind_material><technique_common><instance_material symbol="a" target="#m1"/>
<instance_material symbol="b" target="#m2"/></technique_common></bind_material></instance_geometry></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>)";
  const PolygonMesh mesh = read_polygon_mesh(format_folder().file("box.dae", text));
  CHECK(mesh.num_faces() == 6);
  CHECK(mesh.face_vertices.size() == 24);  // quads
  REQUIRE(mesh.positions.size() == 8);
  for (const Vec3& p : mesh.positions) CHECK((p.x() == 10 || p.x() == 12));
  const std::map<std::string, double> found = areas(mesh);
  CHECK(found.at("floor") == Approx(4));
  CHECK(found.at("roof") == Approx(6));
  CHECK(signed_volume(mesh) == Approx(2));
  const std::string mirrored = with_part_replaced(text, "<translate>10 0 0</translate>", "<scale>-1 1 1</scale>");
  CHECK(signed_volume(read_polygon_mesh(format_folder().file("mirror.dae", mirrored))) == Approx(2));
  const std::string node = text.substr(text.find("<node"), text.find("</node>") + 7 - text.find("<node"));
  const std::string second = with_part_replaced(with_part_replaced(node, "\"n\"", "\"twin\""), "10 0 0", "0 0 5");
  PolygonMesh both;  // each node has both materials
  CHECK_THAT(warnings_of("two.dae", with_part_replaced(text, node, node + second), &both),
             Contains("2 names of objects"));
  CHECK(signed_volume(both) == Approx(4));
  CHECK(warnings_of("names.dae",
                    with_part_replaced(with_part_replaced(with_part_replaced(text, node, node + second), "#m2", "#m1"),
                                       "#m2", "#m1"),
                    &both)
            .empty());
  CHECK(areas(both) == std::map<std::string, double>{{"n", 10}, {"twin", 10}});
  CHECK_THAT(format_refusal("empty.dae", with_part_replaced(text, node, R"(<node id="n"><node id="m"/></node>)")),
             Contains("no faces"));
  const std::string colored =
      with_part_replaced(text, "<lambert/>", "<lambert><diffuse><color>  1 0 0 1 </color></diffuse></lambert>");
  CHECK(read_polygon_mesh(format_folder().file("color.dae", colored)).num_faces() == 6);
  CHECK_THAT(format_refusal("word.dae", with_part_replaced(text, "<p>0 3 2 1", "<p>0 3 x2 1")),
             Contains("expected whole numbers in <p>, found 'x2'"));
  CHECK_THAT(format_refusal("word.dae", with_part_replaced(text, "<vcount>4 4<", "<vcount>4 .5<")),
             Contains("expected whole numbers in <vcount>"));
  std::string wide = "\xFF\xFE";
  for (const char c : text) wide += {c, '\0'};
  CHECK_THAT(format_refusal("wide.dae", wide), Contains("UTF-16"));
  CHECK_THROWS_WITH(read_polygon_mesh(format_folder().file("cut.dae", text.substr(0, 900))), Contains("cut.dae"));
  CHECK_THROWS_WITH(read_polygon_mesh(format_folder().file("no.fbx", "; FBX 7.4.0\n")), Contains("no.fbx"));
}

TEST_CASE("surface formats: objects of a .3mf stand where the build has them", "[io]") {
  const std::string model = R"(<?xml version="1.0"?><model unit="millimeter" xmlns="x"><resources>
<basematerials id="9"><base name="steel" displaycolor="#FFF"/><base name="brass" displaycolor="#000"/></basematerials>
<object id="1" name="one"><mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="1" y="0" z="0"/>
<vertex x="0" y="1" z="0"/></vertices><triangles><triangle v1="0" v2="1" v3="2"/></triangles></mesh></object>
<object id="2" name="two"><components><component objectid="1" transform="2 0 0 0 2 0 0 0 2 5 6 7"/></components></object>
</resources><build><item objectid="1"/><item objectid="2" transform="1 0 0 0 1 0 0 0 1 0 0 1"/></build></model>)";
  const auto archive = [&](const std::string& from, const std::string& to) {
    std::string text = model;
    ZipWriter zip;
    zip.add("3D/part.model", text.replace(text.find(from), from.size(), to));
    return zip.take();
  };
  const PolygonMesh found = read_polygon_mesh(format_folder().file("a.3mf", archive("one", "one")));
  REQUIRE(found.num_faces() == 2);
  CHECK(found.positions[4] == Vec3(7, 6, 8));
  CHECK(areas(found) == std::map<std::string, double>{{"one", 0.5}, {"two", 2}});
  CHECK_THAT(format_refusal("b.3mf", archive("v3=\"2\"", "v3=\"3\"")), Contains("number of a vertex"));
  CHECK_THAT(format_refusal("b.3mf", archive("objectid=\"1\" transform", "objectid=\"2\" transform")),
             Contains("themselves"));
  CHECK_THAT(format_refusal("b.3mf", archive("objectid=\"2\"", "objectid=\"5\"")), Contains("no object"));
  CHECK_THAT(format_refusal("b.3mf", archive("x=\"1\"", "x=\"nan\"")), Contains("expected a number x"));
  const std::string bytes = archive("one", "one");
  for (std::size_t size = 0; size < bytes.size(); size += 7)
    CHECK_FALSE(format_refusal("cut.3mf", std::string_view(bytes).substr(0, size)).empty());
  const PolygonMesh of_zip64 = read_polygon_mesh(format_folder().file("e.3mf", as_zip64(bytes)));
  CHECK(of_zip64.positions == found.positions);
  for (std::size_t size = 0; size < as_zip64(bytes).size(); size += 7)
    CHECK_FALSE(format_refusal("cut.3mf", std::string_view(as_zip64(bytes)).substr(0, size)).empty());
  std::string damaged = bytes;
  damaged[60] = static_cast<char>(damaged[60] ^ 4);
  CHECK_THAT(format_refusal("d.3mf", damaged), Contains("damaged"));
}

TEST_CASE("surface formats: objects of a .3mf may stand in other parts of the package", "[io][quick]") {
  const std::string relations =
      R"(<Relationships><Relationship Target="/3D/root.model" Type="http://x/3dmodel"/></Relationships>)";
  const std::string root = model_of(
      R"(<object id="1" name="pair"><components><component p:path="/3D/Objects/a.model" objectid="1"/>
<component p:path="/3D/Objects/a.model" objectid="2" transform="-1 0 0 0 1 0 0 0 1 0 0 0"/></components></object>)",
      R"(<item objectid="1"/><item p:path="/3D/Objects/b.model" objectid="1" transform="1 0 0 0 1 0 0 0 1 5 0 0"/>)");
  const std::map<std::string, std::string> models = {
      {"_rels/.rels", relations},
      {"3D/root.model", root},
      {"3D/Objects/a.model", model_of(tet_object("1") + tet_object("2"), "")},
      {"3D/Objects/b.model", model_of(tet_object("1", "name=\"b\""), "")}};
  PolygonMesh found;
  CHECK(warnings_of("parts.3mf", models_archive(models), &found).empty());
  CHECK(found.num_faces() == 12);
  CHECK(signed_volume(found) == Approx(0.5));  // the mirrored one is turned
  CHECK(areas(found).size() == 2);
  auto missing = models;
  missing.erase("3D/Objects/b.model");
  CHECK_THAT(format_refusal("p.3mf", models_archive(missing)), Contains("3D/Objects/b.model: is not in the archive"));
  auto other = models;
  other["3D/Objects/b.model"] = model_of(tet_object("7"), "");
  CHECK_THAT(format_refusal("p.3mf", models_archive(other)), Contains("b.model: there is no object '1'"));
  auto loop = models;
  loop["3D/Objects/b.model"] = model_of(
      R"(<object id="1"><components><component p:path="/3D/Objects/b.model" objectid="1"/></components></object>)", "");
  CHECK_THAT(format_refusal("p.3mf", models_archive(loop)), Contains("include themselves"));
}

TEST_CASE("surface formats: components of a .3mf repeat no more than can be held", "[io][quick]") {
  std::string metadata, objects, components;
  for (int i = 0; i < 10000; ++i) metadata += "<metadatagroup/>";
  objects = "<object id=\"0\">" + metadata + "</object>";
  for (int i = 1; i < 13; ++i) {
    const std::string below = "<component objectid=\"" + std::to_string(i - 1) + "\"/>";
    objects += "<object id=\"" + std::to_string(i) + "\"><components>" + below + below + "</components></object>";
  }
  const auto refused = [&](int top) {
    const std::string item = "<item objectid=\"" + std::to_string(top) + "\"/>";
    return format_refusal("r.3mf", models_archive({{"3D/a.model", model_of(objects, item)}}));
  };
  CHECK_THAT(refused(3), Contains("no faces"));
  CHECK_THAT(refused(12), Contains("a.model: components repeat objects"));
}

TEST_CASE("surface formats: entries of a .3mf that share their bytes are refused", "[io][quick]") {
  std::string objects;
  for (int i = 0; i < 200; ++i) objects += tet_object(std::to_string(i));
  const std::string archive = models_archive({{"3D/a.model", model_of(objects, "<item objectid=\"1\"/>")}});
  CHECK(format_refusal("z.3mf", archive).empty());
  const std::size_t directory = archive.find("PK\1\2"), end = archive.find("PK\5\6");
  std::string entries = archive.substr(directory, end - directory);
  entries += with_part_replaced(entries, "a.model", "b.model");
  const std::string two = archive.substr(0, directory) + entries + archive.substr(end).replace(8, 4, "\2\0\2\0"s);
  CHECK_THAT(format_refusal("z.3mf", two), Contains("overlap"));
}

TEST_CASE("surface formats: colors of a .3mf are groups, and what is not read is told", "[io][quick]") {
  const auto told = [](const std::string& model, PolygonMesh* mesh = nullptr) {
    return warnings_of("t.3mf", models_archive({{"3D/a.model", model}}), mesh);
  };
  const std::string item = R"(<item objectid="1"/>)",
                    colors =
                        R"(<m:colorgroup id="5"><m:color color="#FF8000"/><m:color color="#0000FFC0"/></m:colorgroup>)";
  CHECK(told(model_of(tet_object("1"), item, "unit=\"millimeter\"")).empty());
  PolygonMesh found;
  CHECK(told(model_of(colors + tet_object("1", "pid=\"5\" pindex=\"1\"", "p1=\"0\""), item), &found).empty());
  CHECK(areas(found).at("#ff8000") == Approx(0.5));
  CHECK(areas(found).size() == 2);
  CHECK_THAT(told(model_of(colors + tet_object("1", "", "pid=\"5\" p1=\"0\" p2=\"1\" p3=\"0\""), item)),
             Contains("1 faces with a color at each corner"));
  CHECK_THAT(told(model_of(colors + R"(<basematerials id="6"><base name="steel"/></basematerials>)" +
                               tet_object("1", "pid=\"5\" pindex=\"1\"", "pid=\"6\" p1=\"0\""),
                           item)),
             Contains("3 colors of faces"));
  CHECK_THAT(told(model_of(R"(<m:texture2dgroup id="5"/>)" + tet_object("1", "pid=\"5\" pindex=\"0\""), item)),
             Contains("4 faces with textures"));
  CHECK_THAT(told(model_of(R"(<m:multiproperties id="5"/>)" + tet_object("1", "pid=\"5\" pindex=\"0\""), item)),
             Contains("4 faces with several materials"));
  CHECK_THAT(told(model_of(tet_object("1"), item, "unit=\"inch\"")), Contains("the unit of length is the inch"));
  CHECK_THAT(told(model_of(tet_object("1", "s:slicestackid=\"4\""), item)), Contains("coarse stand-ins"));
  CHECK_THAT(
      told(model_of(tet_object("1") + tet_object("2", "type=\"solidsupport\""), item + R"(<item objectid="2"/>)")),
      Contains("1 objects of type solidsupport"));
  const std::string lattice =
      with_part_replaced(tet_object("1"), "</mesh>",
                         R"(<b:beamlattice><b:beams><b:beam v1="0" v2="1"/><b:beam v1="0" v2="2"/>
</b:beams></b:beamlattice></mesh>)");
  CHECK_THAT(told(model_of(lattice, item)), Contains("2 beams"));
  const std::size_t begin = lattice.find("<triangles>"), end = lattice.find("</triangles>");
  const auto refused = [](const std::string& model) {
    return format_refusal("r.3mf", models_archive({{"3D/a.model", model}}));
  };
  CHECK_THAT(refused(model_of(lattice.substr(0, begin) + lattice.substr(end + 12), item)),
             Contains("no faces, only 4 vertices") && Contains("2 beams"));
  CHECK_THAT(refused(model_of(R"(<object id="1"><bo:booleanshape objectid="2"/></object>)", item)),
             Contains("no faces") && Contains("1 objects of the kind 'booleanshape'"));
  CHECK_THAT(refused(model_of(tet_object("1") + tet_object("1"), item)), Contains("two objects have the id '1'"));
  CHECK_THAT(refused(model_of(tet_object("1"), item) + model_of("", "")), Contains("one root element"));
  const std::string both = R"(<Relationships><Relationship Target="/3D/a.model" Type="http://x/3dmodel"/>
<Relationship Target="/3D/b.model" Type="http://x/3dmodel"/></Relationships>)";
  CHECK_THAT(warnings_of("two.3mf", models_archive({{"_rels/.rels", both},
                                                    {"3D/a.model", model_of(tet_object("1"), item)},
                                                    {"3D/b.model", model_of(tet_object("1"), item)}})),
             Contains("2 models in the package, of which only 3D/a.model is read"));
}

TEST_CASE("surface formats: polygons and strips of a .vtp, and labels of its cells", "[io]") {
  const std::string text =
      R"(<VTKFile type="PolyData" version="0.1"><PolyData><Piece NumberOfPoints="5" NumberOfVerts="1"
NumberOfPolys="1" NumberOfStrips="1"><Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">
0 0 0 1 0 0 0 1 0 1 1 0 2 1 0</DataArray></Points><Polys><DataArray type="Int64" Name="connectivity" format="ascii">
0 1 2</DataArray><DataArray type="Int64" Name="offsets" format="ascii">3</DataArray></Polys><Strips>
<DataArray type="Int64" Name="connectivity" format="ascii">1 3 2 4</DataArray><DataArray type="Int64" Name="offsets"
format="ascii">4</DataArray></Strips><CellData><DataArray type="Int32" Name="material" format="ascii">9 5 7</DataArray>
</CellData></Piece></PolyData></VTKFile>)";
  std::vector<std::string> warnings;
  const PolygonMesh found = read_polygon_mesh(format_folder().file("a.vtp", text), &warnings);
  REQUIRE(found.num_faces() == 3);
  CHECK(found.face_groups.groups == std::vector<Group>{{"", 5, 2}, {"", 7, 2}});
  CHECK(found.face_groups.of_face == std::vector<Index>{0, 1, 1});
  CHECK(std::vector<Index>(found.face_vertices.begin() + 3, found.face_vertices.end()) ==
        std::vector<Index>{1, 3, 2, 2, 3, 4});
  CHECK(warnings.size() == 1);
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string other = text;
    return other.replace(other.find(from), from.size(), to);
  };
  CHECK_THAT(format_refusal("b.vtp", changed("0 1 2</", "0 1 5</")), Contains("names point 5 of 5"));
  CHECK_THAT(format_refusal("b.vtp", changed(">3<", ">4<")), Contains("beyond the connectivity"));
  CHECK_THAT(format_refusal("b.vtp", changed("NumberOfVerts=\"1\"", "NumberOfVerts=\"18446744073709551615\"")),
             Contains("NumberOfVerts: expected at most 2^31 - 1"));
  CHECK_THAT(format_refusal("b.vtp", changed("PolyData\" v", "ImageData\" v")), Contains("expected the type PolyData"));
}

TEST_CASE("surface formats: elements of two dimensions in a .msh or .inp without cells are a surface", "[io]") {
  const FileCells msh = read_cells(format_folder().file(
      "a.msh",
      "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n2 8 \"inlet\"\n$EndPhysicalNames\n$Nodes\n5\n"
      "9 0 0 0\n3 1 0 0\n5 0 1 0\n4 1 1 0\n7 2 1 0\n$EndNodes\n$Elements\n3\n1 2 2 8 1 9 3 5\n"
      "2 2 2 0 1 3 4 5\n3 1 2 0 1 9 3\n$EndElements\n"));
  const auto& surface = std::get<PolygonMesh>(msh);
  CHECK(surface.num_faces() == 2);
  CHECK(surface.positions.size() == 4);  // the fifth belongs to no face
  CHECK(surface.face_groups.groups == std::vector<Group>{{"inlet", 8, 2}});
  CHECK(surface.face_groups.of_face == std::vector<Index>{0, kNoIndex});
  const FileCells inp = read_cells(
      format_folder().file("a.inp",
                           "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,1,1,0\n*ELEMENT,TYPE=S3,ELSET=left\n1,1,2,3\n"
                           "*ELEMENT,TYPE=S4R,ELSET=right\n2,2,4,3,1\n"));
  CHECK(std::get<PolygonMesh>(inp).face_groups.groups == std::vector<Group>{{"left", 1, 2}, {"right", 2, 2}});
  CHECK_THROWS_WITH(read_volume_mesh(format_folder() / "a.msh"), Contains("faces without cells"));
  std::vector<std::string> warnings;
  read_cells(format_folder().file("b.inp",
                                  "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n*ELEMENT,TYPE=S3,ELSET=left\n1,1,2,3\n"
                                  "*ELEMENT,TYPE=B31\n2,1,2\n*NSET,NSET=n\n1\n*ELSET,ELSET=e\n1\n*MATERIAL\n"),
             {.warnings = &warnings});
  REQUIRE(warnings.size() == 1);
  CHECK(warnings[0].ends_with("1 keywords *MATERIAL, 1 node sets, 1 element sets, 1 elements of type B31"));
}
