// SPDX-License-Identifier: GPL-3.0-or-later
// The verbs beside fit as their users run them: shells, high-order files, optimization, templates.

#include "subvol/export/high_order_file.h"
#include "subvol/io/mesh_io.h"
#include "subvol/mesh/mesh_topology.h"
#include "tests/support/glb_reader.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/surface_fixtures.h"
#include "tests/support/workplace.h"

#include <catch2/catch.hpp>

#include <array>
#include <cstdio>
#include <utility>
#include <vector>

using subvol::test::content_of;
using subvol::test::Run;
using subvol::test::Workplace;

namespace {

/// An inverted tet, cell 0, and a sound cube beside it: in a .mesh, where hexes come first, the tet is cell 1.
subvol::VolumeMesh inverted_tet_and_cube() {
  subvol::VolumeMesh mesh;
  mesh.positions = {{5, 0, 0}, {5, 1, 0}, {6, 0, 0}, {5, 0, 1}};
  mesh.add_cell(subvol::CellKind::tet, std::array<subvol::Index, 4>{0, 1, 2, 3});
  const subvol::VolumeMesh cube = subvol::test::lattice(1, 1, 1);
  std::vector<subvol::Index> corners(cube.cell(0).begin(), cube.cell(0).end());
  for (subvol::Index& v : corners) v += 4;
  mesh.positions.insert(mesh.positions.end(), cube.positions.begin(), cube.positions.end());
  mesh.add_cell(subvol::CellKind::hex, corners);
  return mesh;
}

/// What `check` finds in a file.
nlohmann::json found_in(const Workplace& place, const std::string& file) {
  return nlohmann::json::parse(place.run("check " + file + " --json").out);
}

}  // namespace

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

TEST_CASE("check calls a mesh valid or counts its defects, never both", "[cli]") {
  const Workplace place;
  subvol::VolumeMesh mesh = subvol::test::lattice(1, 1, 2);
  mesh.positions.insert(mesh.positions.end(), 24, {5, 5, 5});
  subvol::write_volume_mesh(place / "spare.mesh", mesh);
  const Run run = place.run("check spare.mesh");
  CAPTURE(run.out);
  CHECK(run.status == 0);
  CHECK(run.out.find("defects             0\n") != std::string::npos);
  CHECK(run.out.find("unused vertices     24") != std::string::npos);
  const auto found = found_in(place, "spare.mesh");
  CHECK(found.at("valid") == true);
  CHECK(found.at("defects").empty());
  CHECK(found.at("unused_vertices").size() == 24);
}

TEST_CASE("No verb takes a mesh that is a point", "[cli][slow]") {
  const Workplace place;
  place.file("point.mesh", "MeshVersionFormatted 2\nDimension 3\nVertices\n4\n1 2 3 0\n1 2 3 0\n1 2 3 0\n1 2 3 0\n"
                           "Tetrahedra\n1\n1 2 3 4 0\nEnd\n");
  subvol::VolumeMesh straight = subvol::test::lattice(1, 1, 1);
  for (subvol::Vec3& x : straight.positions) x = {1, 2, 3};
  const subvol::HighOrderMesh mesh(subvol::ElementSpace(straight, subvol::Basis::fourier, 2), straight);
  subvol::write_volume(place / "point.vtu", mesh, {});
  for (const std::string verb :
       {"check point.mesh", "convert point.mesh -o a.vtk", "subdivide point.mesh -o a.mesh",
        "optimize point.mesh -o a.mesh", "fit target.off --template point.mesh -o a.mesh", "fit point.mesh -o a.mesh",
        "template pillow point.mesh -o a.mesh", "shell point.mesh --thickness 1 -o a.mesh",
        "check template.mesh --target point.mesh", "check point.vtu", "convert point.vtu -o a.mesh"}) {
    const Run run = place.run(verb);
    CAPTURE(verb, run.err);
    CHECK(run.status == 3);
    CHECK(run.err.find("in one place") != std::string::npos);
    CHECK(!place.has("a.mesh"));
  }
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
             "0 0 0 0.1\n0 1 0 0.1\n1 0 0 0.1\n0 0 1 0.2\n" + faces);
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

