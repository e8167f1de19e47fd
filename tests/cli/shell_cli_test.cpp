// SPDX-License-Identifier: GPL-3.0-or-later
// Shells of real and of reported surfaces, as users of the program meet them.

#include "subvol/io/mesh_io.h"
#include "tests/support/require_data.h"
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
