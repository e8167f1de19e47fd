// SPDX-License-Identifier: GPL-3.0-or-later
// Reports, and the pages that are made of them.

#include "subvol/io/mesh_io.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/workplace.h"

#include <catch2/catch.hpp>

#include <array>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

using subvol::test::content_of;
using subvol::test::kFit;
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

/// Returns what `check` finds in a file.
nlohmann::json found_in(const Workplace& place, const std::string& file) {
  return nlohmann::json::parse(place.run("check " + file + " --json").out);
}

}  // namespace

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
  const std::vector<std::string> wrong{"",
                                       "{",
                                       "[]",
                                       "null",
                                       "{\"subvol\": 1}",
                                       R"({"subvol": "1", "command": 7})",
                                       deep,
                                       head + R"("stages": [{}]})",
                                       head + R"("stages": [{"history": [3]}]})",
                                       head + R"("stages": [{"history": [{}], "name": "a"}]})",
                                       head + R"("quality": {"cells": "many"}})",
                                       head + R"("quality": {"cells": 1, "worst_cells": [{}]}})",
                                       head + R"("distance": {"mean_percent": 1}})",
                                       head + R"("thickness": {"inside": {"asked": {}}}})"};
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
