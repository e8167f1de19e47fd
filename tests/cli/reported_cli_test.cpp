// SPDX-License-Identifier: GPL-3.0-or-later
// Small inputs made after public bug reports, as their users would run them.

#include "subvol/io/mesh_io.h"
#include "subvol/io/surface_io.h"
#include "tests/support/workplace.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include <optional>

using subvol::test::content_of;
using subvol::test::has;
using subvol::test::Run;
using subvol::test::Workplace;

namespace {

/// Nothing, and a word of it, where the inputs are not there.
std::optional<std::string> reported_inputs() {
  const auto data = subvol::test::data_dir();
  if (data && std::filesystem::is_directory(*data / "reported")) return (*data / "reported").string() + "/";
  WARN("SKIPPED: no folder with reported inputs");
  return std::nullopt;
}

}  // namespace

TEST_CASE("Reported STL files are read as what they are, or refused by their bytes", "[cli]") {
  const auto inputs = reported_inputs();
  if (!inputs) return;
  const Workplace place;
  for (const char* name : {"01-f_trailing.stl", "02-d_cr.stl", "33-payload.stl"}) {
    const Run run = place.run("convert " + *inputs + name + " --force -o a.obj");
    CAPTURE(name, run.err);
    REQUIRE(run.status == 0);
    const subvol::PolygonMesh cube = subvol::read_polygon_mesh(place / "a.obj");
    CHECK(cube.positions.size() == 8);
    CHECK(cube.num_faces() == 12);
    double volume = 0;
    for (std::size_t f = 0; f < cube.num_faces(); ++f) {
      const auto corner = [&](std::size_t i) { return cube.positions[cube.face_vertices[cube.face_offsets[f] + i]]; };
      volume += corner(0).dot(corner(1).cross(corner(2))) / 6;
    }
    CHECK(volume == Approx(1));
  }
  for (const auto& [name, word] : {std::pair("01-c_header_only.stl", "80 bytes"), {"01-e_truncated.stl", "byte 80"}}) {
    const Run run = place.run("convert " + *inputs + name + " -o b.obj");
    CAPTURE(name, run.err);
    CHECK(run.status == 3);
    CHECK(has(run.err, word));
    CHECK(!has(run.err, "endsolid"));
  }
}

TEST_CASE("Reported files of cells give the references that are meant, and are told when they cannot be read",
          "[cli][slow]") {
  const auto inputs = reported_inputs();
  if (!inputs) return;
  const Workplace place;
  for (const char* name : {"37-double_ids.vtk", "37-orig_first.vtk"}) {
    const Run run = place.run("convert " + *inputs + name + " --force -o a.mesh");
    CAPTURE(name, run.err);
    REQUIRE(run.status == 0);
    CHECK(subvol::read_volume_mesh(place / "a.mesh").references == std::vector<int>{7, 9});
  }
  for (const char* name : {"04-m.msh", "05-m.inp"}) {
    const Run run = place.run("convert " + *inputs + name + " --force -o b.mesh");
    CAPTURE(name, run.err);
    REQUIRE(run.status == 0);
    CHECK(subvol::read_volume_mesh(place / "b.mesh").num_cells() == 1);
  }
  const Run curved = place.run("convert " + *inputs + "06-hex20.vtk -o curved.msh -o curved.inp");
  CAPTURE(curved.err);
  CHECK(has(curved.err, "warning") == false);
  CHECK(curved.status == 0);
  CHECK(place.run("check curved.msh").status == 0);
  const Run mirrored = place.run("optimize " + *inputs + "09-all_mirrored.mesh -o mirrored.mesh");
  CAPTURE(mirrored.err);
  CHECK(mirrored.status == 0);
  CHECK(has(mirrored.err, "numbered anew"));
  REQUIRE(place.run("convert " + *inputs + "11-mixed.mesh -o b.msh").status == 0);
  CHECK(has(content_of(place / "b.msh"), "$PhysicalNames\n2\n"));
}

