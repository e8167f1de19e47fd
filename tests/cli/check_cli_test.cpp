// SPDX-License-Identifier: GPL-3.0-or-later
// Tests what `check` says of meshes, curved meshes and surfaces.

#include "subvol/export/high_order_file.h"
#include "subvol/io/mesh_io.h"
#include "tests/support/glb_reader.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/workplace.h"

#include <catch2/catch.hpp>

#include <filesystem>
#include <string>

using subvol::test::content_of;
using subvol::test::Run;
using subvol::test::Workplace;

TEST_CASE("check says what is wrong with a mesh, in words and in JSON", "[slow][cli]") {
  const Workplace place;
  const Run words = place.run("check template.mesh --target target.off");
  CHECK(words.status == 0);
  CHECK(!words.out.empty());
  const Run run = place.run("check template.mesh --target target.off --json --report report.json");
  CHECK(run.status == 0);
  const auto json = nlohmann::json::parse(run.out);
  CHECK(json == place.json("report.json"));
  CHECK(json.at("valid") == true);
  CHECK(json.at("quality").at("certified_cells") == 7);
  CHECK(json.at("distance").at("mean_percent") > 0);

  subvol::VolumeMesh inverted = subvol::read_volume_mesh(place / "template.mesh");
  for (subvol::Vec3& p : inverted.positions) p.x() = -p.x();
  subvol::write_volume_mesh(place / "inverted.mesh", inverted);
  const Run bad = place.run("check inverted.mesh --json");
  CHECK(bad.status == 1);
  CHECK(nlohmann::json::parse(bad.out).at("quality").at("inverted_cells") == 7);
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
  const auto found = nlohmann::json::parse(place.run("check spare.mesh --json").out);
  CHECK(found.at("valid") == true);
  CHECK(found.at("defects").empty());
  CHECK(found.at("unused_vertices").size() == 24);
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
