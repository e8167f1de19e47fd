// SPDX-License-Identifier: GPL-3.0-or-later
// Shells of sample, real and reported surfaces, as users of the program meet them.

#include "subvol/io/mesh_io.h"
#include "tests/support/require_data.h"
#include "tests/support/surface_fixtures.h"
#include "tests/support/workplace.h"

#include <catch2/catch.hpp>

#include <cmath>
#include <map>
#include <string>

using subvol::test::content_of;
using subvol::test::has;
using subvol::test::Run;
using subvol::test::Workplace;

namespace {

/// A box of quads, 2 x 1 x 1, whose six sides are groups; each side is one face.
const char* const kBox =
    "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nv 0 0 1\nv 2 0 1\nv 2 1 1\nv 0 1 1\n"
    "g bottom\nf 1 4 3 2\ng top\nf 5 6 7 8\ng left\nf 1 5 8 4\ng right\nf 2 3 7 6\ng front\nf 1 2 6 5\ng back\nf 4 8 7 "
    "3\n";

std::map<std::string, std::size_t> faces_by_group(const nlohmann::json& report) {
  std::map<std::string, std::size_t> found;
  for (const auto& group : report["groups"]) found[group["name"]] = group["faces"];
  return found;
}

}  // namespace

TEST_CASE("Shells of real parts that need a repair say what was done", "[cli][slow]") {
  const auto data = subvol::test::require_data();
  if (!data) return;
  const Workplace place;
  for (const char* name : {"auto/parts/T8_Nut_Block_x1.stl", "reported/50-z-axis-top.stl"}) {
    if (!std::filesystem::exists(*data / name)) continue;
    const std::string words =
        "shell " + (*data / name).string() + " --thickness 1% --straight --force -o a.vtu --report r.json";
    const Run run = place.run(words);
    CAPTURE(name, run.err);
    REQUIRE(run.status == 0);
    CHECK(has(run.err, "the surface was mended within "));
    const auto report = place.json("r.json");
    CHECK(report["valid"] == true);
    CHECK(report["repair"]["distance"] <= report["repair"]["allowed_distance"]);
    const Run refused = place.run(words + " --repair 0");
    CAPTURE(refused.err);
    CHECK(refused.status == 3);
    CHECK((has(refused.err, " at (245.") || has(refused.err, "(33")));  // coordinates
  }
}

TEST_CASE("Layers end in the plane of an oblique cut, and grow on no cap that is left out", "[cli]") {
  const auto data = subvol::test::require_data();
  if (!data) return;
  const Workplace place;
  const std::string reported = (*data / "reported").string() + "/";
  const Run oblique =
      place.run("shell " + reported + "23-oblique.off --thickness 0.08 --layers 4 -o a.mesh --report r.json");
  CAPTURE(oblique.err);
  REQUIRE(oblique.status == 0);
  const auto border = place.json("r.json")["border"];
  CHECK(border["planes"] == 2);
  CHECK(border["columns_in_planes"] == border["edges"]);
  CHECK(border["distance_max_percent"] < 1e-10);
}