TEST_CASE("check and convert take a high-order .vtu", "[slow][cli]") {
  const Workplace place;
  subvol::VolumeMesh straight = subvol::read_volume_mesh(place / "template.mesh");
  straight.references.assign(straight.num_cells(), 7);
  const subvol::HighOrderMesh mesh(subvol::ElementSpace(straight, subvol::Basis::fourier, 2), straight);
  subvol::write_volume(place / "curved.vtu", mesh, {.references = straight.references});

  const Run check = place.run("check curved.vtu --target template.mesh --chord 0.05 --json --report check.json");
  INFO(check.err);
  CHECK(check.err.empty());
  const auto json = place.json("check.json");
  CHECK(nlohmann::json::parse(check.out) == json);
  CHECK(check.status == (json["valid"] ? 0 : 1));
  CHECK(json["input"]["mesh"]["max_order"] == 2);
  CHECK(json["orders"]["basis"] == "fourier");
  CHECK(json["orders"]["nodes"] == mesh.coefficients.size());
  CHECK(json["quality"]["inverted_cells"] == 0);
  CHECK(json["boundary_self_intersections"] == 0);
  CHECK(json["distance"]["max_percent"] < 1);
  CHECK(json.contains("boundary_chord_error"));
  CHECK_FALSE(json.contains("audit"));

  const Run convert =
      place.run("convert curved.vtu -o same.vtu -o out.msh -o out.glb -o out.obj -o out.mesh --intervals 3");
  INFO(convert.err);
  REQUIRE(convert.status == 0);
  CHECK(subvol::read_high_order(place / "same.vtu").mesh.coefficients == mesh.coefficients);
  const subvol::VolumeMesh cells = subvol::read_volume_mesh(place / "out.mesh");
  CHECK(cells.num_cells() == 27 * straight.num_cells());
  CHECK(cells.references[0] == 7);
  const subvol_tests::GlbFile glb(content_of(place / "out.glb"));
  CHECK(glb.attribute<float>("surface", "_SCALED_JACOBIAN").size() > straight.num_cells());

  CHECK(place.run("convert curved.vtu -o first.mesh -o out.usda").status == 2);
  CHECK_FALSE(std::filesystem::exists(place / "first.mesh"));
  CHECK(place.run("convert curved.vtu --limit -o more.glb").status == 2);
  place.file("alien.vtu", "<VTKFile type=\"UnstructuredGrid\"></VTKFile>");
  const Run alien = place.run("check alien.vtu");
  CHECK(alien.status == 3);
  CHECK(alien.err.find("alien.vtu") != std::string::npos);
  CHECK(place.run("convert alien.vtu -o out2.mesh").status == 3);
}

