// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes of several regions, as their users run them through the verbs.

#include "cli/runs/loading.h"
#include "subvol/export/surface_writer.h"
#include "subvol/io/mesh_io.h"
#include "subvol/surface/boundary.h"
#include "tests/support/region_fixtures.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/workplace.h"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include <string>
#include <vector>

using subvol::test::content_of;
using subvol::test::Run;
using subvol::test::Workplace;

namespace {

/// Two layers of eight cells each.
subvol::VolumeMesh two_layers() {
  subvol::VolumeMesh mesh = subvol::test::lattice(2, 2, 4);
  for (int c = 0; c < 16; ++c) mesh.references.push_back(c < 8 ? 3 : 8);
  return mesh;
}

}  // namespace

TEST_CASE("A name that several regions have is refused with their numbers, and a number is one") {
  const std::vector<subvol::Group> regions{{"core", 3, 3}, {"shell", 4, 3}, {"core", 5, 3}, {"4", 6, 3}};
  CHECK(subvol::cli::number_of_region(regions, "shell", "--region") == 4);
  CHECK(subvol::cli::number_of_region(regions, "4", "--region") == 4);
  CHECK(subvol::cli::number_of_region(regions, "5", "--region") == 5);
  CHECK_THROWS_WITH(subvol::cli::number_of_region(regions, "core", "--region"),
                    Catch::Contains("--region") && Catch::Contains("3, 5") && Catch::Contains("number"));
}

TEST_CASE("the verbs keep regions and report their volumes", "[cli][regions][slow]") {
  const Workplace place;
  subvol::write_volume_mesh(place / "layers.mesh", two_layers());
  for (const char* command :
       {"subdivide layers.mesh --crease-angle 40 -o out.mesh --report r.json --force",
        "optimize layers.mesh -o out.mesh -o region:8:top.mesh --report r.json --force",
        "fit layers.mesh --template layers.mesh --levels 1 --crease-angle 40 -o out.mesh -o region:8:top.mesh --report "
        "r.json --force"}) {
    CAPTURE(command);
    const Run run = place.run(command);
    INFO(run.err);
    REQUIRE(run.status == 0);
    const auto report = nlohmann::json::parse(content_of(place / "r.json"));
    const auto& regions = report.at("regions").at("cells");
    REQUIRE(regions.size() == 2);
    CHECK(regions[0].at("reference") == 3);
    CHECK(regions[0].at("volume").get<double>() == Approx(8).epsilon(1e-3));
    CHECK(regions[1].at("volume").get<double>() == Approx(8).epsilon(1e-3));
    REQUIRE(report.at("regions").at("interfaces").size() == 1);
    if (std::string(command).find("region:8") != std::string::npos)
      CHECK(subvol::read_volume_mesh(place / "top.mesh").num_cells() ==
            subvol::read_volume_mesh(place / "out.mesh").num_cells() / 2);
    CHECK(report.at("regions").at("interfaces")[0].at("area").get<double>() == Approx(4).epsilon(1e-3));
  }
  const Run check = place.run("check layers.mesh");
  CHECK(check.status == 0);
  CHECK(check.out.find("interface           between 3 and 8: 4 faces, area 4") != std::string::npos);
}

TEST_CASE("subdivide keeps the shape of regions without creases, and warns of those that lose volume",
          "[cli][regions]") {
  const Workplace place;
  subvol::write_volume_mesh(place / "layers.mesh", two_layers());
  const Run kept = place.run("subdivide layers.mesh -o out.mesh --report r.json");
  CHECK(kept.status == 0);
  CHECK_THAT(kept.err, Catch::Contains("cells are only split") && Catch::Contains("--boundary catmull-clark"));
  const auto report = nlohmann::json::parse(content_of(place / "r.json"));
  CHECK(report.at("regions").at("cells")[0].at("volume").get<double>() == Approx(8));
  const Run rounded = place.run("subdivide layers.mesh --boundary catmull-clark -o out.mesh --force");
  CHECK(rounded.status == 0);
  CHECK_THAT(rounded.err, Catch::Contains("the volume of region 3 is") &&
                              Catch::Contains("in the control mesh it is 8") &&
                              Catch::Contains("the volume of region 8 is") && Catch::Contains("--crease-angle"));
  for (const char* option : {"--crease-angle 40", "--boundary linear"}) {
    const Run run = place.run("subdivide layers.mesh -o out.mesh --force " + std::string(option));
    CAPTURE(option, run.err);
    CHECK(run.status == 0);
    CHECK(run.err.find("the volume of") == std::string::npos);
  }
}