TEST_CASE("What reported files hold beside the mesh is counted", "[cli]") {
  const auto inputs = reported_inputs();
  if (!inputs) return;
  const Workplace place;
  CHECK(place.run("convert " + *inputs + "03-three.stl -o a.obj").err.empty());
  for (const char* solid : {"g red\n", "g gray\n", "g blue\n"}) CHECK(has(content_of(place / "a.obj"), solid));
  CHECK(has(place.run("convert " + *inputs + "03-groups.obj -o b.obj").err, "uses of materials"));
  CHECK(has(content_of(place / "b.obj"), "g face5\n"));
  CHECK(place.run("convert " + *inputs + "03-labels.mesh -o a.mesh").err.empty());
  const subvol::VolumeFaceGroups groups = subvol::read_volume_mesh(place / "a.mesh").face_groups;
  CHECK(groups.faces.size() == 6);
  CHECK(groups == subvol::read_volume_mesh(*inputs + "03-labels.mesh").face_groups);
}

TEST_CASE("Reported surfaces are told with their own numbers, and which way they face", "[cli]") {
  const auto inputs = reported_inputs();
  if (!inputs) return;
  const Workplace place;
  const Run flap = place.run("template auto " + *inputs + "21-flap_inward.off -o a.mesh");
  CAPTURE(flap.err);
  CHECK(flap.status == 0);
  CHECK(has(flap.err, "1 triangle of fins left out"));
  for (const char* name : {"21-inward_minus1.off", "21-inward_minus50.off"}) {
    const Run run = place.run("shell " + *inputs + name + " --thickness 1% --straight --force -o a.mesh");
    CAPTURE(name, run.err);
    CHECK(has(run.err, "point inward"));
    CHECK(has(run.err, "open edges"));
    CHECK(!has(run.err, "closed surface"));
  }
}

TEST_CASE("Reported surfaces are diagnosed, repaired, or refused with the place of the cause", "[cli][slow]") {
  const auto inputs = reported_inputs();
  if (!inputs) return;
  const Workplace place;
  const auto checked = [&](const std::string& name, int status) {
    const Run run = place.run("check " + *inputs + name + " --json");
    CAPTURE(name, run.err);
    REQUIRE(run.status == status);
    return nlohmann::json::parse(run.out)["findings"];
  };
  CHECK(checked("15-shared.off", 0)["vertex_contact"]["first"][0]["at"] == nlohmann::json({0.5, 0.5, 0.0}));
  CHECK(checked("16-corner_shared.off", 0)["vertex_contact"]["count"] == 1);
  CHECK(checked("16-edge_separate.off", 0)["edge_contact"]["count"] == 1);
  CHECK(checked("19-slabs.off", 0)["interface"]["count"] == 16);
  // 16 more pairs have one point in common, at which two edges cross (counted with exact fractions).
  CHECK(checked("25-two_plates.off", 1)["crossing"]["count"] == 84);
  CHECK(checked("39-gap0.002.off", 0)["thin_gap"]["first"][0]["width"].get<double>() == Approx(0.002));
  CHECK(checked("39-outward_wrong.off", 1)["wall_outward"]["count"] == 1);
  for (const auto& [name, word] :
       {std::pair("39-overlap.off", "united"), {"39-outward_wrong.off", "turned"}, {"25-two_plates.off", "united"}}) {
    const Run run = place.run("template auto " + *inputs + name + " --regions merge --force -o a.mesh");
    CAPTURE(name, run.err);
    CHECK(run.status == 0);
    CHECK(has(run.err, word));
  }
  const Run gap = place.run("template auto " + *inputs + "39-gap0.002.off -o b.mesh");
  CHECK(gap.status == 3);
  CHECK((has(gap.err, "the thinnest gap is 0.002 wide") && has(gap.err, "thinner than a cell")));
  const Run regions = place.run("template auto " + *inputs + "39-outward_wrong.off -o b.mesh");
  CHECK(regions.status == 0);
  CHECK(has(regions.err, "--regions merge makes voids of it"));
}