TEST_CASE("optimize untangles a mesh, proves it, and says which cells it could not make valid", "[slow][cli]") {
  const Workplace place;
  subvol::VolumeMesh mesh = subvol::test::lattice(3, 3, 3);
  const subvol::MeshTopology topology(mesh);
  double shift = 1.3;
  for (std::size_t v = 0; v < mesh.num_vertices(); ++v)
    if (!topology.is_boundary_vertex(static_cast<subvol::Index>(v))) mesh.positions[v].x() += shift = -shift;
  subvol::write_volume_mesh(place / "tangled.mesh", mesh);
  const Run run = place.run("optimize tangled.mesh -o valid.mesh -o valid.glb --report report.json --progress none");
  INFO(run.err);
  CHECK(run.status == 0);
  const nlohmann::json report = place.json("report.json");
  CHECK(report["command"] == "optimize");
  CHECK(report["input"]["quality"]["inverted_cells"] > 0);
  CHECK(report["quality"]["certified_cells"] == mesh.num_cells());
  CHECK(report["quality"]["min_scaled_jacobian"] > 0.99);
  CHECK(report["distance"]["max_percent"] < 0.1);
  CHECK(report["not_certified_cells"].empty());
  CHECK(place.run("check valid.mesh").status == 0);

  // A corner of the block on the wrong side, and a boundary that may not move.
  mesh.positions[0] = {1.5, 1.5, 1.5};
  subvol::write_volume_mesh(place / "stuck.mesh", mesh);
  const Run stuck = place.run("optimize stuck.mesh --fixed-boundary -o left.mesh --report left.json --progress none");
  CHECK(stuck.status == 1);
  CHECK(stuck.err.find("NOT VALID") != std::string::npos);
  CHECK(place.json("left.json")["valid"] == false);
  CHECK(place.json("left.json")["not_certified_cells"][0] == 0);
  CHECK(place.json("left.json")["inverted_at"][0]["determinant"] < 0);

  CHECK(place.run("optimize tangled.mesh").status == 2);
  CHECK(place.run("optimize tangled.mesh --fixed-boundary --target target.off -o a.mesh").status == 2);
  CHECK(place.run("optimize tangled.mesh --order 2 -o a.vtu").status == 2);
}

TEST_CASE("Reports number cells as their file does", "[cli][slow]") {
  const Workplace place;
  subvol::write_volume_mesh(place / "mixed.vtk", inverted_tet_and_cube());
  for (const std::string verb : {"template carve mixed.vtk --list 0,1", "optimize mixed.vtk --fixed-boundary"})
    for (const auto& [file, tet] : {std::pair("a.mesh", 1), std::pair("a.vtk", 0)}) {
      const Run run = place.run(verb + " --force --report r.json -o a.glb -o " + file);
      INFO(verb << ' ' << file << ": " << run.err);
      CHECK(run.status == 1);
      const auto report = place.json("r.json"), found = found_in(place, file);
      CHECK(report.at("inverted_at").at(0).at("cell") == tet);
      CHECK(report.at("valid") == false);
      for (const char* entry : {"inverted_at", "quality", "defects", "topology"})
        CHECK(report.at(entry) == found.at(entry));
      if (verb.starts_with("template")) continue;
      CHECK(report.at("not_certified_cells") == nlohmann::json{tet});
      CHECK(run.err.find("cell " + std::to_string(tet) + " is not proved positive") != std::string::npos);
    }
}

TEST_CASE("The distances that optimize decides by are those of its file", "[cli][slow]") {
  const Workplace place;
  subvol::write_volume_mesh(place / "tangled.mesh", subvol::samples::tangled_ball());
  const std::string with_target = "template.mesh --target target.off";
  for (const std::string& words :
       {with_target, with_target + " --tolerance 9 --max-tolerance 9", std::string("tangled.mesh")}) {
    const Run run = place.run("optimize " + words + " --force -o o.mesh --report r.json --progress none");
    INFO(words << ": " << run.err);
    const auto report = place.json("r.json");
    const double mean = report.at("distance").at("mean_percent"), max = report.at("distance").at("max_percent");
    const auto& options = report.at("options");
    const bool within = mean <= options.at("tolerance") && max <= options.at("max-tolerance");
    CHECK(report.at("converged") == within);
    CHECK(run.status == (within ? 0 : 4));
    char figure[40];
    std::snprintf(figure, sizeof figure, within ? "boundary within %.4g %%" : "largest %.4g %%", max);
    CHECK(report.at("explanation").get<std::string>().find(figure) != std::string::npos);
  }
}

