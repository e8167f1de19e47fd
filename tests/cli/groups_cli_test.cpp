// SPDX-License-Identifier: GPL-3.0-or-later
// Groups of faces, from the surface to the boundary of every result.

#include "samples/shapes.h"
#include "subvol/export/high_order_file.h"
#include "subvol/export/obj_writer.h"
#include "subvol/export/volume_writer.h"
#include "subvol/io/mesh_io.h"
#include "subvol/io/surface_io.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/surface/boundary.h"
#include "tests/support/grouped_meshes.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/workplace.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <string>
#include <vector>

using namespace subvol;
using subvol::test::content_of;
using subvol::test::has;
using subvol::test::Run;
using subvol::test::Workplace;

namespace {

/// A surface as .obj with the groups "north" and "south": above and below z = 0.
std::string obj_with_halves(const TriangleMesh& surface) {
  std::string halves[2] = {"g south\n", "g north\n"}, text;
  for (const Vec3& p : surface.positions)
    text += "v " + std::to_string(p.x()) + ' ' + std::to_string(p.y()) + ' ' + std::to_string(p.z()) + '\n';
  for (const auto& t : surface.triangles) {
    double z = 0;
    for (const Index v : t) z += surface.positions[v].z();
    std::string& half = halves[z > 0];
    half += "f";
    for (const Index v : t) half += ' ' + std::to_string(v + 1);
    half += '\n';
  }
  return text + halves[0] + halves[1];
}

/// Checks that every boundary face has one of the two groups, by where it lies. Within `reach` of z = 0, either is
/// right.
void check_halves(const VolumeMesh& mesh, double reach = 0.05) {
  const MeshTopology topology(mesh);
  const std::vector<Index> groups = groups_of_boundary(mesh.face_groups, topology);
  REQUIRE(groups.size() == topology.boundary_faces().size());
  std::size_t num_wrong = 0;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    double low = 1e300, high = -1e300;
    for (const Index v : topology.face(topology.boundary_faces()[i])) {
      low = std::min(low, mesh.positions[v].z());
      high = std::max(high, mesh.positions[v].z());
    }
    const std::string name = groups[i] == kNoIndex ? "" : mesh.face_groups.groups[groups[i]].name;
    num_wrong += (low > reach && name != "north") || (high < -reach && name != "south") || name.empty();
  }
  CHECK(num_wrong == 0);
}

}  // namespace

TEST_CASE("Groups of the target are on the boundary of fitted, curved and optimized meshes", "[cli][slow]") {
  const samples::Sample sample = samples::ball_sample();
  const Workplace place(sample);
  place.file("halves.obj", obj_with_halves(sample.target));
  const Run fit = place.run(
      "fit halves.obj --template template.mesh --levels 1 --max-iterations 5 --tolerance 10 -o fit.mesh -o fit.msh "
      "-o fit.glb -o fit.usda -o cage:cage.mesh -o boundary:faces.vtu -o boundary:faces.vtk --report fit.json");
  INFO(fit.err);
  REQUIRE((fit.status == 0 || fit.status == 4));
  check_halves(read_volume_mesh(place / "fit.mesh"));
  check_halves(read_volume_mesh(place / "cage.mesh"));
  CHECK(has(content_of(place / "fit.msh"), "2 2 \"north\"\n"));
  CHECK(has(content_of(place / "fit.usda"), "def GeomSubset \"north\""));
  CHECK(has(content_of(place / "fit.glb"), "\"north\""));
  CHECK(has(content_of(place / "faces.vtk"), "group_names 1 12 unsigned_char\n115\n"));
  const auto groups = place.json("fit.json")["groups"];
  REQUIRE(groups.size() == 2);
  CHECK(groups[1]["name"] == "north");
  CHECK(groups[1]["number"] == 2);
  CHECK(groups[1]["faces"].get<int>() > 0);
  CHECK(groups[1]["area"].get<double>() == Approx(groups[1]["target_area"].get<double>()).epsilon(0.2));

  const Run curve =
      place.run("fit halves.obj --template template.mesh --order 2 --max-iterations 3 -o c.vtu -o c.msh -o c.obj");
  INFO(curve.err);
  REQUIRE((curve.status == 0 || curve.status == 4));
  HighOrderFile file = read_high_order(place / "c.vtu");
  VolumeMesh straight = file.mesh.straight_sided();
  straight.face_groups = file.face_groups;
  check_halves(straight);
  CHECK(has(content_of(place / "c.obj"), "g north\n"));
  REQUIRE(place.run("convert c.vtu -o again.mesh").status == 0);
  constexpr double kHalfFace = 0.7;  // small cells have the groups of the curved faces that they are parts of
  check_halves(read_volume_mesh(place / "again.mesh"), kHalfFace);

  const Run optimize = place.run("optimize fit.mesh --max-iterations 2 -o o.mesh");
  REQUIRE((optimize.status == 0 || optimize.status == 4));
  CHECK(read_volume_mesh(place / "o.mesh").face_groups == read_volume_mesh(place / "fit.mesh").face_groups);
  REQUIRE(place.run("subdivide fit.mesh -o s.mesh").status == 0);
  check_halves(read_volume_mesh(place / "s.mesh"));
}

