// SPDX-License-Identifier: GPL-3.0-or-later
// The verb view: pages of meshes, surfaces and reports, and what it refuses.

#include "subvol/io/mesh_io.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/workplace.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <string>

using subvol::test::content_of;
using subvol::test::kFit;
using subvol::test::Run;
using subvol::test::Workplace;

namespace {

/// True if the program was built with the viewer: otherwise it says so, and pages show pictures.
bool has_viewer(const Run& run) { return run.err.find("built without the viewer") == std::string::npos; }

/// The data of a page of the viewer.
nlohmann::json data_of(const std::string& page) {
  const std::string opening = "<script type=\"application/json\">";
  const std::size_t begin = page.find(opening) + opening.size();
  return nlohmann::json::parse(page.substr(begin, page.find("</script>", begin) - begin));
}

}  // namespace

TEST_CASE("A mesh becomes a page with its quality, its distance and its inverted cells", "[cli]") {
  const Workplace place;
  subvol::VolumeMesh mesh = subvol::test::lattice(2, 2, 2);
  *std::find(mesh.positions.begin(), mesh.positions.end(), subvol::Vec3(1, 1, 1)) = {3, 1, 1};  // beyond the boundary
  mesh.references = {1, 1, 1, 1, 2, 2, 2, 2};
  subvol::write_volume_mesh(place / "tangled.mesh", mesh);
  const Run run = place.run("view tangled.mesh --target target.off");
  INFO(run.err);
  REQUIRE(run.status == 0);
  const std::string page = content_of(place / "tangled.html");
  if (!has_viewer(run)) {
    CHECK(page.find("data:image/png") != std::string::npos);
    return;
  }
  const nlohmann::json data = data_of(page);
  CHECK(data["title"] == "tangled.mesh");
  const nlohmann::json& shown = data["meshes"][0];
  CHECK(shown["num_cells"] == 8);
  CHECK(shown["inverted"]["size"] >= 4);
  std::vector<std::string> fields;
  for (const auto& field : shown["fields"]) fields.push_back(field["name"]);
  CHECK(fields == std::vector<std::string>{"scaled_jacobian", "region", "distance"});
  CHECK(data.contains("target"));

  CHECK(place.run("view tangled.mesh").status == 2);
  CHECK(place.run("view tangled.mesh --force --quiet").err.empty());
}

TEST_CASE("Other fields of a .vtu are there to color by", "[cli][slow]") {
  const Workplace place;
  REQUIRE(place.run("shell target.off --thickness 2% --layers 2 -o shell.vtu --report shell.json").status == 0);
  const Run run = place.run("view shell.vtu -o shell.html");
  INFO(run.err);
  REQUIRE(run.status == 0);
  if (!has_viewer(run)) return;
  const nlohmann::json data = data_of(content_of(place / "shell.html"));
  std::string names;
  for (const auto& field : data["meshes"][0]["fields"]) names += field["name"].get<std::string>() + ' ';
  CHECK(names.find("thickness") != std::string::npos);
}

TEST_CASE("A curved mesh, a surface, a cage and a report can be viewed", "[cli][slow]") {
  const Workplace place;
  REQUIRE(place.run("fit target.off --template template.mesh --order 2 -o curved.vtu --report curved.json --quiet")
              .status != 3);
  REQUIRE(
      place
          .run("fit target.off --template template.mesh --levels 1 -o fine.mesh -o cage:cage.mesh --report fine.json "
               "--quiet")
          .status == 0);
  const auto viewed = [&](const std::string& words) {
    const Run run = place.run("view " + words + " -o page.html --force");
    INFO(words << '\n' << run.err);
    CHECK(run.status == 0);
    return has_viewer(run) ? data_of(content_of(place / "page.html")) : nlohmann::json();
  };
  const nlohmann::json curved = viewed("curved.vtu");
  if (curved.is_null()) return;
  CHECK(curved["meshes"][0]["intervals"] == 4);
  CHECK(viewed("target.off")["meshes"][0]["kind"] == 4);
  const nlohmann::json cage = viewed("cage.mesh --limit");
  CHECK(cage["shows_limit"] == true);
  CHECK(cage.contains("cage"));
  const nlohmann::json report = viewed("fine.json");
  CHECK(report["meshes"].size() == 2);
  CHECK(report["shown"] == 1);
  CHECK(report["limit_of"] == 1);
  CHECK(report.contains("target"));

  REQUIRE(place.run("check fine.mesh --target target.off --report check.json --quiet").status == 0);
  const nlohmann::json check = viewed("check.json");
  CHECK(check["meshes"].size() == 1);
  CHECK(check["meshes"][0]["name"] == "Result");
}

TEST_CASE("What cannot be viewed is refused, and nothing is written", "[cli][slow]") {
  const Workplace place;
  place.file("points.xyz", "0 0 0\n1 0 0\n0 1 0\n");
  place.file("no.json", "{}");
  place.file("gone.json", R"({"subvol": "1", "command": "fit", "outputs": ["gone.mesh"]})");
  const std::vector<std::pair<std::string, int>> wrong{{"view none.mesh -o page.html", 3},
                                                       {"view target.xyy -o page.html", 3},
                                                       {"view points.xyz -o page.html", 3},
                                                       {"view no.json -o page.html", 3},
                                                       {"view target.off -o page.htm", 2},
                                                       {"view target.off --limit -o page.html", 3},
                                                       {"view target.off --chord 0 -o page.html", 2},
                                                       {"view gone.json --target target.off -o page.html", 2},
                                                       {"view template.mesh --target none.off -o page.html", 3},
                                                       {"view template.mesh --references x -o page.html", 3}};
  for (const auto& [words, status] : wrong) {
    const Run run = place.run(words);
    INFO(words << '\n' << run.err);
    CHECK(run.status == status);
    CHECK(!run.err.empty());
    CHECK(!std::filesystem::exists(place / "page.html"));
  }
  const Run gone = place.run("view gone.json -o page.html");
  CHECK(gone.status == 3);
  CHECK(gone.err.find("gone.mesh") != std::string::npos);
}

TEST_CASE("The course of a fit becomes a page with a timeline", "[cli][slow]") {
  const Workplace place;
  const Run linear = place.run(kFit + "--levels 1 -o animation:course.html");
  INFO(linear.err);
  if (!has_viewer(linear)) {
    CHECK(linear.status == 2);
    return;
  }
  REQUIRE(linear.status == 0);
  REQUIRE(place.run(kFit + "--order 2 -o animation:curved.html").status == 0);
  REQUIRE(place.run("fit target.off --cells 300 -o animation:automatic.html -o automatic.mesh --quality 0.3").status ==
          0);
  for (const char* name : {"course.html", "curved.html", "automatic.html"}) {
    INFO(name);
    const nlohmann::json data = data_of(content_of(place / name));
    REQUIRE(data["meshes"].size() >= 3);
    CHECK(data["is_timeline"] == true);
    CHECK(data["shown"] == data["meshes"].size() - 1);
    CHECK(data["meshes"].back()["name"] == "result");
    for (const auto& mesh : data["meshes"]) CHECK(mesh["num_cells"] == data["meshes"][0]["num_cells"]);
  }
  CHECK(place.run(kFit + "--levels 1 -o cutaway:inside.html").status == 2);
}