TEST_CASE("A fit of curved cells converges only where its file is within the tolerance", "[cli][slow]") {
  const Workplace place;
  const std::string fit = "fit target.off --template template.mesh --order 3 --force --progress none -o c.vtu ";
  place.run(fit + "--report r.json");
  const double reached = place.json("r.json").at("distance").at("mean_percent");
  for (const double share : {0.9, 0.99, 1.01, 1.5}) {
    const Run run = place.run(fit + "--report r.json --tolerance " + std::to_string(share * reached));
    const auto report = place.json("r.json");
    INFO(share << ": " << run.err);
    const bool within = report.at("distance").at("mean_percent") <= report.at("options").at("tolerance");
    CHECK((run.status == 0 || run.status == 4));
    CHECK(report.at("converged") == (run.status == 0));
    CHECK((within || run.status == 4));
  }
}

TEST_CASE("optimize curves a straight mesh to a surface", "[cli][slow]") {
  const Workplace place;
  const Run run = place.run(
      "optimize template.mesh --target target.off --order 2 --tolerance 0.5 -o curved.vtu --report report.json "
      "--progress none");
  INFO(run.err);
  CHECK(run.status == 0);
  const nlohmann::json report = place.json("report.json");
  CHECK(report["command"] == "optimize");
  CHECK(report["orders"]["max"] == 2);
  CHECK(report["valid"] == true);
  CHECK(report["distance"]["mean_percent"] < 0.5);
  // Seven cells of order 2 cannot come closer.
  CHECK(place.run("optimize template.mesh --target target.off --order 2 -o b.vtu --progress none").status == 4);
}

TEST_CASE("The report of optimize has the same entries for straight and for curved cells", "[cli][slow]") {
  const Workplace place;
  const std::string optimize = "optimize template.mesh --target target.off --max-iterations 1 ";
  place.run(optimize + "-o straight.mesh --report straight.json");
  place.run(optimize + "--order 2 -o curved.vtu --report curved.json");
  const nlohmann::json straight = place.json("straight.json"), curved = place.json("curved.json");
  for (const auto& [entry, value] : straight.items()) {
    INFO(entry);
    if (entry != "topology") CHECK(curved.contains(entry));  // of straight cells only
  }
  for (const char* entry : {"mesh", "target", "quality"}) CHECK(curved.at("input").contains(entry));
  CHECK(curved.at("input").at("mesh") == straight.at("input").at("mesh"));
  CHECK(curved.at("input").at("quality") == straight.at("input").at("quality"));
  CHECK(curved.at("seconds").contains("untangle"));
  CHECK(curved.at("not_certified_cells").empty());
  for (const auto& report : {straight, curved}) CHECK(report.at("initial_distance").at("mean_percent") > 1);
  CHECK(curved.at("options").at("lambda") == 0.0025);
  CHECK(straight.at("options").contains("max-tolerance"));
  CHECK_FALSE(curved.at("options").contains("max-tolerance"));
}

TEST_CASE("Linear cells in the place of curved ones are judged on their own", "[cli][slow]") {
  const Workplace place;
  const std::string fit = "fit target.off --template template.mesh --order 2 --max-iterations 3 --progress none ";
  place.run(fit + "-o both.vtu --report curved.json");
  const nlohmann::json curved = place.json("curved.json");
  CHECK_FALSE(curved.contains("linear_cells"));
  const double mean = curved.at("distance").at("mean_percent");
  const std::string tolerance = "--tolerance " + std::to_string(1.05 * mean) + ' ';
  CHECK(place.run(fit + tolerance + "-o a.vtu -o a.mesh --report a.json").status == 0);
  const Run alone = place.run(fit + tolerance + "-o b.mesh --report b.json");
  CHECK(alone.status == 4);  // their chords are farther off
  const nlohmann::json a = place.json("a.json"), b = place.json("b.json");
  CHECK(a.at("linear_cells") == b.at("linear_cells"));
  CHECK(a.at("linear_cells").at("valid") == true);
  CHECK(a.at("linear_cells").at("distance").at("mean_percent") > 1.05 * mean);
  CHECK(b.at("stop_reason") == "tolerance_missed");
}

