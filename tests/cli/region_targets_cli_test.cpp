// SPDX-License-Identifier: GPL-3.0-or-later
#include "samples/shapes.h"
#include "subvol/export/surface_writer.h"
#include "subvol/io/mesh_io.h"
#include "subvol/mesh/interfaces.h"
#include "tests/support/region_fixtures.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/workplace.h"

#include <catch2/catch.hpp>

#include <string>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

std::string npy(const LabelGrid& grid) {
  std::string header = "{'descr': '|u1', 'fortran_order': True, 'shape': (" + std::to_string(grid.counts[0]) + ", " +
                       std::to_string(grid.counts[1]) + ", " + std::to_string(grid.counts[2]) + "), }";
  header.resize(118, ' ');
  header.back() = '\n';
  std::string bytes = std::string("\x93NUMPY\x01\x00", 8) + static_cast<char>(header.size()) + '\0' + header;
  for (const int label : grid.labels) bytes += static_cast<char>(label);
  return bytes;
}

}  // namespace

TEST_CASE("With a template, too, the interfaces of a mesh are targets", "[slow][cli][regions]") {
  const Workplace place;
  const auto layers = [&](const char* name, double first, double second) {
    VolumeMesh mesh = lattice(3, 3, 3);
    for (Vec3& p : mesh.positions)
      p = {p.x() / 3, p.y() / 3, p.z() < 0.5 ? 0 : p.z() < 1.5 ? first : p.z() < 2.5 ? second : 1};
    for (std::size_t c = 0; c < mesh.num_cells(); ++c) mesh.references.push_back(static_cast<int>(c / 9) + 1);
    write_volume_mesh(place / name, mesh);
  };
  layers("target.mesh", 0.3, 0.6);
  layers("start.mesh", 0.35, 0.7);
  for (const char* options : {"--levels 1", "--order 2"}) {
    const Run fit =
        place.run(std::string("fit target.mesh --template start.mesh --crease-angle 40 --report a.json --force ") +
                  "-o a.vtu " + options);
    CAPTURE(options, fit.err);
    REQUIRE(fit.status == 0);
    const nlohmann::json cells = place.json("a.json")["regions"]["cells"];
    REQUIRE(cells.size() == 3);
    for (const auto& region : cells)
      CHECK(region["volume"].get<double>() == Approx(region["target_volume"].get<double>()).epsilon(2e-3));
    CHECK(cells[2]["target_volume"].get<double>() == Approx(0.4));
  }
}

TEST_CASE("A surface with sheets inside is filled region by region, with the target's volumes beside the result's",
          "[cli][regions][slow]") {
  const Workplace place;
  place.file("slabs.off", samples::off_text(slabs_surface(5)));
  const Run check = place.run("check slabs.off");
  CHECK(check.status == 0);
  CHECK(has(check.out, "5: region 1 of volume 0.2"));
  const Run fit = place.run("fit slabs.off --cells 500 -o a.mesh -o a.msh -o a.inp -o a.vtu --report a.json");
  CAPTURE(fit.err);
  REQUIRE(fit.status == 0);
  const nlohmann::json report = place.json("a.json");
  REQUIRE(report["regions"]["cells"].size() == 5);
  for (const auto& region : report["regions"]["cells"]) {
    CHECK(region["target_volume"].get<double>() == Approx(0.2));
    CHECK(region["volume"].get<double>() == Approx(0.2).epsilon(1e-9));
    CHECK(region["not_certified"] == 0);
  }
  for (const auto& interface : report["regions"]["interfaces"])
    CHECK(interface["target_area"].get<double>() == Approx(1));
  CHECK(report["warnings"].empty());
  const VolumeMesh mesh = read_volume_mesh(place / "a.mesh");
  CHECK(region_references(mesh) == std::vector<int>{1, 2, 3, 4, 5});
  CHECK(mesh.face_groups.groups.size() == 4);
  CHECK(place.run("check a.mesh --region 3").status == 0);
  CHECK(place.run("check a.mesh --region none").status == 2);
  CHECK(place.run("fit slabs.off --cells 500 -o d.mesh -o region:3:third.mesh -o region:3:third.glb").status == 0);
  const VolumeMesh third = read_volume_mesh(place / "third.mesh");
  CHECK(region_references(third) == std::vector<int>{3});
  CHECK(third.num_cells() < read_volume_mesh(place / "d.mesh").num_cells() / 2);
  REQUIRE(place.run("fit slabs.off --cells 4000 --levels 1 -o cage:cage.mesh -o fine.mesh --report c.json").status ==
          0);
  CHECK(place.json("c.json")["regions"]["cells"].size() == 5);
  const Run unknown = place.run("fit slabs.off -o region:bone:bone.mesh");
  CHECK(unknown.status == 2);
  CHECK(has(unknown.err, "there is no region 'bone'"));
  CHECK(has(unknown.err, "there are 1, 2, 3, 4, 5"));
  CHECK(place.run("fit slabs.off -o region:third.mesh").status == 2);
  CHECK(place.run("fit slabs.off --regions merge -o region:1:e.mesh").status == 2);
  const Run merged = place.run("check a.mesh --references none");
  CHECK(merged.status == 0);
  CHECK(!has(merged.out, "region"));
  const Run page = place.run("report a.json -o a.html --no-viewer");
  CHECK(page.status == 0);
  CHECK(has(content_of(place / "a.html"), "<h2>Regions</h2>"));
  const Run one = place.run("fit slabs.off --regions merge --cells 300 -o b.mesh");
  CHECK(one.status == 0);
  CHECK(has(one.err, "are left out"));
  CHECK(region_references(read_volume_mesh(place / "b.mesh")).size() == 1);
  // A mesh with regions is a target, too.
  CHECK(place.run("template auto a.mesh --cells 300 -o c.mesh").status == 0);
  CHECK(region_references(read_volume_mesh(place / "c.mesh")).size() == 5);
}

