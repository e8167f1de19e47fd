// SPDX-License-Identifier: GPL-3.0-or-later
// The verb optimize as users of the program run it.

#include "samples/shapes.h"
#include "subvol/io/mesh_io.h"
#include "subvol/mesh/mesh_topology.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/workplace.h"

#include <catch2/catch.hpp>

#include <cstdio>
#include <string>

using subvol::test::Run;
using subvol::test::Workplace;

TEST_CASE("optimize untangles a mesh, proves it, and says which cells it could not make valid", "[slow][cli]") {
  const Workplace place;
  subvol::VolumeMesh mesh = subvol::test::lattice(3, 3, 3);
  const subvol::MeshTopology topology(mesh);
  double shift = 1.3;
  for (std::size_t v = 0; v < mesh.num_vertices(); ++v)
    if (!topology.is_boundary_vertex(static_cast<subvol::Index>(v))) mesh.positions[v].x() += shift = -shift;
  subvol::write_volume_mesh(place / "tangled.mesh", mesh);
  const Run run = place.run("optimize tangled.mesh -o valid.mesh -o valid.glb --report report.json --progress none");
  INFO(run.err);
  CHECK(run.status == 0);
  const nlohmann::json report = place.json("report.json");
  CHECK(report["command"] == "optimize");
  CHECK(report["input"]["quality"]["inverted_cells"] > 0);
  CHECK(report["quality"]["certified_cells"] == mesh.num_cells());
  CHECK(report["quality"]["min_scaled_jacobian"] > 0.99);
  CHECK(report["distance"]["max_percent"] < 0.1);
  CHECK(report["not_certified_cells"].empty());
  CHECK(place.run("check valid.mesh").status == 0);

  // A corner of the block on the wrong side, and a boundary that may not move.
  mesh.positions[0] = {1.5, 1.5, 1.5};
  subvol::write_volume_mesh(place / "stuck.mesh", mesh);
  const Run stuck = place.run("optimize stuck.mesh --fixed-boundary -o left.mesh --report left.json --progress none");
  CHECK(stuck.status == 1);
  CHECK(stuck.err.find("NOT VALID") != std::string::npos);
  CHECK(place.json("left.json")["valid"] == false);
  CHECK(place.json("left.json")["not_certified_cells"][0] == 0);
  CHECK(place.json("left.json")["inverted_at"][0]["determinant"] < 0);

  CHECK(place.run("optimize tangled.mesh").status == 2);
  CHECK(place.run("optimize tangled.mesh --fixed-boundary --target target.off -o a.mesh").status == 2);
  CHECK(place.run("optimize tangled.mesh --order 2 -o a.vtu").status == 2);
}

TEST_CASE("The distances that optimize decides by are those of its file", "[cli][slow]") {
  const Workplace place;
  subvol::write_volume_mesh(place / "tangled.mesh", subvol::samples::tangled_ball());
  const std::string with_target = "template.mesh --target target.off";
  for (const std::string& words :
       {with_target, with_target + " --tolerance 9 --max-tolerance 9", std::string("tangled.mesh")}) {
    const Run run = place.run("optimize " + words + " --force -o o.mesh --report r.json --progress none");
    INFO(words << ": " << run.err);
    const auto report = place.json("r.json");
    const double mean = report.at("distance").at("mean_percent"), max = report.at("distance").at("max_percent");
    const auto& options = report.at("options");
    const bool within = mean <= options.at("tolerance") && max <= options.at("max-tolerance");
    CHECK(report.at("converged") == within);
    CHECK(run.status == (within ? 0 : 4));
    char figure[40];
    std::snprintf(figure, sizeof figure, within ? "boundary within %.4g %%" : "largest %.4g %%", max);
    CHECK(report.at("explanation").get<std::string>().find(figure) != std::string::npos);
  }
}

TEST_CASE("optimize curves a straight mesh to a surface", "[cli][slow]") {
  const Workplace place;
  const Run run = place.run(
      "optimize template.mesh --target target.off --order 2 --tolerance 0.5 -o curved.vtu --report report.json "
      "--progress none");
  INFO(run.err);
  CHECK(run.status == 0);
  const nlohmann::json report = place.json("report.json");
  CHECK(report["command"] == "optimize");
  CHECK(report["orders"]["max"] == 2);
  CHECK(report["valid"] == true);
  CHECK(report["distance"]["mean_percent"] < 0.5);
  // Seven cells of order 2 cannot come closer.
  CHECK(place.run("optimize template.mesh --target target.off --order 2 -o b.vtu --progress none").status == 4);
}

TEST_CASE("The report of optimize has the same entries for straight and for curved cells", "[cli][slow]") {
  const Workplace place;
  const std::string optimize = "optimize template.mesh --target target.off --max-iterations 1 ";
  place.run(optimize + "-o straight.mesh --report straight.json");
  place.run(optimize + "--order 2 -o curved.vtu --report curved.json");
  const nlohmann::json straight = place.json("straight.json"), curved = place.json("curved.json");
  for (const auto& [entry, value] : straight.items()) {
    INFO(entry);
    if (entry != "topology") CHECK(curved.contains(entry));  // of straight cells only
  }
  for (const char* entry : {"mesh", "target", "quality"}) CHECK(curved.at("input").contains(entry));
  CHECK(curved.at("input").at("mesh") == straight.at("input").at("mesh"));
  CHECK(curved.at("input").at("quality") == straight.at("input").at("quality"));
  CHECK(curved.at("seconds").contains("untangle"));
  CHECK(curved.at("not_certified_cells").empty());
  for (const auto& report : {straight, curved}) CHECK(report.at("initial_distance").at("mean_percent") > 1);
  CHECK(curved.at("options").at("lambda") == 0.0025);
  CHECK(straight.at("options").contains("max-tolerance"));
  CHECK_FALSE(curved.at("options").contains("max-tolerance"));
}