TEST_CASE("Templates are made, edited and fitted from the command line", "[cli][templates][slow]") {
  const Workplace place;
  const Run made = place.run("template auto target.off --cells 60 -o made.mesh --report made.json");
  INFO(made.err);
  REQUIRE(made.status == 0);
  const auto report = place.json("made.json");
  CHECK(report.at("command") == "template auto");
  CHECK(report.at("options").at("cells") == 60);
  CHECK(report.at("template").at("topology").at("euler_number") == 1);
  CHECK(report.at("topology").at("boundary_euler_number") == 2);
  CHECK(report.at("valid") == true);

  // Figure 11 of the paper: grid, carve, pillow, fit.
  CHECK(place.run("template grid target.off --size 0.5 -o grid.mesh").status == 0);
  CHECK(place.run("template carve grid.mesh --inside target.off -o carved.mesh").status == 0);
  CHECK(place.run("template pillow carved.mesh -o pillowed.mesh").status == 0);
  const Run fit = place.run("fit target.off --template pillowed.mesh --levels 1 -o fitted.mesh");
  INFO(fit.err);
  CHECK(fit.status == 0);

  CHECK(place.run("template grid --box 0 0 0 2 2 2 --counts 2 2 2 -o box.mesh").status == 0);
  CHECK(place.run("template split box.mesh --edge 0 1 -o split.mesh").status == 0);
  CHECK(subvol::read_volume_mesh(place / "split.mesh").num_cells() == 12);
  CHECK(place.run("template collapse box.mesh --vertices 0 1 -o collapsed.mesh").status == 0);
  CHECK(subvol::read_volume_mesh(place / "collapsed.mesh").num_cells() == 4);
  CHECK(place.run("template split box.mesh --into tets -o tets.mesh").status == 0);
  for (const char* unfitting : {"split box.mesh --into tets --parts 3", "carve box.mesh --list 0 --share 0.3",
                                "split box.mesh --into prisms --edge 0 1 --parts 3"})
    CHECK(place.run("template " + std::string(unfitting) + " -o unfitting.mesh").status == 2);
  CHECK(place.run("template refine box.mesh --box 0 0 0 1 1 1 -o refined.mesh").status == 0);
  CHECK(subvol::read_volume_mesh(place / "refined.mesh").num_cells() == 27 + 3 * 22 + 3 * 11 + 4);
  CHECK(place.run("template refine box.mesh -o x.mesh").status == 2);
  CHECK(place.run("template merge box.mesh -o merged.mesh").status == 0);
  CHECK(place.run("template grid --box 2 0 0 4 2 2 --counts 2 2 2 -o beside.mesh").status == 0);
  CHECK(place.run("template merge box.mesh beside.mesh -o both.mesh").status == 0);
  CHECK(subvol::read_volume_mesh(place / "both.mesh").num_cells() == 16);
  CHECK(place.run("template extrude target.off --thickness 0.01 -o extruded.mesh").status == 0);

  CHECK(place.run("template").status == 2);
  CHECK(place.run("template grid -o x.mesh").status == 2);
  CHECK(place.run("template carve box.mesh -o x.mesh").status == 2);
  CHECK(place.run("template auto target.off --cells 3 -o x.mesh").status == 2);
  CHECK(place.run("template pillow box.mesh --list 8 -o x.mesh").status == 3);
  CHECK(place.run("template collapse box.mesh --what edge --vertices 0 1 -o x.mesh").status == 3);
  CHECK(!place.has("x.mesh"));
}

