// SPDX-License-Identifier: GPL-3.0-or-later
// `fit`, `convert` and `check` report on the polynomial cells in .vtu and .msh.

#include "subvol/export/high_order_file.h"
#include "tests/support/element_fixtures.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/workplace.h"

#include <catch2/catch.hpp>

#include <string>

using namespace subvol;
using namespace subvol::test;
using Catch::Contains;

namespace {

/// A hex whose edge modes of one number have this amplitude.
HighOrderMesh waved_hex(Basis basis, int order, int mode, double amplitude) {
  const VolumeMesh straight = single_cell(CellKind::hex);
  HighOrderMesh mesh(ElementSpace(straight, basis, order), straight);
  for (std::size_t e = 0; e < mesh.space.topology().num_edges(); ++e)
    mesh.coefficients[mesh.space.edge_nodes(e) + static_cast<std::size_t>(mode) - 1] = Vec3(0, 0, amplitude);
  return mesh;
}

/// The text with the points of another file of the same size.
std::string with_points_of(std::string text, const std::string& other) {
  const auto range = [](const std::string& file) {
    const std::size_t begin = file.find('>', file.find("Name=\"Points\"")) + 1;
    return std::pair(begin, file.find('<', begin));
  };
  const auto [begin, end] = range(text);
  const auto [from, to] = range(other);
  return text.replace(begin, end - begin, other.substr(from, to - from));
}

}  // namespace

TEST_CASE("convert: Fourier cells become polynomials within the tolerance, or the status says that they did not",
          "[cli][slow]") {
  const Workplace place;
  write_volume(place / "low.vtu", waved_hex(Basis::fourier, 3, 2, 0.02));
  const Run low = place.run("convert low.vtu -o low.msh -o again.vtu");
  CHECK(low.status == 0);
  CHECK(low.err.find("polynomial cells") == std::string::npos);

  // The ninth sine has more half waves than a polynomial of order 12 follows.
  write_volume(place / "high.vtu", waved_hex(Basis::fourier, 10, 9, 0.02));
  const Run high = place.run("convert high.vtu -o high_again.vtu");
  CHECK(high.status == 4);
  CHECK_THAT(high.err, Contains("high_again.vtu: its polynomial cells are") && Contains("and proved to be within") &&
                           Contains("--map-tolerance"));
  const Run tolerated = place.run("convert high.vtu -o tolerated.vtu --map-tolerance 5");
  INFO(tolerated.err);
  CHECK(tolerated.status == 0);
  CHECK(place.run("convert high.vtu -o refused.vtu --map-tolerance -1").status == 2);
}

TEST_CASE("fit: the report tells of the polynomial cells of Fourier fits, and needs none for Legendre fits",
          "[cli][slow]") {
  const Workplace place;
  const std::string fit = "fit target.off --template template.mesh --order 2 --max-iterations 3 ";
  place.run(fit + "--basis fourier -o f.vtu --report f.json");
  const nlohmann::json cells = place.json("f.json")["polynomial_cells"];
  REQUIRE(cells.size() == 1);
  CHECK(cells[0]["file"] == "f.vtu");
  CHECK(cells[0]["within_map_tolerance"] == true);
  CHECK(cells[0]["distance_from_map_percent"] <= 0.001);
  CHECK(cells[0]["orders"]["basis"] == "legendre");
  CHECK(cells[0]["quality"]["cells"] == 7);
  CHECK(cells[0].contains("distance"));

  place.run(fit + "-o l.vtu --report l.json");
  const nlohmann::json report = place.json("l.json");
  CHECK(report["orders"]["basis"] == "legendre");
  CHECK_FALSE(report.contains("polynomial_cells"));
}

TEST_CASE("check: Lagrange cells of a .vtu are judged as they stand", "[cli]") {
  const Workplace place;
  const HighOrderMesh flat = waved_hex(Basis::legendre, 4, 1, 0), bent = waved_hex(Basis::legendre, 4, 1, 0.1),
                      folded = waved_hex(Basis::legendre, 4, 3, 2);
  write_volume(place / "flat.vtu", flat);
  write_volume(place / "bent.vtu", bent);
  write_volume(place / "folded.vtu", folded);
  const Run same = place.run("check bent.vtu");
  CHECK(same.status == 0);
  CHECK_THAT(same.out, Contains("as other programs read them: the same map"));

  const std::string text = content_of(place / "flat.vtu");
  place.file("differs.vtu", with_points_of(text, content_of(place / "bent.vtu")));
  REQUIRE(place.run("check differs.vtu --json --report differs.json").status == 0);
  const nlohmann::json differs = place.json("differs.json")["lagrange_cells"];
  CHECK(differs["differs_from_map"] == true);
  CHECK(differs["difference_from_map_percent"] > 1);
  CHECK(differs["valid"] == true);

  place.file("inverted.vtu", with_points_of(text, content_of(place / "folded.vtu")));
  const Run inverted = place.run("check inverted.vtu --report inverted.json");
  CHECK(inverted.status == 1);
  CHECK_THAT(inverted.out, Contains("0 of 1 certified") && Contains("NOT VALID"));
  CHECK(place.json("inverted.json")["valid"] == false);
}

