// SPDX-License-Identifier: GPL-3.0-or-later
// The program as its users run it: files in, files out, exit status.

#include "samples/shapes.h"
#include "subvol/io/mesh_io.h"
#include "subvol/mesh/mesh_topology.h"
#include "tests/support/glb_reader.h"
#include "tests/support/require_data.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/usda_reader.h"
#include "tests/support/workplace.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <set>
#include <sstream>
#include <thread>

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

namespace fs = std::filesystem;
using subvol::test::content_of;
using subvol::test::kFit;
using subvol::test::kSanitized;
using subvol::test::Run;
using subvol::test::TemporaryFolder;
using subvol::test::Workplace;

namespace {


}  // namespace

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

TEST_CASE("A report becomes a page that needs nothing else", "[cli][slow]") {
  const Workplace place;
  REQUIRE(place.run(kFit + "--levels 1 -o a&b.mesh -o cage:cage.mesh --report report.json").status == 0);
  const auto words = place.json("report.json").at("command_line");
  CHECK(words.at(1) == "fit");
  const Run run = place.run("report report.json --no-viewer -o page.html");
  INFO(run.err);
  REQUIRE(run.status == 0);
  std::string page = content_of(place / "page.html");
  const std::string picture = "data:image/png;base64,";
  std::size_t pictures = 0;
  for (std::size_t at = page.find(picture); at != std::string::npos; at = page.find(picture, at + 1)) {
    at += picture.size();  // what follows may spell any word
    page.erase(at, page.find('"', at) - at);
    ++pictures;
  }
  CHECK(pictures == 5);
  for (const char* word : {"Valid", "converged", "<svg", "prefers-color-scheme: dark", "a&amp;b.mesh", "Worst cells"})
    CHECK(page.find(word) != std::string::npos);
  for (const char* word : {"<script", "http:", "https:", "a&b", "NaN"}) CHECK(page.find(word) == std::string::npos);

  CHECK(place.run("report report.json -o page.html").status == 2);
  CHECK(place.run("report report.json -o page.htm").status == 2);

  auto other = place.json("report.json");
  other["quality"]["cells"] = 2.9e76;  // no integer of ours
  place.file("other.json", other.dump());
  const Run with_other = place.run("report other.json -o other.html");
  CHECK(with_other.status == 0);
  CHECK(with_other.err.find("no output holds as many cells as the report says") != std::string::npos);

  std::filesystem::remove(place / "a&b.mesh");
  const Run without = place.run("report report.json -o page.html --force");
  CHECK(without.status == 0);
  CHECK(without.err.find("the result is not shown") != std::string::npos);
}