TEST_CASE("A fit without a template fills the surface and says how good the cells are", "[cli][templates][slow]") {
  const Workplace place;
  const Run run = place.run("fit target.off --cells 1500 -o out.mesh -o out.glb --report report.json");
  INFO(run.err);
  REQUIRE(run.status == 0);
  const auto report = place.json("report.json");
  CHECK(report.at("valid") == true);
  CHECK(report.at("quality").at("min_scaled_jacobian") > 0.5);
  const auto& trials = report.at("template").at("trials");
  CHECK(trials.at(report.at("template").at("chosen").get<std::size_t>()).at("cells") <= 1500);
  CHECK(place.run("fit target.off --cells 300 --quality-floor 0.99 -o x.mesh").status == 4);
  CHECK(place.run("fit target.off --crease-angle sharp -o x.mesh").status == 2);
  CHECK(place.run("fit target.off --cage-only --max-tolerance 1 -o x.mesh").status == 2);
  CHECK(place.run("fit target.off --quality 0.95 -o x.mesh").status == 2);
  CHECK(place.run("fit target.off --cage-only --size 1 -o tiny.mesh").status == 2);
  const Run too_small = place.run("fit target.off --size 1e-9 -o tiny.mesh");
  CHECK(too_small.status == 2);
  CHECK(too_small.err.find("--size 1e-09: the target would need") != std::string::npos);
}

TEST_CASE("A fit without a template makes a cage if one is asked for", "[cli][templates][slow]") {
  const Workplace place;
  const Run run = place.run(
      "fit target.off --cells 4000 -o cage:cage.mesh -o cage:cage.usda -o out.mesh -o out.glb "
      "-o animation:steps.glb --report report.json");
  INFO(run.err);
  REQUIRE(run.status == 0);
  const auto report = place.json("report.json");
  CHECK(report.at("valid") == true);
  CHECK(report.at("quality").at("min_scaled_jacobian") > 0.5);
  CHECK(report.at("limit_surface_distance").at("max_percent") < 0.5);
  CHECK(report.at("cage").at("cells").get<std::size_t>() * 8 == report.at("quality").at("cells").get<std::size_t>());
  CHECK(report.at("audit").contains("warnings"));
  CHECK(run.err.find("limit surface to target") != std::string::npos);
  CHECK(subvol::read_volume_mesh(place / "cage.mesh").num_cells() == report.at("cage").at("cells"));
  for (const char* name : {"cage.usda", "out.glb", "steps.glb"}) CHECK(place.has(name));
}

TEST_CASE("A surface alone is enough for a fit", "[cli][templates][slow]") {
  const Workplace place;
  place.file("options.toml", "[template.auto]\ncells = 50\n[fit]\ncells = 400\nlevels = 1\nmax-tolerance = 2\n");
  const Run run = place.run("fit target.off --config options.toml -o out.mesh --report report.json");
  INFO(run.err);
  REQUIRE(run.status == 0);
  const auto report = place.json("report.json");
  CHECK(report.at("template").at("trials").size() >= 1);
  CHECK(report.at("template").at("handles") == 0);
  CHECK(report.at("topology").at("boundary_euler_number") == 2);
  CHECK(report.at("distance").at("mean_percent") < 0.5);
  // So few faces are more than 1 % off, which costs the status unless it is allowed.
  const Run coarse = place.run("fit target.off --cells 400 --levels 1 -o coarse.mesh");
  CHECK(coarse.status == 4);
  CHECK(coarse.err.find("the largest distance is above 1 % of the diagonal") != std::string::npos);
  CHECK(place.has("coarse.mesh"));
  CHECK(place.run("template auto target.off --config options.toml -o auto.mesh --report auto.json").status == 0);
  CHECK(place.json("auto.json").at("options").at("cells") == 50);
  CHECK(place.run("fit target.off --order 1 --cells 27 -o out.vtu").status == 0);
  CHECK(place.run("fit target.off --template template.mesh --cells 60 -o x.mesh").status == 2);
}

