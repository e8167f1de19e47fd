// SPDX-License-Identifier: GPL-3.0-or-later
// Fits to a template as users of the program run them: files in, files out, exit status.

#include "samples/shapes.h"
#include "subvol/io/mesh_io.h"
#include "subvol/mesh/mesh_topology.h"
#include "tests/support/carved_torus.h"
#include "tests/support/glb_reader.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/workplace.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <chrono>
#include <string>
#include <thread>
#include <utility>

#include <signal.h>
#include <sys/types.h>

using subvol::test::content_of;
using subvol::test::kFit;
using subvol::test::Run;
using subvol::test::Workplace;

TEST_CASE("A fit goes from files to a .glb, a cage and a report that tells the truth", "[cli][slow]") {
  const Workplace place;
  const Run run =
      place.run(kFit + "--levels 2 -o out.glb -o out.mesh -o cage:cage.mesh -o cage:cage.usda --report report.json");
  INFO(run.err);
  REQUIRE(run.status == 0);
  CHECK(run.out.empty());

  const subvol::VolumeMesh mesh = subvol::read_volume_mesh(place / "out.mesh");
  CHECK(mesh.num_cells() == 7 * 64);
  CHECK(subvol::read_volume_mesh(place / "cage.mesh").num_cells() == 7 * 8);

  const subvol_tests::GlbFile glb(content_of(place / "out.glb"));
  CHECK(glb.primitive("surface").at("attributes").contains("_SCALED_JACOBIAN"));
  CHECK(glb.attribute<float>("surface", "POSITION").size() % 3 == 0);

  const auto report = place.json("report.json");
  CHECK(report.at("command") == "fit");
  CHECK(report.at("converged") == true);
  CHECK(report.at("stop_reason") == "converged");
  CHECK(report.at("options").at("levels") == 2);
  CHECK(report.at("quality").at("cells") == 7 * 64);
  CHECK(report.at("quality").at("certified_cells") == 7 * 64);
  CHECK(report.at("quality").at("inverted_cells") == 0);
  CHECK(report.at("quality").at("histogram").size() == 20);
  CHECK(report.at("boundary_self_intersections") == 0);
  CHECK(report.at("limit_surface_distance").at("mean_percent") < report.at("initial_distance").at("mean_percent"));
  CHECK(report.at("limit_surface_distance").at("mean_percent") < 0.5);
  CHECK(report.at("distance").at("max_percent") < 5);
  CHECK(report.at("peak_memory_bytes") > 1'000'000);
  CHECK(report.at("seconds").at("total") > 0);
  CHECK(report.at("outputs").size() == 4);
  REQUIRE(!report.at("stages").empty());
  for (const auto& stage : report.at("stages")) {
    for (const char* key : {"name", "level", "lambda", "iterations", "evaluations", "seconds"})
      CHECK(stage.contains(key));
  }
  CHECK(report.at("stages").back().at("energy").at("total") > 0);
}

TEST_CASE("A fit that writes cells and no cage frees poor ones from the cage, and says so", "[cli][slow]") {
  const Workplace place(subvol::test::carved_torus_sample());
  const auto fitted = [&](const std::string& options) {
    const Run run = place.run(kFit + "--levels 1 --force -o out.mesh --report r.json " + options);
    INFO(run.err);
    CHECK(run.status == 0);
    return place.json("r.json");
  };
  const auto kept = fitted("-o cage:cage.mesh"), freed = fitted("-o out.glb");
  CHECK(kept.contains("cage"));
  for (const char* key : {"cage", "limit_surface_distance"}) CHECK_FALSE(freed.contains(key));
  CHECK(freed.contains("audit"));
  CHECK(kept.at("explanation").get<std::string>().find("freed") == std::string::npos);
  CHECK(freed.at("explanation").get<std::string>().find("freed from the cage") != std::string::npos);
  CHECK(freed.at("seconds").contains("freeing"));
  const auto warns_of_flat_edges = [](const auto& report) {
    return report.at("warnings").dump().find("flatten") != std::string::npos;
  };
  CHECK(warns_of_flat_edges(kept));
  CHECK_FALSE(warns_of_flat_edges(freed));
  const auto least = [](const auto& report) {
    return report.at("quality").at("min_scaled_jacobian").template get<double>();
  };
  CHECK(least(freed) > 0.5);
  CHECK(least(kept) < 0.3);
  for (const char* need : {"-o cage:cage.mesh", "--surface limit", "--cage-only", "-o animation:a.html"})
    CHECK(fitted(need).contains("cage"));
  CHECK(place.run(kFit + "--levels 1 --force -o out.glb --report r.json").status == 0);
  CHECK(place.json("r.json").contains("cage"));  // a scene shows the limit surface
}