TEST_CASE("What is no report is refused, and nothing is written", "[cli][slow]") {
  const Workplace place;
  const std::string head = R"({"subvol": "1", "command": "fit", )";
  const std::string deep = head + "\"stages\": " + std::string(200000, '[') + std::string(200000, ']') + '}';
  const std::vector<std::string> wrong{
      "", "{", "[]", "null", "{\"subvol\": 1}", R"({"subvol": "1", "command": 7})", deep, head + R"("stages": [{}]})",
      head + R"("stages": [{"history": [3]}]})", head + R"("stages": [{"history": [{}], "name": "a"}]})",
      head + R"("quality": {"cells": "many"}})", head + R"("quality": {"cells": 1, "worst_cells": [{}]}})",
      head + R"("distance": {"mean_percent": 1}})", head + R"("thickness": {"inside": {"asked": {}}}})"};
  for (const std::string& text : wrong) {
    place.file("report.json", text);
    const Run run = place.run("report report.json -o page.html");
    INFO(text.substr(0, 200) << '\n' << run.err);
    CHECK(run.status == 3);
    CHECK(run.err.find("report.json") != std::string::npos);
    CHECK(!std::filesystem::exists(place / "page.html"));
  }
  CHECK(place.run("report none.json -o page.html").status == 3);
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

TEST_CASE("A fit is the same bits for one thread and for two", "[cli][slow]") {
  const Workplace place;
  REQUIRE(place.run(kFit + "--levels 1 --threads 1 -o one.mesh -o one.obj").status == 0);
  REQUIRE(place.run(kFit + "--levels 1 --threads 2 -o two.mesh -o two.obj").status == 0);
  CHECK(content_of(place / "one.mesh") == content_of(place / "two.mesh"));
  CHECK(content_of(place / "one.obj") == content_of(place / "two.obj"));
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
  const std::string fit = kFit + "--levels 1 --chord 5 --force -o out.mesh -o out.glb --report r.json ";
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

TEST_CASE("What stands in no file is refused before any work, and nothing is written", "[cli][slow]") {
  const Workplace place;
  const auto before = place.names();
  const auto refuses = [&](const std::string& arguments, int status, const std::string& word) {
    const Run run = place.run(arguments);
    INFO(arguments << '\n' << run.err);
    CHECK(run.status == status);
    CHECK(run.err.find(word) != std::string::npos);
    CHECK(run.err.find(" s  ") == std::string::npos);  // no progress was told
    CHECK(place.names() == before);
  };
  refuses("", 2, "subcommand");
  refuses("frobnicate", 2, "frobnicate");
  refuses("optimise in.mesh -o out.mesh", 2, "there is no verb 'optimise'; did you mean optimize?");
  refuses("transmogrify", 2, "there is no verb 'transmogrify'; there are: fit");
  refuses("template splt in.mesh -o out.mesh", 2, "there is no verb 'template splt'; did you mean split?");
  refuses("template frobnicate", 2, "there are: auto");
  refuses("--helpp", 2, "there is no option '--helpp'; did you mean --help?");
  refuses("fit --helpp", 2, "did you mean --help?");
  refuses("fit target.off --tolerence 1 -o out.glb", 2, "did you mean --tolerance?");
  refuses("template carve --zzzzzzz", 2, "template carve --help lists them");
  refuses("fit target.off --cells 3 -o out.glb", 2, "--cells");
  refuses("fit target.off --template template.mesh", 2, "-o");
  refuses(kFit + "--levels 0 -o out.glb", 2, "levels");
  refuses(kFit + "--levels 7 -o out.glb", 2, "levels");
  refuses(kFit + "--levels two -o out.glb", 2, "levels");
  refuses(kFit + "--tolerance -1 -o out.glb", 2, "tolerance");
  refuses(kFit + "--tolerance nan -o out.glb", 2, "tolerance");
  refuses(kFit + "--crease-angle 181 -o out.glb", 2, "crease-angle");
  refuses(kFit + "--surface sphere -o out.glb", 2, "surface");
  refuses(kFit + "--solver magic -o out.glb", 2, "solver");
  refuses(kFit + "--progress loud -o out.glb", 2, "progress");
  refuses(kFit + "--threads 0 -o out.glb", 2, "threads");
  refuses(kFit + "--order 17 -o out.glb", 2, "order");
  refuses(kFit + "--order 3 --levels 2 -o out.glb", 2, "levels");
  refuses(kFit + "--basis legendre -o out.glb", 2, "order");
  refuses(kFit + "--adaptive -o out.glb", 2, "order");
  refuses(kFit + "--order 3 --basis spline -o out.glb", 2, "basis");
  refuses(kFit + "--order 3 -o out.usda", 2, "out.usda");
  refuses(kFit + "--order 3 -o cage:out.mesh", 2, "cage");
  refuses(kFit + "--order 10 -o out.msh", 2, "order");
  refuses(kFit + "-o cages:out.mesh", 2, "cages:");
  refuses(kFit + "-o out.mesh --report= target.off", 2, "--report: expected a value");
  refuses(kFit + "-o out.docx", 2, "out.docx");
  refuses(kFit + "-o out", 2, "out");
  refuses(kFit + "-o out.mesh -o ./out.mesh", 2, "twice");
  refuses(kFit + "-o template.mesh", 2, "template.mesh");
  refuses(kFit + "-o out.glb --config none.toml", 2, "none.toml");
  refuses(kFit + "-o nowhere/out.glb", 1, "nowhere/out.glb");
  refuses(kFit + "-o out.glb --report nowhere/report.json", 1, "nowhere/report.json");
  refuses("fit none.off --template template.mesh -o out.glb", 3, "none.off");
  refuses("fit target.off --template none.mesh -o out.glb", 3, "none.mesh");
  refuses("fit target.off --template target.off -o out.glb", 3, "target.off");
  refuses("check none.mesh", 3, "none.mesh");
  refuses("check template.mesh --target none.off", 3, "none.off");
  refuses("convert target.off -o out.mesh", 2, "out.mesh");
  refuses("convert template.mesh -o cage:out.obj", 2, "cage");
  refuses("convert template.mesh", 2, "output");
  refuses("subdivide template.mesh", 2, "-o");
  refuses("subdivide template.mesh --levels 9 -o out.mesh", 2, "levels");
}

TEST_CASE("An output that exists is replaced only with --force", "[cli]") {
  const Workplace place;
  place.file("out.obj", "mine");
  const Run refused = place.run("convert template.mesh -o out.obj");
  CHECK(refused.status == 2);
  CHECK(refused.err.find("out.obj") != std::string::npos);
  CHECK(content_of(place / "out.obj") == "mine");
  CHECK(place.run("convert template.mesh -o out.obj --force").status == 0);
  CHECK(content_of(place / "out.obj") != "mine");
}

TEST_CASE("One file is no two outputs, whatever links lead to it", "[cli]") {
  const Workplace place;
  std::filesystem::create_symlink("a.mesh", place / "b.mesh");
  std::filesystem::create_directory_symlink(".", place / "here");
  for (const char* second : {"-o b.mesh", "--report b.mesh", "-o here/a.mesh"})
    CHECK(place.run(std::string("subdivide template.mesh -o a.mesh --force ") + second).status == 2);
  CHECK_FALSE(place.has("a.mesh"));
}

TEST_CASE("An output that cannot be written does not cost the others", "[cli][slow]") {
  const Workplace place;
  std::filesystem::create_symlink("/dev/full", place / "full.mesh");
  for (const char* verb : {"convert template.mesh", "subdivide template.mesh --report r.json",
                           "optimize template.mesh --max-iterations 1 --report r.json",
                           "fit target.off --template template.mesh --levels 1 --max-iterations 1 --report r.json"}) {
    const Run run = place.run(std::string(verb) + " --force -o full.mesh -o whole.mesh");
    INFO(verb << '\n' << run.err);
    CHECK(run.status == 1);
    CHECK(run.err.find("No space left") != std::string::npos);
    CHECK(subvol::read_volume_mesh(place / "whole.mesh").num_cells() > 0);
    std::filesystem::remove(place / "whole.mesh");
    if (!place.has("r.json")) continue;
    CHECK(place.json("r.json")["outputs"] == nlohmann::json{"whole.mesh"});
    std::filesystem::remove(place / "r.json");
  }
}

TEST_CASE("A name that is too long is found before the work", "[cli]") {
  const Workplace place;
  const Run run = place.run(kFit + "-o " + std::string(300, 'x') + ".mesh");
  CHECK(run.status == 1);
  CHECK(run.err.find(" s  ") == std::string::npos);  // no progress was told
}

TEST_CASE("A file that somebody makes during the work is not replaced without --force", "[cli][slow]") {
  const Workplace place;
  const pid_t child = place.start(kFit + "--levels 1 --progress json -o out.mesh");
  for (int i = 0; i < 600 && content_of(place / "stdout.txt").empty() && content_of(place / "stderr.txt").empty(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  place.file("out.mesh", "precious");
  CHECK(place.finish(child).status == 1);
  CHECK(content_of(place / "out.mesh") == "precious");
}

TEST_CASE("A folder that cannot be written to is found before the work", "[cli]") {
  const Workplace place;
  const Run run = place.run(kFit + "-o /proc/out.mesh");
  CHECK(run.status == 1);
  CHECK(run.err.find("/proc/out.mesh") != std::string::npos);
  CHECK(run.err.find(" s  ") == std::string::npos);  // no progress was told
}

TEST_CASE("Options may come from a file; the command line wins and unknown keys are errors", "[cli]") {
  const Workplace place(subvol::samples::bracket_sample());
  place.file("good.toml", "levels = 1\ntarget = \"unused.off\"\n");
  place.file("marked.toml", "\xEF\xBB\xBF[subdivide]\nlevels = 2\n");  // by an editor that begins files so
  place.file("table.toml", "[subdivide]\nlevels = 2\n[check]\njson = true\n");
  place.file("flat.toml", "levels = 2\n");
  place.file("wrong.toml", "levles = 2\n");
  CHECK(place.run("--config good.toml subdivide template.mesh -o a.mesh").status == 2);
  CHECK(place.run("--config wrong.toml subdivide template.mesh -o a.mesh").status == 2);
  CHECK(!place.has("a.mesh"));
  REQUIRE(place.run("subdivide template.mesh --config flat.toml -o b.mesh").status == 0);
  CHECK(subvol::read_volume_mesh(place / "b.mesh").num_cells() == 10 * 64);
  REQUIRE(place.run("subdivide template.mesh --config table.toml -o c.mesh").status == 0);
  CHECK(subvol::read_volume_mesh(place / "c.mesh").num_cells() == 10 * 64);
  REQUIRE(place.run("subdivide template.mesh --config marked.toml -o e.mesh").status == 0);
  CHECK(content_of(place / "e.mesh") == content_of(place / "c.mesh"));
  REQUIRE(place.run("subdivide template.mesh --config flat.toml --levels 1 -o d.mesh").status == 0);
  CHECK(subvol::read_volume_mesh(place / "d.mesh").num_cells() == 10 * 8);
}

TEST_CASE("Options that have no effect beside others or on the target are told", "[cli]") {
  const Workplace place;
  const Run run = place.run(kFit + "--levels 1 --max-iterations 1 --keep-groups --lambda-far 0.001 -o out.mesh");
  CAPTURE(run.err);
  CHECK(run.err.find("--keep-groups has no effect: the target's faces have no borders") != std::string::npos);
  CHECK(run.err.find("--lambda-far 0.001 has no effect: it is below --lambda-close, 0.005") != std::string::npos);
  std::string points;
  for (int i = 0; i < 64; ++i)
    points += std::to_string(i % 4) + " " + std::to_string(i / 4 % 4) + " " + std::to_string(i / 16) + "\n";
  place.file("points.xyz", points);
  CHECK(place.run("fit points.xyz --template template.mesh --keep-groups -o out.vtu").status == 2);
}

TEST_CASE("A key of a file of options that means nothing is refused with its line, whichever table it is in", "[cli]") {
  const Workplace place(subvol::samples::bracket_sample());
  const std::string grid = "template grid --box 0 0 0 1 1 1 --counts 1 1 1 -o grid.mesh --force --config a.toml";
  const auto refuses = [&](const std::string& text, const std::string& message) {
    place.file("a.toml", text);
    const Run run = place.run(grid);
    CAPTURE(text, run.err);
    CHECK(run.status == 2);
    CHECK(run.err.find(message) != std::string::npos);
  };
  refuses("quiet = true\n\nlevles = 2\n", "a.toml:3: template grid has no option 'levles'");
  refuses("[fit]\ncells = 300\n# more\nlevles = 2\n", "a.toml:4: fit has no option 'levles'");
  refuses("[template.grid]\ncounts = [1,\n1,\n1]\nlevels = 2\n", "a.toml:5: template grid has no option 'levels'");
  refuses("[template]\nquiet = true\n", "a.toml:2: template has no option 'quiet': expected a table of a verb below");
  refuses("[fti]\ncells = 300\n", "a.toml:2: there is no verb 'fti'");
  refuses("[template.gird]\nquiet = true\n", "a.toml:2: there is no verb 'template gird'");
  refuses("margin = 1\n[template.grid]\nmargin = 2\n", "a.toml:3: 'margin' stands there a second time");
  place.file("a.toml", "[fit]\ncells = 300\n[template.auto]\ncells = 50\n[template.grid]\nquiet = true\n");
  CHECK(place.run(grid).status == 0);
}

TEST_CASE("Every verb explains itself", "[cli][slow]") {
  const Workplace place;
  const Run all = place.run("--help");
  CHECK(all.status == 0);
  for (const std::string verb : {"fit", "shell", "subdivide", "check", "convert", "report"}) {
    CHECK(all.out.find("\n  " + verb) != std::string::npos);
    const Run run = place.run(verb + " --help");
    INFO(run.out);
    CHECK(run.status == 0);
    CHECK(run.out.find("Example") != std::string::npos);
    CHECK(run.out.find(".mesh") != std::string::npos);
  }
  const Run version = place.run("--version");
  CHECK(version.status == 0);
  CHECK(version.out.starts_with("subvol "));
  CHECK(place.run("help").out == place.run("--help").out);
  CHECK(place.run("help fit").out == place.run("fit --help").out);
  CHECK(place.run("help template auto").out == place.run("template auto --help").out);
}

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

TEST_CASE("Bad files are refused by every verb, and without a trace", "[cli][data][slow]") {
  const auto data = subvol::test::require_data();
  if (!data) return;
  const Workplace place;
  std::istringstream list(content_of(*data / "bad" / "EXPECT.txt"));
  for (std::string line; std::getline(list, line);) {
    if (line.empty() || line[0] == '#') continue;
    const std::string name = line.substr(0, line.find('\t'));
    const bool must_refuse = line.substr(name.size() + 1).starts_with("reject\t");
    const std::string path = (*data / "bad" / name).string();
    const bool volume = name.ends_with(".mesh");
    const std::vector<std::string> commands =
        volume ? std::vector<std::string>{"fit target.off --levels 1 --template " + path + " -o out.mesh",
                                          "fit " + path + " --levels 1 --template template.mesh -o out.mesh",
                                          "optimize " + path + " --max-iterations 2 -o out.mesh",
                                          "shell " + path + " --thickness 1% -o out.mesh",
                                          "subdivide " + path + " --levels 1 -o out.mesh",
                                          "template split " + path + " --into tets -o out.mesh",
                                          "template carve " + path + " --list 0 -o out.mesh",
                                          "template pillow " + path + " -o out.mesh",
                                          "template refine " + path + " --list 0 -o out.mesh",
                                          "template merge " + path + " -o out.mesh",
                                          "template collapse " + path + " --vertices 0 1 -o out.mesh",
                                          "optimize " + path + " --order 2 --target target.off -o out.vtk",
                                          "check " + path, "convert " + path + " -o out.vtk"}
               : std::vector<std::string>{"fit " + path + " --levels 1 --template template.mesh -o out.mesh",
                                          "fit " + path + " --levels 1 -o out.mesh",
                                          "optimize template.mesh --max-iterations 2 --target " + path + " -o out.mesh",
                                          "shell " + path + " --thickness 1% -o out.mesh",
                                          "template auto " + path + " -o out.mesh",
                                          "template extrude " + path + " --thickness 0.1 -o out.mesh",
                                          "check template.mesh --target " + path, "convert " + path + " -o out.obj"};
    for (const std::string& command : commands) {
      for (const char* output : {"out.mesh", "out.vtk", "out.obj"}) fs::remove(place / output);
      const auto before = place.names();
      const Run run = place.run(command, kSanitized ? -1 : static_cast<int>(RLIMIT_DATA), rlim_t{512} << 20);
      INFO(command << '\n' << run.err);
      const bool is_check = command.starts_with("check");
      if (run.status == 0 || place.names() != before) {
        // Flat and inverted cells may pass, with words; what is written is then said not to be valid, or not converged.
        CHECK(!must_refuse);
        CHECK((run.status == 0 || ((run.status == 1 || run.status == 4) && !run.err.empty())));
      } else {
        // A readable but unsound mesh is an answer of `check`, not a refusal.
        CHECK((run.status == 3 || (is_check && volume && run.status == 1)));
        CHECK(!(run.err.empty() && run.out.empty()));
      }
    }
  }
}
