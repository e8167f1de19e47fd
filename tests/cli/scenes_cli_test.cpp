// SPDX-License-Identifier: GPL-3.0-or-later
// Scenes besides the surface, and what a shell is told, as users of the program meet them.

#include "subvol/base/version.h"
#include "subvol/io/mesh_io.h"
#include "tests/support/glb_reader.h"
#include "tests/support/gltf_validator.h"
#include "tests/support/workplace.h"

#include <catch2/catch.hpp>

#include <cstdlib>
#include <set>
#include <sstream>
#include <string>
#include <vector>

using subvol::test::check_with_validator;
using subvol::test::content_of;
using subvol::test::kFit;
using subvol::test::Run;
using subvol::test::Workplace;
using subvol_tests::GlbFile;

namespace {

std::vector<std::string> node_names(const GlbFile& file) {
  std::vector<std::string> names;
  for (const auto& node : file.json.at("nodes")) names.push_back(node.at("name"));
  return names;
}

}  // namespace

TEST_CASE("A fit writes a cutaway and its own animation beside the surface", "[cli][slow]") {
  const Workplace place;
  const Run run = place.run(kFit +
                            "--levels 2 -o out.glb -o cutaway:cut.glb -o animation:steps.glb "
                            "-o out.mesh --cut x:0.4 --report report.json");
  INFO(run.err);
  REQUIRE(run.status == 0);
  CHECK(place.json("report.json").at("outputs") == nlohmann::json({"out.glb", "cut.glb", "steps.glb", "out.mesh"}));
  const GlbFile cut(content_of(place / "cut.glb"));
  CHECK(node_names(cut) == std::vector<std::string>{"cut", "surface", "cut", "wireframe"});
  CHECK(cut.primitive("surface").at("attributes").contains("_SCALED_JACOBIAN"));
  const GlbFile steps(content_of(place / "steps.glb"));
  CHECK(node_names(steps) == std::vector<std::string>{"steps", "surface"});
  const auto names = steps.json.at("meshes").at(0).at("extras").at("targetNames");
  CHECK(names.at(0) == "template");
  CHECK(names.size() == place.json("report.json").at("stages").size());
  CHECK(steps.json.at("animations").size() == 1);
  check_with_validator({place / "out.glb", place / "cut.glb", place / "steps.glb"});

  REQUIRE(place.run(kFit + "--levels 2 -o animation:again.glb --threads 1").status == 0);
  const GlbFile again(content_of(place / "again.glb"));
  CHECK(again.binary == steps.binary);
}

TEST_CASE("A fit of curved cells writes a cutaway and its own animation", "[cli][slow]") {
  const Workplace place;
  const Run run = place.run(kFit + "--order 2 -o out.vtu -o cutaway:cut.glb -o animation:steps.glb");
  INFO(run.err);
  REQUIRE(run.status == 0);
  CHECK(GlbFile(content_of(place / "steps.glb")).json.at("animations").size() == 1);
  REQUIRE(place.run("convert out.vtu -o cutaway:again.glb --cut y").status == 0);
  REQUIRE(place.run("convert template.mesh -o cutaway:template.glb").status == 0);
  check_with_validator({place / "cut.glb", place / "steps.glb", place / "again.glb", place / "template.glb"});
}

TEST_CASE("Scenes are smaller without wireframe and in whole numbers", "[cli]") {
  const Workplace place;
  REQUIRE(place.run("convert template.mesh --limit -o plain.glb").status == 0);
  REQUIRE(place.run("convert template.mesh --limit -o small.glb --quantize --no-wireframe").status == 0);
  CHECK(content_of(place / "small.glb").size() < 0.85 * static_cast<double>(content_of(place / "plain.glb").size()));
  const GlbFile small(content_of(place / "small.glb"));
  CHECK(node_names(small) == std::vector<std::string>{"small", "surface"});
  CHECK(small.json.at("extensionsRequired") == nlohmann::json({"KHR_mesh_quantization"}));
  check_with_validator({place / "small.glb"});
}

TEST_CASE("Options of scenes and formats are warned of if no output is one", "[cli]") {
  const Workplace place;
  const Run unused = place.run(
      "convert template.mesh -o a.mesh --quantize --no-wireframe --cut x --unit 0.001 --up z "
      "--msh-version 2.2 --vtu-cells bezier --limit");
  CHECK(unused.status == 0);
  for (const char* words :
       {"--quantize has no effect: no output is a scene", "--no-wireframe has no effect",
        "--cut has no effect: no output is a cutaway", "--unit has no effect", "--up has no effect",
        "--msh-version has no effect: no output is a .msh", "--vtu-cells has no effect", "--limit has no effect"})
    CHECK(unused.err.find(words) != std::string::npos);
  const Run used = place.run(
      "convert template.mesh -o cutaway:b.glb -o c.obj -o d.msh -o e.vtu --quantize --cut x "
      "--unit 0.001 --up z --msh-version 2.2 --vtu-cells bezier --limit");
  CHECK(used.status == 0);
  CHECK(used.err.find("no effect") == std::string::npos);
}