TEST_CASE("Groups of a surface arrive on its shell, and can be left out by name, number or place", "[slow][cli]") {
  const Workplace place;
  place.file("box.obj", kBox);
  const std::string words = "shell box.obj --thickness 0.1 --layers 2 --force -o a.msh -o a.mesh --report r.json ";
  REQUIRE(place.run(words).status == 0);
  auto groups = faces_by_group(place.json("r.json"));
  CHECK(groups.size() == 7);
  CHECK(groups["top"] == 1);
  CHECK(groups["outer"] == 6);
  for (const auto& group : place.json("r.json")["groups"]) {
    if (group["name"] == "outer") CHECK_FALSE(group.contains("target_area"));
    if (group["name"] == "outer") continue;
    CHECK(group["area"].get<double>() == Approx(group["target_area"].get<double>()));
  }
  CHECK(has(content_of(place / "a.msh"), "\"outer\""));
  CHECK(has(content_of(place / "a.msh"), "\"left\""));

  const int top = place.json("r.json")["groups"][1]["number"];
  for (const std::string& patch : {std::string("top"), std::to_string(top), std::string("1,0.5,3")}) {
    const Run run = place.run(words + "--skip " + patch + " --skip 0,0.5,0.5");
    CAPTURE(patch, run.err);
    REQUIRE(run.status == 0);
    const auto report = place.json("r.json");
    groups = faces_by_group(report);
    CHECK(groups.size() == 6);  // bottom, right, front, back, outer, rim
    CHECK(groups["outer"] == 4);
    CHECK(groups["rim"] == 2 * 6);
    CHECK(report["skipped"].size() == 2);
    CHECK(report["skipped"][0]["area"] == 2);
    CHECK(report["border"]["distance_max_percent"] < 1e-10);
    const subvol::VolumeMesh mesh = subvol::read_volume_mesh(place / "a.mesh");
    for (const subvol::Vec3& p : mesh.positions) {
      CHECK(p.z() < 1 + 1e-12);
      CHECK(p.x() > -1e-12);
    }
  }
  const Run unknown = place.run(words + "--skip lid");
  CHECK(unknown.status == 2);
  CHECK(has(unknown.err, "no group 'lid'"));
  CHECK(has(unknown.err, "(bottom)"));
  CHECK(place.run(words + "--skip bottom --skip top --skip left --skip right --skip front --skip back").status == 3);
}

TEST_CASE("The first height, the layers and the growth of a shell follow from one another", "[cli][slow]") {
  const Workplace place;
  place.file("box.obj", kBox);
  const std::string words = "shell box.obj --thickness 0.31 --straight --force -o a.mesh --report r.json ";
  REQUIRE(place.run(words + "--first-height 0.01 --layers 5").status == 0);
  CHECK(place.json("r.json")["layers"]["growth"] == Approx(2));
  CHECK(place.json("r.json")["layers"]["first_height_outside"] == Approx(0.01));
  REQUIRE(place.run(words + "--first-height 0.01 --growth 2").status == 0);
  CHECK(place.json("r.json")["layers"]["outside"] == 5);
  REQUIRE(place.run(words + "--first-height 0.01 --growth 2 --layers 5").status == 0);
  const auto refuses = [&](const std::string& more, int status, const std::string& why) {
    const Run run = place.run(words + more);
    CAPTURE(more, run.err);
    CHECK(run.status == status);
    CHECK(has(run.err, why));
  };
  refuses("--first-height 0.01", 2, "--layers or --growth");
  refuses("--first-height 0.01 --growth 1.2 --layers 5", 2, "takes a growth of 2");
  refuses("--first-height 0.5 --layers 3", 3, "no room");
  refuses("--first-height 0.5 --growth 1.2", 3, "thicker than the shell");
  refuses("--first-height x --layers 3", 2, "--first-height");
  CHECK(place.run("shell box.obj --thickness-file t --first-height 0.1 --layers 3 -o b.mesh").status == 2);
}

TEST_CASE("A shell goes from a surface to cells, named sheets and a report that tells the truth", "[cli][slow]") {
  const Workplace place;
  const Run run = place.run(
      "shell target.off --thickness 2% --layers 2 --side both -o shell.mesh -o shell.vtu -o shell.glb --report "
      "report.json");
  INFO(run.err);
  REQUIRE(run.status == 0);
  CHECK(place.names().size() == 6);
  const auto report = place.json("report.json");
  CHECK(report["command"] == "shell");
  CHECK(report["valid"] == true);
  CHECK(report["boundary_self_intersections"] == 0);
  const auto mesh = subvol::read_volume_mesh(place / "shell.mesh");
  CHECK(report["quality"]["certified_cells"] == mesh.num_cells());
  for (const char* side : {"inside", "outside"}) {
    CHECK(report["thickness"][side]["asked"]["mean_percent"].get<double>() == Approx(2));
    CHECK(report["thickness"][side]["achieved"]["mean_percent"].get<double>() == Approx(2).epsilon(0.1));
  }
  CHECK(place.run("check shell.mesh").status == 0);
  CHECK(content_of(place / "shell.vtu").find("Name=\"thickness\"") != std::string::npos);
  const std::string glb = content_of(place / "shell.glb");
  for (const char* name : {"\"inner\"", "\"base\"", "\"outer\"", "\"wireframe\"", "_THICKNESS"})
    CHECK(glb.find(name) != std::string::npos);
}