TEST_CASE("A fit that frees its mesh goes on where it was ended", "[cli][slow]") {
  const Workplace place(subvol::test::carved_torus_sample());
  const std::string fit = kFit + "--levels 1 ";
  REQUIRE(place.run(fit + "-o whole.mesh --checkpoint c --every 0").status == 0);
  REQUIRE(place.run(fit + "-o again.mesh --resume c").status == 0);
  CHECK(content_of(place / "whole.mesh") == content_of(place / "again.mesh"));
  const Run other = place.run(fit + "-o other.mesh -o cage:cage.mesh --resume c");
  INFO(other.err);
  CHECK(other.status == 3);
  CHECK(other.err.find("outputs") != std::string::npos);
}

TEST_CASE("A tolerance that is missed ends with status 4 and the best result", "[cli][slow]") {
  const Workplace place;
  const Run run = place.run(kFit + "--levels 1 --tolerance 0.000001 -o out.mesh --report report.json");
  INFO(run.err);
  CHECK(run.status == 4);
  CHECK(place.has("out.mesh"));
  CHECK(place.json("report.json").at("converged") == false);
}

TEST_CASE("A fit converges only where its file and its limit surface are within the tolerance", "[cli][slow]") {
  const Workplace place;
  const std::string fit = kFit + "--levels 1 --chord 5 --force -o out.mesh -o cage:c.mesh -o out.glb --report r.json ";
  const auto farthest = [](const nlohmann::json& report) {
    const auto& limit = report.at("limit_surface_distance");
    CHECK(limit.at("chord_error_percent") < 0.01);  // whatever the scene's are
    const double of_mesh = report.at("distance").at("mean_percent"), of_limit = limit.at("mean_percent");
    return std::max(of_mesh, of_limit);
  };
  place.run(fit);
  const double reached = farthest(place.json("r.json"));
  for (const double share : {0.9, 0.99, 1.01, 1.5}) {
    const Run run = place.run(fit + "--tolerance " + std::to_string(share * reached));
    const auto report = place.json("r.json");
    INFO(share << ": " << run.err);
    CHECK((run.status == 0 || run.status == 4));
    CHECK(report.at("converged") == (run.status == 0));
    CHECK((farthest(report) <= report.at("options").at("tolerance") || run.status == 4));
  }
}

TEST_CASE("A time limit ends with status 4 and the best result", "[cli][slow]") {
  const Workplace place;
  const Run run = place.run(kFit + "--levels 3 --time-limit 0.01 -o out.mesh --report report.json");
  INFO(run.err);
  CHECK(run.status == 4);
  CHECK(place.has("out.mesh"));
  CHECK(place.json("report.json").at("stop_reason") == "time_limit");
}

