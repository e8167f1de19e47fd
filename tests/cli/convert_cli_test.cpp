// SPDX-License-Identifier: GPL-3.0-or-later
// `convert` and `subdivide` as their users run them: files in, files out, exit status.

#include "samples/shapes.h"
#include "subvol/io/mesh_io.h"
#include "subvol/io/surface_io.h"
#include "tests/support/glb_reader.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/workplace.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <set>
#include <utility>

using subvol::test::content_of;
using subvol::test::Run;
using subvol::test::Workplace;

namespace {

bool is_closed(const subvol::PolygonMesh& mesh) {
  std::set<std::pair<subvol::Index, subvol::Index>> edges;
  for (std::size_t f = 0; f < mesh.num_faces(); ++f)
    for (std::size_t begin = mesh.face_offsets[f], end = mesh.face_offsets[f + 1], k = begin; k < end; ++k)
      edges.insert({mesh.face_vertices[k], mesh.face_vertices[k + 1 < end ? k + 1 : begin]});
  return std::ranges::all_of(edges, [&](const auto& edge) { return edges.contains({edge.second, edge.first}); });
}

}  // namespace

TEST_CASE("convert writes every format, and what can be read back is the same", "[cli]") {
  const Workplace place(subvol::samples::bracket_sample());
  const Run run =
      place.run("convert template.mesh -o a.mesh -o a.vtk -o a.vtu -o a.msh -o a.obj -o a.usda -o a.glb -o a.gltf");
  INFO(run.err);
  REQUIRE(run.status == 0);
  const subvol::VolumeMesh mesh = subvol::read_volume_mesh(place / "template.mesh");
  CHECK(subvol::read_volume_mesh(place / "a.mesh").tags == mesh.tags);
  CHECK(subvol::read_volume_mesh(place / "a.vtk").cell_vertices == mesh.cell_vertices);
  CHECK_NOTHROW(subvol_tests::GlbFile(content_of(place / "a.glb")));
  CHECK(place.run("convert target.off -o t.obj -o t.glb -o t.usda").status == 0);
  CHECK(place.run("convert template.mesh --limit -o l.glb").status == 0);
  CHECK(content_of(place / "l.glb") != content_of(place / "a.glb"));
  REQUIRE(place.run("convert template.mesh --limit -o l.obj").status == 0);
  const subvol::PolygonMesh limit = subvol::read_polygon_mesh(place / "l.obj");
  CHECK(limit.num_faces() > subvol::read_polygon_mesh(place / "a.obj").num_faces());
  CHECK(is_closed(limit));  // along its creases too
  CHECK(place.run("convert target.off --limit -o t2.glb").status == 2);
}

TEST_CASE("The option --references chooses the cell data that become references, and names those there are",
          "[cli][slow]") {
  const Workplace place;
  subvol::VolumeMesh mesh = subvol::test::lattice(1, 1, 2);
  mesh.references = {7, 9};
  subvol::write_volume_mesh(place / "plain.vtk", mesh);
  std::string bytes = content_of(place / "plain.vtk");
  bytes.replace(bytes.find("CELL_DATA"), bytes.npos,
                "CELL_DATA 2\nFIELD f 3\nvtkGhostType 1 2 unsigned_char\n0 1\nMaterialIds 1 2 double\n7 9\n"
                "color 1 2 int\n3 4\n");
  place.file("a.vtk", bytes);
  for (const auto& [options, references] :
       {std::pair("", std::vector{7, 9}), {" --references color", {3, 4}}, {" --references vtkGhostType", {0, 1}}}) {
    const std::string given = options;
    CAPTURE(given);
    const Run run = place.run("convert a.vtk --force -o b.mesh" + given);
    CHECK(run.status == 0);
    CHECK((run.err.find("--references NAME") != std::string::npos) == given.empty());
    CHECK(subvol::read_volume_mesh(place / "b.mesh").references == references);
  }
  for (const std::string verb : {"convert a.vtk -o c.mesh", "subdivide a.vtk -o c.mesh", "optimize a.vtk -o c.mesh",
                                 "template pillow a.vtk -o c.mesh", "check a.vtk"}) {
    const Run run = place.run(verb + " --references region");
    CAPTURE(verb, run.err);
    CHECK(run.status == 3);
    CHECK(run.err.find("'MaterialIds'") != std::string::npos);
  }
  CHECK(place.run("convert target.off --references x -o c.obj").status == 2);
}

TEST_CASE("an input that cannot be read is told as what it is, by every verb", "[cli][slow]") {
  const Workplace place;
  for (const char* name : {"a.med", "a.su2", "a.vol", "a"}) {
    place.file(name, "x");
    const std::string file = name;
    for (const std::string& verb :
         {"convert " + file + " -o b.mesh", "convert " + file + " -o b.obj", "check " + file,
          "optimize " + file + " -o b.mesh", "subdivide " + file + " -o b.mesh", "fit " + file + " -o b.mesh",
          "template auto " + file + " -o b.mesh", "template pillow " + file + " -o b.mesh",
          "shell " + file + " --thickness 1 -o b.mesh", "check template.mesh --target " + file,
          "fit target.off --template " + file + " -o b.mesh"}) {
      const Run run = place.run(verb);
      CAPTURE(verb, run.err);
      CHECK(run.status == 3);
      CHECK(run.err.find("unknown extension '" + std::filesystem::path(name).extension().string() + "'") !=
            std::string::npos);
      CHECK(run.err.find("expected cells: .mesh .vtk ") != std::string::npos);
      CHECK(run.err.size() < 400);
    }
  }
  const Run surface = place.run("optimize target.off -o b.mesh");
  CHECK(surface.status == 3);
  CHECK(surface.err.find("cells are wanted") != std::string::npos);
  // A .vtu of another program is read by what is in it, whatever its attributes.
  for (
      const std::string header :
      {R"(type="UnstructuredGrid" version="0.1" byte_order="LittleEndian")",
       R"(type="UnstructuredGrid" version="2.2" byte_order="LittleEndian")",
       R"(type="UnstructuredGrid" version="2.2" byte_order="LittleEndian" header_type="UInt64" compressor="vtkZLibDataCompressor")"}) {
    place.file("foreign.vtu", "<?xml version=\"1.0\"?>\n<VTKFile " + header + ">\n<UnstructuredGrid/>\n</VTKFile>\n");
    for (const std::string verb : {"check foreign.vtu", "convert foreign.vtu -o b.mesh"}) {
      const Run run = place.run(verb);
      CAPTURE(run.err);
      CHECK(run.status == 3);
      CHECK(run.err.find("expected an element Piece") != std::string::npos);
    }
  }
}

