// SPDX-License-Identifier: GPL-3.0-or-later
// Templates made from the command line, and fits without a template.

#include "subvol/io/mesh_io.h"
#include "tests/support/workplace.h"

#include <catch2/catch.hpp>

#include <string>

using subvol::test::Run;
using subvol::test::Workplace;

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