TEST_CASE("Named solids of an STL or 3MF become regions of their names", "[cli][regions][slow]") {
  const Workplace place;
  write_surface(place / "mount.stl", samples::mount_surface());
  write_surface(place / "mount.3mf", samples::mount_surface());
  for (const char* file : {"mount.stl", "mount.3mf"}) {
    CAPTURE(file);
    const Run check = place.run(std::string("check ") + file);
    CHECK(check.status == 1);
    CHECK(has(check.out, "4: plate of volume 36000, cork of volume 32000, block of volume 32000, pin of volume 39"));
    CHECK(has(check.out, "4 solids touch: they become the regions plate, cork, block and pin"));
    CHECK(has(check.out, "a fit fills it:     as 4 regions"));
  }
  const Run fit = place.run("fit mount.stl --cells 3000 -o a.mesh --report a.json");
  CAPTURE(fit.err);
  REQUIRE(fit.status == 0);
  CHECK(has(fit.err, "4 solids touch"));
  const nlohmann::json report = place.json("a.json");
  REQUIRE(report["regions"]["cells"].size() == 4);
  CHECK(report["regions"]["interfaces"].size() == 3);
  CHECK(report["repairs"].size() == 1);
  const VolumeMesh mesh = read_volume_mesh(place / "a.mesh");
  REQUIRE(mesh.regions.size() == 4);
  CHECK(mesh.regions[1].name == "cork");
  // The mesh is compared with the outer surface of the assembly.
  const Run compared = place.run("check a.mesh --target mount.stl");
  CHECK(compared.status == 0);
  CHECK_FALSE(has(compared.err, "warning"));
  CHECK(place.run("fit mount.stl --regions merge --cells 500 -o b.mesh").status == 0);
  CHECK(region_references(read_volume_mesh(place / "b.mesh")).size() == 1);
}

TEST_CASE("A segmentation becomes a template with a region for each label", "[cli][regions][slow]") {
  const Workplace place;
  place.file("a.npy", npy(Phantom{32}.grid()));
  const Run run = place.run("template auto a.npy --cells 2000 --pillow -o a.mesh");
  CAPTURE(run.err);
  CHECK((run.status == 0 || run.status == 4));
  CHECK(region_references(read_volume_mesh(place / "a.mesh")) == std::vector<int>{1, 2, 3, 4});
  CHECK(place.run("template auto a.npy --regions merge --cells 200 -o b.mesh").status == 0);
  place.file("b.npy", "no array");
  const Run bad = place.run("fit b.npy -o b.mesh --force");
  CHECK(bad.status == 3);
  CHECK(has(bad.err, "b.npy"));
}