TEST_CASE("check of a surface tells whether it can be filled", "[cli][slow]") {
  const subvol::test::Workplace place;
  const subvol::test::Run closed = place.run("check target.off --report r.json");
  CAPTURE(closed.err);
  CHECK(closed.status == 0);
  CHECK(closed.out.find("can be filled as it is") != std::string::npos);
  CHECK(place.json("r.json")["fillable"] == true);
  place.file("open.off", "OFF\n4 3 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n");
  const subvol::test::Run open = place.run("check open.off --json");
  CHECK(open.status == 1);
  CHECK(nlohmann::json::parse(open.out)["findings"]["open_rim"]["count"] == 1);
  CHECK(place.run("check open.off --target target.off").status == 2);
  // The check also says what a fit would do: it refuses the tetrahedron, whose cover would be larger than half of the
  // rest, and covers the box.
  CHECK(nlohmann::json::parse(open.out)["filling"]["refused"].is_string());
  CHECK_THAT(place.run("check open.off").out, Catch::Contains("a fit refuses it:   1 hole"));
  place.file("box.off",
             "OFF\n8 10 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n"
             "3 0 2 1\n3 0 3 2\n3 0 1 5\n3 0 5 4\n3 1 2 6\n3 1 6 5\n3 2 3 7\n3 2 7 6\n3 3 0 4\n3 3 4 7\n");
  CHECK_THAT(place.run("check box.off").out, Catch::Contains("a fit repairs it:   1 hole is covered"));
  CHECK(nlohmann::json::parse(place.run("check box.off --json").out)["filling"]["complete"] == true);
  const subvol::test::Run late = place.run("template auto target.off --cells 100000 --time-limit 0.2 -o late.mesh");
  CHECK(late.status == 4);
  CHECK(late.err.find("time limit") != std::string::npos);
  CHECK(!place.has("late.mesh"));
}

TEST_CASE("A fin is left out before a surface is filled, and told", "[cli][slow]") {
  const Workplace place;
  // A cube, and a sheet that stands on one of its edges.
  place.file("fin.off",
             "OFF\n9 13 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n2 0 2\n"
             "3 0 2 1\n3 0 3 2\n3 4 5 6\n3 4 6 7\n3 0 1 5\n3 0 5 4\n3 1 2 6\n3 1 6 5\n3 2 3 7\n3 2 7 6\n"
             "3 3 0 4\n3 3 4 7\n3 1 5 8\n");
  const Run run = place.run("fit fin.off -o cube.mesh --report cube.json");
  CHECK(run.status == 0);
  CHECK_THAT(run.err, Catch::Contains("1 triangle of fins left out, with 7.69 % of the surface's area"));
  CHECK(place.json("cube.json")["volume"].get<double>() == Approx(1));
  CHECK(place.run("fit fin.off --wrap 2 --cells 500 --crease-angle none --max-tolerance 5 -o a.mesh --report r.json")
            .status == 0);
  CHECK(place.json("r.json")["valid"] == true);
  CHECK(place.json("r.json")["volume"].get<double>() == Approx(1).epsilon(0.05));
  CHECK_THAT(place.json("r.json")["repairs"][0].get<std::string>(), Catch::StartsWith("target: wrapped"));
  CHECK(place.run("template auto fin.off --wrap 2 -o b.mesh").status == 0);
  CHECK(place.run("fit fin.off --wrap 0 -o c.mesh").status == 2);
  CHECK(place.run("fit fin.off --wrap 2 --regions keep -o c.mesh").status == 2);
}

TEST_CASE("A target without a template is repaired, whatever is fitted", "[cli][slow]") {
  // A cube without its top.
  const Workplace place;
  place.file("open.off",
             "OFF\n8 10 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n"
             "3 0 2 1\n3 0 3 2\n3 0 1 5\n3 0 5 4\n3 1 2 6\n3 1 6 5\n3 2 3 7\n3 2 7 6\n3 3 0 4\n3 3 4 7\n");
  for (const char* options : {"--cells 300", "--order 2 --cells 100", "--levels 1 -o cage:cage.mesh"}) {
    const Run run = place.run("fit open.off -o a.mesh --report r.json --force " + std::string(options));
    CAPTURE(options, run.err);
    CHECK(run.status == 0);
    CHECK_THAT(run.err, Catch::Contains("1 hole is covered, with 20 % of the surface's area"));
    CHECK(place.json("r.json")["volume"].get<double>() == Approx(1).epsilon(1e-3));
  }
}