TEST_CASE("what was read and is in none of the outputs is told once, by every verb", "[cli][slow]") {
  const Workplace place(subvol::samples::bracket_sample());
  subvol::VolumeMesh mesh = subvol::read_volume_mesh(place / "template.mesh");
  REQUIRE(!mesh.tags.creases.empty());
  mesh.references.assign(mesh.num_cells(), 3);
  subvol::write_volume_mesh(place / "a.mesh", mesh);
  const std::string told = "in none of the outputs: ",
                    references = std::to_string(mesh.num_cells()) + " references of cells",
                    creases = std::to_string(mesh.tags.creases.size()) + " creases";
  for (const std::string verb : {"convert a.mesh", "subdivide a.mesh", "template split a.mesh --into tets"}) {
    const auto run = [&](const std::string& outputs) { return place.run(verb + " --force" + outputs).err; };
    CAPTURE(verb);
    const std::string obj = run(" -o b.obj"), vtk = run(" -o b.vtk -o b.obj"), all = run(" -o b.mesh -o b.obj");
    CHECK(obj.find(told + references + ", " + creases) != std::string::npos);
    CHECK(vtk.find(told + creases) != std::string::npos);
    CHECK((all.find(told) == std::string::npos || verb.starts_with("template")));
    CHECK(run(" --quiet -o b.obj").empty());
  }
}

TEST_CASE("subdivide multiplies the cells by eight a level", "[cli]") {
  const Workplace place(subvol::samples::bracket_sample());
  REQUIRE(place.run("subdivide template.mesh --levels 2 -o fine.mesh -o fine.glb --report r.json").status == 0);
  const subvol::VolumeMesh fine = subvol::read_volume_mesh(place / "fine.mesh");
  CHECK(fine.num_cells() == 640);
  CHECK(!fine.tags.creases.empty());
  CHECK(place.json("r.json").at("result").at("cells") == 640);
  CHECK(place.run("subdivide template.mesh --boundary averaging -o plain.mesh").status == 0);
}

TEST_CASE("subdivide shows the surface of the rule it is given, and tells of the mesh that was read", "[cli]") {
  const Workplace place;
  REQUIRE(place
              .run("subdivide template.mesh --boundary averaging --crease-angle 40 -o fine.mesh -o fine.glb --up y "
                   "--report r.json")
              .status == 0);
  CHECK(place.json("r.json").at("input").at("mesh").at("creases") == 0);
  double highest_point = 0, highest_shown = 0;
  for (const subvol::Vec3& p : subvol::read_volume_mesh(place / "fine.mesh").positions)
    highest_point = std::max(highest_point, p.y());
  const auto shown = subvol_tests::GlbFile(content_of(place / "fine.glb")).attribute<float>("surface", "POSITION");
  for (std::size_t i = 1; i < shown.size(); i += 3) highest_shown = std::max<double>(highest_shown, shown[i]);
  CHECK(highest_shown == Approx(highest_point));
}

TEST_CASE("subdivide checks what it has written", "[slow][cli]") {
  const Workplace place;
  subvol::VolumeMesh mesh = subvol::test::lattice(1, 1, 2);
  for (const std::size_t v : {4, 5, 6, 7}) mesh.positions[v].z() = 2.5;  // the upper cell stands on its head
  subvol::write_volume_mesh(place / "cage.mesh", mesh);
  for (const std::string file : {"fine.mesh", "fine.vtk", "fine.vtu"}) {
    const Run run = place.run("subdivide cage.mesh --levels 1 --force --report r.json -o " + file);
    INFO(file << ": " << run.err);
    CHECK(run.status == 1);
    CHECK(run.err.find("NOT VALID") != std::string::npos);
    const auto report = place.json("r.json");
    CHECK(report.at("valid") == false);
    CHECK(report.at("result").at("cells") == 16);
    CHECK(report.at("quality").at("inverted_cells") > 0);
    if (file == "fine.vtu") continue;
    const auto found = nlohmann::json::parse(place.run("check " + file + " --json").out);
    for (const char* entry : {"inverted_at", "quality", "defects", "topology"})
      CHECK(report.at(entry) == found.at(entry));
  }

  // Refused before anything is written: volumes would be no numbers.
  for (subvol::Vec3& p : mesh.positions) p *= 1e-60;
  subvol::write_volume_mesh(place / "tiny.mesh", mesh);
  CHECK(place.run("subdivide tiny.mesh --levels 1 -o x.mesh").status == 3);
  CHECK(place.run("template grid --box 0 0 0 1e-60 1e-60 1e-60 --counts 1 1 1 -o x.mesh").status == 3);
  CHECK_FALSE(place.has("x.mesh"));
}