TEST_CASE("Parts that there are not are refused before any work", "[slow][cli]") {
  const Workplace place;
  for (const char* words :
       {"convert template.mesh -o animation:a.glb", "convert template.mesh -o cage:a.mesh",
        "convert target.off -o cutaway:a.glb", "convert template.mesh -o cutaway:a.mesh",
        "optimize template.mesh -o animation:a.glb", "convert template.mesh -o cutaway:a.glb --cut w",
        "convert template.mesh -o cutaway:a.glb --cut x:0", "convert template.mesh -o cutaway:a.glb --cut x0.5",
        "convert template.mesh -o cutaway:a.glb --cut z:1"}) {
    const Run run = place.run(words);
    INFO(words << '\n' << run.err);
    CHECK(run.status == 2);
    CHECK(!run.err.empty());
  }
  CHECK(!place.has("a.glb"));
}

TEST_CASE("Scripts are told of every step, of the time left, and of the work after the solve", "[cli][slow]") {
  const Workplace place;
  const Run run = place.run(kFit + "--levels 2 --max-iterations 2 -o out.glb --progress json");
  std::istringstream lines(run.out);
  std::size_t steps = 0, with_time = 0;
  std::set<std::string> parts;
  for (std::string line; std::getline(lines, line);) {
    const auto told = nlohmann::json::parse(line);
    CHECK(told.at("seconds") >= 0);
    if (told.contains("part")) {
      CHECK((told.at("share") >= 0 && told.at("share") <= 1));
      parts.insert(told.at("part"));
      continue;
    }
    ++steps;
    if (!told.contains("seconds_left")) continue;
    ++with_time;
    CHECK(told.at("seconds_left") >= 0);
  }
  CHECK(steps > 5);
  CHECK(with_time > 0);
  CHECK(parts == std::set<std::string>{"tessellation", "quality", "topology", "self-intersections", "distance"});
}

TEST_CASE("The version names what the program was made with", "[cli]") {
  const Run run = Workplace().run("--version");
  CHECK(run.status == 0);
  CHECK(run.out.find(std::string("subvol ") + subvol::version()) == 0);
  for (const char* name : {"CGAL 5", "Eigen 3", "OpenSubdiv 3", "tinygltf", "CLI11 2"})
    CHECK(run.out.find(name) != std::string::npos);
}

TEST_CASE("A shell completes verbs, options and their words", "[slow][cli]") {
  const Workplace place;
  for (const char* shell : {"bash", "zsh", "fish"}) {
    const Run run = place.run(std::string("completion ") + shell);
    CHECK(run.status == 0);
    CHECK(run.out.find("levels") != std::string::npos);
    place.file(std::string("completion.") + shell, run.out);
  }
  CHECK(place.run("completion tcsh").status == 2);
  if (std::system("bash -c true") != 0) {
    WARN("SKIPPED: no bash");
    return;
  }
  const auto completed = [&](const std::string& words, int at) {
    const auto answer = place / "answer";
    place.file("ask.sh", "source completion.bash\nCOMP_WORDS=(" + words + ")\nCOMP_CWORD=" + std::to_string(at) +
                             "\n_subvol\necho \"${COMPREPLY[*]}\"\n");
    const std::string folder = answer.parent_path().string();
    REQUIRE(std::system(("cd '" + folder + "' && bash ask.sh > answer").c_str()) == 0);
    std::string text = content_of(answer);
    while (!text.empty() && text.back() == '\n') text.pop_back();
    return text;
  };
  CHECK(completed("subvol opt", 1) == "optimize");
  CHECK(completed("subvol fit --lev", 2) == "--levels");
  CHECK(completed("subvol fit a.off --surface l", 4) == "limit");
  CHECK(completed("subvol template pil", 2) == "pillow");
  CHECK(completed("subvol template grid --coun", 3) == "--counts");
  CHECK(completed("subvol batch rep", 2) == "report");
  CHECK(completed("subvol batch report --comp", 3) == "--compare");
  CHECK(completed("subvol batch models.csv --sha", 3) == "--shard");
  CHECK(completed("subvol fit a", 2).empty());  // files are the shell's own
}
