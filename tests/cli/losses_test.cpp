// SPDX-License-Identifier: GPL-3.0-or-later
// Warnings say which groups and names of a mesh an output loses.

#include "cli/runs/losses.h"
#include "cli/runs/written_result.h"
#include "tests/support/grouped_meshes.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/workplace.h"

#include <catch2/catch.hpp>

#include <string>
#include <vector>

using namespace subvol;
using cli::Output;
using cli::Part;
using subvol::test::has;
using subvol::test::lattice;
using subvol::test::with_floor_and_roof;

namespace {

std::vector<std::string> told_of_losses(const cli::Marks& marks, const std::string& file, Part part = Part::result) {
  const std::filesystem::path path(file);
  const Output output{.part = part, .path = path, .extension = path.extension().string()};
  std::vector<std::string> warnings;
  cli::warn_of_names(marks, std::vector{output}, warnings);
  return warnings;
}

/// A block with the group "all", which holds the floor and the roof, before the group "floor", and one of no face.
VolumeMesh block_with_nested_groups() {
  VolumeMesh mesh = with_floor_and_roof(lattice(2, 2, 2), 2);
  VolumeFaceGroups groups{{{"all", 21, 2}, {"floor", 22, 2}, {"none", 23, 2}}, {}};
  for (const GroupedFace& entry : mesh.face_groups.faces) {
    groups.faces.push_back({entry.face, 0});
    if (entry.group == 0) groups.faces.push_back({entry.face, 1});
  }
  normalize(groups);
  mesh.face_groups = groups;
  return mesh;
}

}  // namespace

TEST_CASE("A format with one group for each face tells which groups lose faces", "[cli]") {
  const cli::Marks marks = cli::marks_of(block_with_nested_groups());
  for (const std::string file : {"a.mesh", "a.mfem", "a.obj", "a.stl", "a.glb", "a.3mf"}) {
    const std::vector<std::string> warnings = told_of_losses(marks, file);
    CAPTURE(file);
    REQUIRE(!warnings.empty());
    CHECK(has(warnings.front(), file + ": "));
    CHECK(has(warnings.front(), "\"floor\" loses all of its 4 faces"));
    CHECK(!has(warnings.front(), "\"all\""));
    CHECK(!has(warnings.front(), "\"none\""));
  }
  CHECK(has(told_of_losses(marks, "a.vtu", Part::boundary).at(0), "\"floor\" loses all"));
  for (const std::string file : {"a.msh", "a.vtu", "a.inp", "a.e"}) {
    CAPTURE(file);
    CHECK(told_of_losses(marks, file).empty());
  }
  CHECK(told_of_losses(cli::marks_of(with_floor_and_roof(lattice(2, 2, 2), 2)), "a.mesh").empty());
}

TEST_CASE("Names that a format leaves out or alters are told once for each output, with the first of them", "[cli]") {
  VolumeMesh mesh = with_floor_and_roof(lattice(2, 2, 2), 2);
  mesh.face_groups.groups[1].name = "gro\xc3\x9f es Dach";
  mesh.references = {3, 3, 3, 3, 4, 4, 4, 4};
  mesh.regions = {{"steel", 3, 3}, {"never used", 9, 3}};
  const cli::Marks marks = cli::marks_of(mesh);
  const auto only = [&](const std::string& file, const cli::Marks& of) {
    const std::vector<std::string> warnings = told_of_losses(of, file);
    CAPTURE(file);
    REQUIRE(warnings.size() == 1);
    CHECK(has(warnings[0], file + ": "));
    return warnings[0];
  };
  CHECK(has(only("a.mfem", marks), "3 names left out, the first \"floor\""));
  for (const char* file : {"a.vtk", "a.bdf"}) CHECK(has(only(file, marks), "1 name left out, the first \"steel\""));
  CHECK(has(only("a.inp", marks), "1 name altered"));
  CHECK(has(only("a.inp", marks), "\"gro\xc3\x9f es Dach\" to \"gro___es_Dach\""));
  CHECK(told_of_losses(marks, "a.obj").empty());  // only its blanks change
  for (const char* file : {"a.mesh", "a.msh", "a.vtu", "a.e", "a.glb", "a.usda", "a.3mf"}) {
    CAPTURE(file);
    CHECK(told_of_losses(marks, file).empty());
  }
  mesh.face_groups.groups[0].name = std::string(130, 'x');
  CHECK(has(only("a.msh", cli::marks_of(mesh)), "1 name altered"));
  PolygonMesh surface;
  surface.face_groups.groups = {{"inlet", 1, 2}};
  CHECK(has(only("a.ply", cli::marks_of(surface)), "1 name left out, the first \"inlet\""));
  CHECK(told_of_losses(cli::marks_of(surface), "a.vtp").empty());
}

TEST_CASE("a warning of polynomial cells that are not valid says what is wrong with them", "[cli][quick]") {
  cli::PolynomialCells cells{.file = "a.inp", .is_close = true};
  cells.check.quality.emplace();
  cells.check.quality->num_cells = 25;
  cells.check.intersecting_faces = {{0, 1}, {0, 2}};
  const std::vector<std::string> meeting = cli::polynomial_cells_warnings(cells);
  REQUIRE(meeting.size() == 1);
  CHECK(has(meeting[0], "not valid: 2 pairs of faces of their boundary meet"));
  cells.check.quality->certificate.not_certified = {3};
  const std::vector<std::string> inverted = cli::polynomial_cells_warnings(cells);
  REQUIRE(inverted.size() == 1);
  CHECK(has(inverted[0], "not valid: 1 of 25 are not certified"));
}