TEST_CASE("optimize: curved cells of other programs are untangled, and their boundary keeps its shape", "[slow][cli]") {
  const Workplace place;
  const VolumeMesh block = lattice(3, 3, 3);
  HighOrderMesh mesh(ElementSpace(block, Basis::legendre, 2), block);
  for (std::size_t v = 0; v < block.num_vertices(); ++v)
    if (!mesh.space.topology().is_boundary_vertex(static_cast<Index>(v)))
      mesh.coefficients[v] += Vec3(1.2, -0.9, 0.8) * (v % 2 == 0 ? 1 : -1);
  write_volume(place / "tangled.msh", mesh);
  CHECK(place.run("check tangled.msh").status == 1);
  const Run run = place.run("optimize tangled.msh -o valid.msh -o valid.vtu --report valid.json");
  INFO(run.err);
  CHECK(run.status == 0);
  const nlohmann::json report = place.json("valid.json");
  CHECK(report["valid"] == true);
  CHECK(report["input"]["quality"]["inverted_cells"] > 0);
  CHECK(report["quality"]["min_scaled_jacobian"] > 0.9);
  CHECK(report["volume"].get<double>() == Approx(27).epsilon(1e-12));
  CHECK(place.run("check valid.msh").status == 0);

  place.run("optimize tangled.msh -o first.vtu --checkpoint c.bin --max-iterations 3");
  const Run resumed =
      place.run("optimize tangled.msh -o again.vtu --resume c.bin --max-iterations 3 --report again.json");
  INFO(resumed.err);
  CHECK(place.json("again.json")["recalled_stages"] > 0);
  CHECK(content_of(place / "first.vtu") == content_of(place / "again.vtu"));

  // Options and files that do not go with it.
  for (const char* option : {"--sizes uniform", "--tolerance 1", "--lambda 1"}) {
    const Run refused = place.run("optimize tangled.msh -o x.vtu " + std::string(option));
    CHECK(refused.status == 2);
    CHECK_THAT(refused.err, Contains("not for curved cells"));
  }
  CHECK(place.run("optimize tangled.msh -o x.usda").status == 2);
}

TEST_CASE("orders that a format does not hold are refused before the work, with one status, by every verb",
          "[cli][slow]") {
  const Workplace place;
  const VolumeMesh prism{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}},
                         {CellKind::prism},
                         {0, 6},
                         {0, 1, 2, 3, 4, 5}};
  write_volume(place / "curved.mfem", HighOrderMesh(ElementSpace(prism, Basis::legendre, 3), prism));
  for (const std::string verb :
       {"convert curved.mfem", "optimize curved.mfem", "optimize curved.mfem --target target.off",
        "fit target.off --template template.mesh --order 10", "optimize template.mesh --target target.off --order 10",
        "fit target.off --order 10", "shell target.off --thickness 1% --order 3"})
    for (const char* name : {"x.msh", "x.inp", "x.xdmf", "x.usda"}) {
      const Run run = place.run(verb + " --quiet -o " + name);
      CAPTURE(verb, name, run.err);
      CHECK(run.status == 2);
      CHECK_THAT(run.err, Contains(std::string(name) + ": "));
      CHECK_FALSE(place.has(name));
    }
}

TEST_CASE("fit and optimize: curved cells of other programs are the start of a fit", "[cli][slow]") {
  const Workplace place;
  const std::string fit = "fit target.off --max-iterations 5 ";
  place.run(fit + "--template template.mesh --order 2 -o curved.msh --report first.json");
  const Run higher = place.run(fit + "--template curved.msh --order 3 -o higher.vtu --report higher.json");
  INFO(higher.err);
  CHECK(place.json("higher.json")["orders"]["max"] == 3);
  CHECK(place.json("higher.json")["valid"] == true);
  const Run again = place.run("optimize curved.msh --target target.off -o again.vtu --quantize --report again.json");
  INFO(again.err);
  const std::size_t warned = again.err.find("--quantize has no effect");
  CHECK(warned != std::string::npos);
  CHECK(again.err.find("--quantize has no effect", warned + 1) == std::string::npos);
  const nlohmann::json report = place.json("again.json");
  CHECK(report["command"] == "optimize");
  CHECK(report["orders"]["max"] == 2);
  const double before = place.json("first.json")["distance"]["mean_percent"];
  CHECK(report["distance"]["mean_percent"].get<double>() < 1.05 * before);
  CHECK(place.run("optimize curved.msh --target target.off --sizes uniform -o x.vtu").status == 2);
  CHECK_THAT(place.run("fit target.off --template curved.msh -o x.mesh").err, Contains("fit --order"));
}

TEST_CASE("convert, optimize: linear cells that are not valid though the curved ones are, are told", "[slow][cli]") {
  // A tet whose edge nodes bend it so far that one of eight linear tets is inverted.
  const Workplace place;
  place.file("tet.msh",
             "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n10\n1 -0.598 0.553 0.581\n2 0.293 -0.644 0.707\n"
             "3 0.707 0 0.707\n4 0 0 1\n5 -0.23 -0.068 0.971\n6 0.541 -0.348 0.765\n7 0.055 0.276 0.644\n"
             "8 -0.336 0.311 0.889\n9 0.159 -0.348 0.924\n10 0.383 0 0.924\n$EndNodes\n$Elements\n1\n"
             "1 11 2 1 1 1 2 3 4 5 6 7 8 10 9\n$EndElements\n");
  CHECK(place.run("check tet.msh").status == 0);
  const Run converted = place.run("convert tet.msh -o linear.mesh");
  CHECK(converted.status == 1);
  CHECK_THAT(converted.err, Contains("1 of 8 are inverted"));
  CHECK(place.run("convert tet.msh -o finer.mesh --intervals 32").status == 0);
  const Run optimized = place.run("optimize tet.msh --fixed-boundary -o optimized.mesh --report report.json");
  CHECK(optimized.status == 1);
  CHECK(place.json("report.json")["valid"] == true);
  CHECK(place.json("report.json")["linear_cells"]["valid"] == false);
}