TEST_CASE("A surface that faces inward is told, with holes or without, and called closed only if it is",
          "[slow][cli]") {
  const Workplace place;
  subvol::TriangleMesh ball = subvol::test::cube_surface(8, true);
  const std::string thin = " --thickness 1% --straight --force -o shell.mesh";
  const auto write = [&](std::size_t num_missing, bool inward) {
    std::string text = "OFF\n" + std::to_string(ball.positions.size()) + " " +
                       std::to_string(ball.triangles.size() - num_missing) + " 0\n";
    for (const subvol::Vec3& p : ball.positions)
      text += std::to_string(p.x()) + " " + std::to_string(p.y()) + " " + std::to_string(p.z()) + "\n";
    for (std::size_t t = num_missing; t < ball.triangles.size(); ++t) {
      const auto& [a, b, c] = ball.triangles[t];
      text +=
          "3 " + std::to_string(a) + " " + std::to_string(inward ? c : b) + " " + std::to_string(inward ? b : c) + "\n";
    }
    place.file("ball.off", text);
  };
  for (const std::size_t num_missing : {0, 1, 20}) {
    write(num_missing, true);
    const Run run = place.run("shell ball.off" + thin);
    CAPTURE(num_missing, run.err);
    CHECK(run.err.find("point inward") != std::string::npos);
    CHECK((run.err.find("this closed surface") != std::string::npos) == (num_missing == 0));
    CHECK((run.err.find("3 open edges") != std::string::npos) == (num_missing == 1));
    write(num_missing, false);
    CHECK(place.run("shell ball.off" + thin).err.find("inward") == std::string::npos);
  }
  write(ball.triangles.size() / 2, true);  // half a ball encloses nothing
  CHECK(place.run("shell ball.off" + thin).err.find("inward") == std::string::npos);
}

TEST_CASE("A shell of curved cells goes to its files with its thickness, and is what the files say", "[cli][slow]") {
  const Workplace place;
  const Run run = place.run(
      "shell target.off --thickness 2% --side both --order 2 -o cage:cage.vtu -o shell.vtu -o shell.msh -o shell.glb "
      "-o cage:cage.mesh --report report.json");
  INFO(run.err);
  REQUIRE(run.status == 0);
  const auto report = place.json("report.json");
  CHECK(report["valid"] == true);
  CHECK(report["mesh"]["max_order"] == 2);
  CHECK(report["stages"].back()["order"] == 2);
  CHECK(report["quality"]["certified_cells"] == report["mesh"]["cells"]);
  CHECK(place.run("check shell.vtu").status == 0);
  CHECK(subvol::read_volume_mesh(place / "cage.mesh").num_cells() == report["mesh"]["cells"]);
  for (const char* file : {"shell.vtu", "shell.msh"})
    CHECK(content_of(place / file).find("thickness_limited") != std::string::npos);
  CHECK(content_of(place / "shell.glb").find("_THICKNESS") != std::string::npos);
}

TEST_CASE("Thicknesses may differ from vertex to vertex, by a file or a property of the surface", "[cli][slow]") {
  const Workplace place;
  const std::string faces = "3 0 1 2\n3 0 3 1\n3 1 3 2\n3 2 3 0\n";
  place.file("tet.ply",
             "ply\nformat ascii 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\n"
             "property float wall\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n"
             "0 0 0 0.1\n0 1 0 0.1\n1 0 0 0.1\n0 0 1 0.2\n" +
                 faces);
  place.file("wall.txt", "0.1\n0.1\n\n0.1\r\n0.2\n");
  REQUIRE(place.run("shell tet.ply --thickness-attribute wall -o a.mesh --report a.json").status == 0);
  REQUIRE(place.run("shell tet.ply --thickness-file wall.txt -o b.mesh --report b.json").status == 0);
  for (const char* report : {"a.json", "b.json"}) {
    const auto asked = place.json(report)["thickness"]["outside"]["asked"];
    CHECK(asked["min"].get<double>() == Approx(0.1));
    CHECK(asked["max"].get<double>() == Approx(0.2));
  }
  for (const char* line : {"thin", "0", "-1", "nan", "inf", "1e999", "0.1 0.2"}) {
    place.file("wall.txt", "0.1\n" + std::string(line) + "\n0.1\n0.1\n");
    const Run run = place.run("shell tet.ply --thickness-file wall.txt -o c.mesh");
    CHECK(run.status == 3);
    CHECK(run.err.find("wall.txt:2: expected a positive thickness, found '" + std::string(line) + "'") !=
          std::string::npos);
  }
  CHECK(place.run("shell tet.ply --thickness-attribute roof -o c.mesh").err.find("roof") != std::string::npos);
  CHECK(place.run("shell target.off --thickness-attribute wall -o c.mesh").status == 3);
  CHECK(place.run("shell tet.ply --thickness-attribute wall --thickness 1 -o c.mesh").status == 2);
}