TEST_CASE("Ctrl-C ends a fit with the best result and status 130", "[cli][slow]") {
  const Workplace place(subvol::samples::torus_sample());
  const pid_t child = place.start(kFit + "--levels 4 --progress json -o out.mesh --report report.json");
  // The first line of progress says that the fit is under way.
  for (int i = 0; i < 600 && content_of(place / "stdout.txt").empty(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  kill(child, SIGINT);
  const Run run = place.finish(child);
  INFO(run.err);
  CHECK(run.status == 130);
  CHECK(place.has("out.mesh"));
  CHECK(place.json("report.json").at("stop_reason") == "cancelled");
}

TEST_CASE("A fit is the same bits for one thread and for two", "[cli][slow]") {
  const Workplace place;
  REQUIRE(place.run(kFit + "--levels 1 --threads 1 -o one.mesh -o one.obj").status == 0);
  REQUIRE(place.run(kFit + "--levels 1 --threads 2 -o two.mesh -o two.obj").status == 0);
  CHECK(content_of(place / "one.mesh") == content_of(place / "two.mesh"));
  CHECK(content_of(place / "one.obj") == content_of(place / "two.obj"));
}

TEST_CASE("Tuned numbers can be set for an experiment", "[cli]") {
  const Workplace place;
  const std::string fit = kFit + "--levels 1 -o out.mesh --report report.json --force ";
  REQUIRE(place.run(fit + "--tune fitting.coarse_lambda=0.02 --tune quality.max_margin=0.9").status == 0);
  const auto report = place.json("report.json");
  CHECK(report.at("options").at("tune") ==
        nlohmann::json::array({"fitting.coarse_lambda=0.02", "quality.max_margin=0.9"}));
  CHECK(report.at("stages").at(0).at("lambda") == 0.02);
  REQUIRE(place.run(kFit + "--order 2 -o out.vtu --report report.json --force --tune curved.most_steps=1").status == 0);
  for (const auto& stage : place.json("report.json").at("stages"))
    if (stage.at("name") == "order 2, lambda 0.05, tangential weight 0.003") CHECK(stage.at("iterations") == 1);
  REQUIRE(
      place
          .run("optimize template.mesh -o best.mesh --report report.json --force --tune optimize.first_round_steps=1 "
               "--tune optimize.most_rounds=1")
          .status == 0);
  for (const auto& stage : place.json("report.json").at("stages"))
    CHECK(stage.at("name").get<std::string>().find("round 2") == std::string::npos);
  const auto refused = [&](const char* number, const char* reason) {
    const Run run = place.run(kFit + "-o no.mesh --tune " + number);
    INFO(run.err);
    CHECK(run.status == 2);
    CHECK(run.err.find(reason) != std::string::npos);
    CHECK(!place.has("no.mesh"));
  };
  refused("fitting.coarse=0.02", "there is no tuned number 'fitting.coarse'");
  refused("fitting.coarse_lambda=2", "it must be from 1e-09 to 0.99");
  refused("fitting.coarse_lambda=nan", "must be NAME=VALUE with a number");
  refused("fitting.coarse_lambda", "must be NAME=VALUE with a number");
}

TEST_CASE("Points are fitted and checked one way, and what makes no sense with them is refused", "[cli][slow]") {
  const auto sample = subvol::samples::ball_sample();
  const Workplace place(sample);
  place.file("points.xyz", subvol::samples::xyz_text(subvol::samples::scattered_points(sample.target, 1500)));
  const std::string fit = "fit points.xyz --template template.mesh ";
  Run run = place.run(fit + "--levels 1 --point-weights area -o out.mesh -o out.glb --report report.json");
  INFO(run.err);
  REQUIRE(run.status == 0);
  CHECK(run.err.find("points to limit surface") != std::string::npos);
  auto report = place.json("report.json");
  CHECK(report.at("input").at("target").at("points") == 1500);
  CHECK(report.at("target").at("points") == 1500);
  CHECK(report.at("distance").at("one_sided") == true);
  CHECK(report.at("limit_surface_distance").at("one_sided") == true);
  CHECK(!report.at("distance").contains("mean_to_target_percent"));
  CHECK(report.at("distance").at("mean_percent") == report.at("distance").at("mean_from_target_percent"));
  CHECK(report.at("limit_surface_distance").at("mean_percent") < 1);

  run = place.run("check out.mesh --target points.xyz --json");
  CHECK(run.status == 0);
  CHECK(nlohmann::json::parse(run.out).at("distance").at("one_sided") == true);
  CHECK(place.run("check out.mesh --target points.xyz").out.find("of points") != std::string::npos);
  CHECK(place.run("report report.json -o page.html").status == 0);

  run = place.run(fit + "--order 2 -o out.vtu --report curved.json");
  CHECK(run.status == 0);
  CHECK(place.json("curved.json").at("distance").at("one_sided") == true);

  const auto refused = [&](const std::string& arguments, int status, const char* reason) {
    const Run failed = place.run(arguments);
    INFO(arguments << '\n' << failed.err);
    CHECK(failed.status == status);
    CHECK(failed.err.find(reason) != std::string::npos);
    CHECK(!place.has("no.mesh"));
  };
  refused("fit points.xyz -o no.mesh", 2, "--template");
  refused(fit + "--crease-angle 40 -o no.mesh", 2, "--crease-angle");
  refused(fit + "--order 2 --crease-angle 40 -o no.vtu", 2, "--crease-angle");
  refused(fit + "--correspondence voronoi -o no.mesh", 2, "voronoi");
  refused(fit + "--order 2 --correspondence voronoi -o no.vtu", 2, "voronoi");
  refused(kFit + "--point-weights area -o no.mesh", 2, "--point-weights");
  refused("optimize template.mesh --target points.xyz -o no.mesh", 3, "points without faces");
  refused("optimize template.mesh --order 2 --target points.xyz -o no.vtu", 3, "points without faces");
  refused("template auto points.xyz -o no.mesh", 3, "points without faces");
  refused("check points.xyz", 3, "only as the target of `fit --template` and `check --target`");
}

TEST_CASE("A template with a few inverted cells is untangled before a fit, a mirrored one is refused", "[cli][slow]") {
  auto sample = subvol::samples::torus_sample();
  subvol::VolumeMesh& mesh = sample.template_mesh;
  const subvol::MeshTopology topology(mesh);
  const auto cell = mesh.cell(0);
  for (std::size_t corner = 0; corner < 8; ++corner) {  // one inner vertex beyond the middle of one cell
    if (topology.is_boundary_vertex(cell[corner])) continue;
    const std::size_t opposite = corner < 4 ? 4 + (corner + 2) % 4 : (corner + 2) % 4;
    mesh.positions[cell[corner]] += 0.75 * (mesh.positions[cell[opposite]] - mesh.positions[cell[corner]]);
    break;
  }
  const Workplace place(sample);
  const Run run = place.run(kFit + "--levels 1 -o out.mesh");
  INFO(run.err);
  CHECK(run.status == 0);
  CHECK(run.err.find("untangled") != std::string::npos);
  CHECK(place.run("check out.mesh").status == 0);
  for (const char* words : {"--levels 1 -o late.mesh", "--order 2 -o late.vtu"}) {
    const Run late = place.run(kFit + "--time-limit 0.001 " + words);
    INFO(late.err);
    CHECK(late.status == 4);
    CHECK(late.err.find("there is nothing to write") != std::string::npos);
  }
  for (subvol::Vec3& p : sample.template_mesh.positions) p.x() = -p.x();
  const Workplace mirrored(sample);
  CHECK(mirrored.run(kFit + "--levels 1 -o out.mesh").status == 3);
}

TEST_CASE("The report tells the state of a target and whether the template can become it", "[cli][slow]") {
  auto sample = subvol::samples::torus_sample();
  sample.template_mesh = subvol::samples::ball_sample().template_mesh;
  std::swap(sample.target.triangles[5][0], sample.target.triangles[5][1]);
  const Workplace place(sample);
  const Run run = place.run(kFit + "--levels 1 --max-iterations 1 -o out.mesh --report report.json");
  CHECK(run.err.find("topology differs") != std::string::npos);
  const auto target = place.json("report.json").at("target");
  CHECK(target.at("turned_edges") == 3);
  CHECK(target.at("closed_manifold") == true);
  CHECK(target.at("same_topology") == false);
  CHECK(target.at("topology").at("handles") == 1);
  CHECK(target.at("volume_source") == "mended surface");
}

TEST_CASE("Curved cells keep sharp edges, and the report says how far off they are", "[cli][slow]") {
  const Workplace place;
  subvol::write_volume_mesh(place / "cube.mesh", subvol::test::lattice(2, 2, 2));
  for (const std::string verb : {"fit cube.mesh --template cube.mesh", "optimize cube.mesh --target cube.mesh"}) {
    const Run run = place.run(verb + " --crease-angle 40 --order 2 -o out.vtu --report report.json --force");
    INFO(run.err);
    CHECK(run.status == 0);
    CHECK(run.err.find("creases follow 12 of 12 curves") != std::string::npos);
    const auto report = place.json("report.json");
    CHECK(report.at("creases").at("followed_curves") == 12);
    CHECK(report.at("creases").at("max_percent") < 1e-3);
    CHECK(report.at("options").at(verb.starts_with("fit") ? "lambda-close" : "lambda") == 0.0025);
  }
}

TEST_CASE("A fit of curved elements goes from files to files that check agrees with", "[cli][slow]") {
  const Workplace place;
  const Run run = place.run(kFit + "--order 3 -o out.vtu -o out.glb -o out.mesh --report report.json");
  INFO(run.err);
  REQUIRE(run.status == 0);
  const auto report = place.json("report.json");
  CHECK(report.at("converged") == true);
  CHECK(report.at("stages").back().at("order") == 3);
  CHECK(report.at("orders").at("max") == 3);
  CHECK(report.at("quality").at("certified_cells") == report.at("quality").at("cells"));
  CHECK(report.at("distance").at("mean_percent") <
        0.2 * report.at("initial_distance").at("mean_percent").get<double>());
  const Run checked = place.run("check out.vtu --target target.off --json");
  CHECK(checked.status == 0);
  CHECK(nlohmann::json::parse(checked.out).at("distance") == report.at("distance"));
}

TEST_CASE("An adaptive fit goes from files to files", "[cli][slow]") {
  const Workplace place;
  const Run run =
      place.run(kFit + "--order 3 --adaptive --tolerance 1 -o out.vtu -o out.glb -o out.mesh --report report.json");
  INFO(run.err);
  REQUIRE(run.status == 0);
  const auto orders = place.json("report.json").at("orders");
  CHECK(orders.at("nodes") <= orders.at("full_order_nodes"));
  CHECK(place.run("check out.vtu --target target.off").status == 0);
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