TEST_CASE("convert writes one region, and lists the regions if there is no such one", "[cli][regions]") {
  const Workplace place;
  subvol::write_volume_mesh(place / "layers.mesh", two_layers());
  REQUIRE(place.run("convert layers.mesh --region 8 -o core.mesh").status == 0);
  const subvol::VolumeMesh core = subvol::read_volume_mesh(place / "core.mesh");
  CHECK(core.num_cells() == 8);
  CHECK(core.references == std::vector<int>(8, 8));
  const Run unknown = place.run("convert layers.mesh --region bone -o bone.mesh");
  CHECK(unknown.status == 2);
  CHECK(unknown.err.find("3 (") != std::string::npos);
  CHECK(unknown.err.find("8 (") != std::string::npos);
}

TEST_CASE("the cage of a mesh with regions is sharp where interfaces reach its boundary", "[cli][regions]") {
  const Workplace place;
  subvol::write_volume_mesh(place / "layers.mesh", two_layers());
  REQUIRE(place.run("convert layers.mesh -o cage.usda").status == 0);
  CHECK(content_of(place / "cage.usda").find("creaseIndices") != std::string::npos);
}

TEST_CASE("merge keeps regions of two meshes apart and warns of numbers and names that both have", "[cli][regions]") {
  const Workplace place;
  subvol::VolumeMesh below = subvol::test::lattice(1, 1, 1), above = below;
  below.references = above.references = {1};
  below.regions = {{"steel", 1, 3}};
  above.regions = {{"air", 1, 3}};
  for (subvol::Vec3& p : above.positions) p.z() += 1;
  subvol::write_volume_mesh(place / "below.mesh", below);
  subvol::write_volume_mesh(place / "above.mesh", above);
  const Run run = place.run("template merge below.mesh above.mesh -o both.mesh");
  INFO(run.err);
  REQUIRE(run.status == 0);
  CHECK(run.err.find("the region air of the second mesh gets another number") != std::string::npos);
  const subvol::VolumeMesh both = subvol::read_volume_mesh(place / "both.mesh");
  CHECK(both.references == std::vector<int>{1, 2});
  above.regions = below.regions;
  subvol::write_volume_mesh(place / "above.mesh", above);
  const Run same = place.run("template merge below.mesh above.mesh -o both.mesh --force");
  REQUIRE(same.status == 0);
  CHECK(same.err.find("both meshes have the region steel") != std::string::npos);
  CHECK(subvol::read_volume_mesh(place / "both.mesh").references == std::vector<int>{1, 1});
}

TEST_CASE("shell grows layers on the outer surface of regions, or on the boundary of one of them",
          "[slow][cli][regions][shell]") {
  const Workplace place;
  subvol::write_volume_mesh(place / "layers.mesh", two_layers());
  const subvol::TriangleMesh slabs = subvol::test::slabs_surface(2);
  subvol::write_surface(place / "slabs.stl", subvol::as_polygons(slabs));
  const Run outer = place.run("shell slabs.stl --thickness 0.05 -o shell.vtu");
  CHECK(outer.status == 0);
  CHECK_THAT(outer.err, Catch::Contains("2 faces between its 2 regions get no layers") && Catch::Contains("--region"));
  const Run inward = place.run("shell slabs.stl --thickness 0.05 --side inward -o no.vtu");
  CHECK(inward.status == 3);
  CHECK_THAT(inward.err, Catch::Contains("2 regions") && Catch::Contains("--region NAME"));
  for (const char* file : {"slabs.stl", "layers.mesh"}) {
    const std::string region = file[0] == 's' ? "2" : "8";
    const std::string words =
        "shell " + std::string(file) + " --thickness 0.05 --side inward --force -o in.vtu --region ";
    CAPTURE(file);
    CHECK(place.run(words + region).status == 0);
    CHECK(place.run(words + "7").status == 2);
  }
}