TEST_CASE("A shell is a control mesh that can be subdivided", "[cli][slow]") {
  const Workplace place;
  const Run run = place.run("shell target.off --thickness 3% --crease-angle 60 -o cage:cage.mesh --report report.json");
  INFO(run.err);
  REQUIRE(run.status == 0);
  const auto report = place.json("report.json");
  CHECK(report["subdivided_once"]["not_certified_cells"] == 0);
  CHECK(place.run("subdivide cage.mesh --levels 1 -o fine.mesh").status == 0);
  CHECK(place.run("check fine.mesh").status == 0);
}

TEST_CASE("A shell of hexes and prisms numbers its cells layer by layer", "[cli]") {
  const Workplace place;
  place.file("mixed.obj",  // triangles before quads: prisms before hexes
             "v 0 0 0\nv 1 0 0.1\nv 1 1 0\nv 0 1 0.1\nv 2 0 0\nv 2 1 0.2\nf 1 2 3\nf 1 3 4\nf 2 5 6 3\n");
  REQUIRE(place.run("shell mixed.obj --thickness 0.1 -o s.mesh -o s.vtk --report s.json").status == 0);
  const subvol::VolumeMesh by_layer = subvol::read_volume_mesh(place / "s.vtk");
  CHECK(subvol::read_volume_mesh(place / "s.mesh").kinds[0] == subvol::CellKind::hex);
  const auto worst = place.json("s.json").at("quality").at("worst_cells");
  REQUIRE(worst.size() == 3);
  for (const auto& cell : worst) {
    const auto corners = by_layer.cell(cell.at("cell").get<std::size_t>());
    subvol::Vec3 center = subvol::Vec3::Zero();
    for (const subvol::Index v : corners) center += by_layer.positions[v] / static_cast<double>(corners.size());
    for (int k = 0; k < 3; ++k) CHECK(cell.at("center")[k].get<double>() == Approx(center[k]));
  }
}

TEST_CASE("A shell refuses what it cannot use before it writes", "[cli][slow]") {
  const Workplace place;
  CHECK(place.run("shell target.off -o a.mesh").status == 2);
  CHECK(place.run("shell target.off --thickness 2%% -o a.mesh").status == 2);
  CHECK(place.run("shell target.off --thickness -1 -o a.mesh").status == 2);
  CHECK(place.run("shell target.off --thickness nan -o a.mesh").status == 2);
  CHECK(place.run("shell target.off --thickness 1 --layers 0 -o a.mesh").status == 2);
  CHECK(place.run("shell target.off --thickness 1 --side up -o a.mesh").status == 2);
  CHECK(place.run("shell target.off --thickness 1 --order 2 --straight -o a.mesh").status == 2);
  CHECK(place.run("shell target.off --thickness 1 --order 3 -o a.msh").err.find("up to order 2") != std::string::npos);
  place.file("few.txt", "1\n2\n");
  const Run few = place.run("shell target.off --thickness-file few.txt -o a.mesh");
  CHECK(few.status == 3);
  CHECK(few.err.find("got 2") != std::string::npos);
  place.file("bad.txt", "1\nx\n");
  CHECK(place.run("shell target.off --thickness-file bad.txt -o a.mesh").err.find("bad.txt:2") != std::string::npos);
  CHECK_FALSE(place.has("a.mesh"));
}