TEST_CASE("An automatic fit carries the groups of its target", "[cli][slow]") {
  const samples::Sample sample = samples::ball_sample();
  const Workplace place(sample);
  place.file("halves.obj", obj_with_halves(sample.target));
  const Run fit = place.run("fit halves.obj --cells 500 --quality 0.2 -o a.mesh --report a.json");
  INFO(fit.err);
  REQUIRE((fit.status == 0 || fit.status == 4));
  check_halves(read_volume_mesh(place / "a.mesh"));
  CHECK(place.json("a.json")["groups"].size() == 2);
}

TEST_CASE("check: the groups of a mesh are compared with those of the target, by name or number", "[cli]") {
  const Workplace place;
  VolumeMesh block = subvol::test::lattice(2, 2, 2);
  const MeshTopology topology(block);
  PolygonMesh surface = boundary_surface(block, topology);
  surface.face_groups.groups = {{"low", 1, 2}, {"high", 2, 2}, {"lost", 3, 2}};
  block.face_groups.groups = {{"low", 7, 2}, {"high", 9, 2}};
  for (std::size_t i = 0; i < topology.boundary_faces().size(); ++i) {
    const std::span<const Index> face = topology.face(topology.boundary_faces()[i]);
    const auto on = [&](int axis, double value) {
      return std::ranges::all_of(face, [&](Index v) { return block.positions[v][axis] == value; });
    };
    surface.face_groups.of_face.push_back(on(2, 0) ? 0 : on(2, 2) ? 1 : on(0, 0) ? 2 : kNoIndex);
    if (on(2, 0)) block.face_groups.faces.push_back({face_key(face), 0});
    const bool on_left = std::ranges::all_of(face, [&](Index v) { return block.positions[v].x() <= 1; });
    if (on(2, 2) && on_left) block.face_groups.faces.push_back({face_key(face), 1});
  }
  normalize(block.face_groups);
  write_obj(place / "target.obj", surface);
  write_volume(place / "mesh.msh", block);
  const Run run = place.run("check mesh.msh --target target.obj --report check.json");
  INFO(run.err);
  CHECK(run.status == 0);
  const nlohmann::json groups = place.json("check.json")["groups"];
  REQUIRE(groups.size() == 3);
  for (const nlohmann::json& group : groups) {
    const std::string name = group["name"];
    CHECK(group["target_area"].get<double>() == Approx(4));
    CHECK(group["area"].get<double>() == Approx(name == "low" ? 4 : name == "high" ? 2 : 0));
  }
  CHECK(has(run.err, "lost"));

  block.face_groups.groups = {{"", 7, 2}, {"", 9, 2}};
  write_volume(place / "numbers.msh", block);
  const Run same = place.run("check numbers.msh --target mesh.msh --report numbers.json");
  INFO(same.err);
  for (const nlohmann::json& group : place.json("numbers.json")["groups"])
    CHECK(group["area"].get<double>() == Approx(group["target_area"].get<double>()));
}

TEST_CASE("Without groups, results are as before, and groups that no output holds are told", "[cli]") {
  const Workplace place;
  REQUIRE(place.run("convert template.mesh -o a.mesh -o a.msh -o a.obj").status == 0);
  CHECK(!has(content_of(place / "a.mesh"), "Quadrilaterals"));
  CHECK(has(content_of(place / "a.msh"), "$PhysicalNames\n1\n"));
  CHECK(!has(content_of(place / "a.obj"), "g "));
  write_volume_mesh(place / "b.mesh", test::with_floor_and_roof(test::lattice(1, 1, 1), 1));
  CHECK(has(place.run("convert b.mesh -o b.vtk").err, "2 groups of faces"));
  CHECK(place.run("convert b.mesh -o c.vtk -o boundary:c_faces.vtk").err.empty());
  CHECK(has(place.run("convert template.mesh -o boundary:a.stl").err, "the extension must be"));
  CHECK(place.run("convert template.mesh -o boundary:faces.obj").status == 2);
}

TEST_CASE("Groups go through every format that holds them, on the command line", "[cli][slow]") {
  const Workplace place;
  write_volume_mesh(place / "b.mesh", test::with_floor_and_roof(test::lattice(1, 1, 1), 1));
  const auto run = [&](const std::string& words) {
    Run done = place.run(words);
    INFO(words << '\n' << done.err);
    CHECK(done.status == 0);
    return done;
  };
  for (const std::string extension : {"stl", "vtp", "3mf", "glb", "gltf"}) {
    CAPTURE(extension);
    run("convert b.mesh -o s." + extension);
    run("convert s." + extension + " --force -o s.obj");
    const std::string text = content_of(place / "s.obj");
    CHECK(has(text, "g floor\n"));
    CHECK(has(text, "g roof\n"));
  }
  run("convert b.mesh --msh-version 2.2 -o old.msh");
  CHECK(content_of(place / "old.msh").starts_with("$MeshFormat\n2.2 0 8\n"));
  for (const std::string name : {"old.msh", "b.vtu", "b.inp", "b.e"}) {
    CAPTURE(name);
    if (name == "b.e" && !has_exodus()) continue;
    if (name != "old.msh") run("convert b.mesh -o " + name);
    run("convert " + name + " --force -o again.mesh");
    CHECK(has(content_of(place / "again.mesh"), "floor\n"));
  }
  run("convert b.mesh -o b.xdmf -o boundary:b_faces.xdmf");
  CHECK(has(content_of(place / "b_faces.xdmf"), "Quadrilateral"));
  CHECK(place.run("convert s.obj -o boundary:c.xdmf").status == 2);
  CHECK(place.run("convert b.mesh --msh-version 3 -o c.msh").status == 2);
  CHECK(has(run("formats").out, "| `.3mf` (3MF) |"));
}
