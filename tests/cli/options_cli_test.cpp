// SPDX-License-Identifier: GPL-3.0-or-later
// Options on the command line and in files, and the help on them.

#include "samples/shapes.h"
#include "subvol/io/mesh_io.h"
#include "tests/support/workplace.h"

#include <catch2/catch.hpp>

#include <string>

using subvol::test::content_of;
using subvol::test::kFit;
using subvol::test::Run;
using subvol::test::Workplace;

TEST_CASE("Every verb explains itself", "[cli][slow]") {
  const Workplace place;
  const Run all = place.run("--help");
  CHECK(all.status == 0);
  for (const std::string verb : {"fit", "shell", "subdivide", "check", "convert", "report"}) {
    CHECK(all.out.find("\n  " + verb) != std::string::npos);
    const Run run = place.run(verb + " --help");
    INFO(run.out);
    CHECK(run.status == 0);
    CHECK(run.out.find("Example") != std::string::npos);
    CHECK(run.out.find(".mesh") != std::string::npos);
  }
  const Run version = place.run("--version");
  CHECK(version.status == 0);
  CHECK(version.out.starts_with("subvol "));
  CHECK(place.run("help").out == place.run("--help").out);
  CHECK(place.run("help fit").out == place.run("fit --help").out);
  CHECK(place.run("help template auto").out == place.run("template auto --help").out);
}

TEST_CASE("What stands in no file is refused before any work, and nothing is written", "[cli][slow]") {
  const Workplace place;
  const auto before = place.names();
  const auto refuses = [&](const std::string& arguments, int status, const std::string& word) {
    const Run run = place.run(arguments);
    INFO(arguments << '\n' << run.err);
    CHECK(run.status == status);
    CHECK(run.err.find(word) != std::string::npos);
    CHECK(run.err.find(" s  ") == std::string::npos);  // no progress was told
    CHECK(place.names() == before);
  };
  refuses("", 2, "subcommand");
  refuses("frobnicate", 2, "frobnicate");
  refuses("optimise in.mesh -o out.mesh", 2, "there is no verb 'optimise'; did you mean optimize?");
  refuses("transmogrify", 2, "there is no verb 'transmogrify'; there are: fit");
  refuses("template splt in.mesh -o out.mesh", 2, "there is no verb 'template splt'; did you mean split?");
  refuses("template frobnicate", 2, "there are: auto");
  refuses("--helpp", 2, "there is no option '--helpp'; did you mean --help?");
  refuses("fit --helpp", 2, "did you mean --help?");
  refuses("fit target.off --tolerence 1 -o out.glb", 2, "did you mean --tolerance?");
  refuses("template carve --zzzzzzz", 2, "template carve --help lists them");
  refuses("fit target.off --cells 3 -o out.glb", 2, "--cells");
  refuses("fit target.off --template template.mesh", 2, "-o");
  refuses(kFit + "--levels 0 -o out.glb", 2, "levels");
  refuses(kFit + "--levels 7 -o out.glb", 2, "levels");
  refuses(kFit + "--levels two -o out.glb", 2, "levels");
  refuses(kFit + "--tolerance -1 -o out.glb", 2, "tolerance");
  refuses(kFit + "--tolerance nan -o out.glb", 2, "tolerance");
  refuses(kFit + "--crease-angle 181 -o out.glb", 2, "crease-angle");
  refuses(kFit + "--surface sphere -o out.glb", 2, "surface");
  refuses(kFit + "--solver magic -o out.glb", 2, "solver");
  refuses(kFit + "--progress loud -o out.glb", 2, "progress");
  refuses(kFit + "--threads 0 -o out.glb", 2, "threads");
  refuses(kFit + "--order 17 -o out.glb", 2, "order");
  refuses(kFit + "--order 3 --levels 2 -o out.glb", 2, "levels");
  refuses(kFit + "--basis legendre -o out.glb", 2, "order");
  refuses(kFit + "--adaptive -o out.glb", 2, "order");
  refuses(kFit + "--order 3 --basis spline -o out.glb", 2, "basis");
  refuses(kFit + "--order 3 -o out.usda", 2, "out.usda");
  refuses(kFit + "--order 3 -o cage:out.mesh", 2, "cage");
  refuses(kFit + "--order 10 -o out.msh", 2, "order");
  refuses(kFit + "-o cages:out.mesh", 2, "cages:");
  refuses(kFit + "-o out.mesh --report= target.off", 2, "--report: expected a value");
  refuses(kFit + "-o out.docx", 2, "out.docx");
  refuses(kFit + "-o out", 2, "out");
  refuses(kFit + "-o out.mesh -o ./out.mesh", 2, "twice");
  refuses(kFit + "-o template.mesh", 2, "template.mesh");
  refuses(kFit + "-o out.glb --config none.toml", 2, "none.toml");
  refuses(kFit + "-o nowhere/out.glb", 1, "nowhere/out.glb");
  refuses(kFit + "-o out.glb --report nowhere/report.json", 1, "nowhere/report.json");
  refuses("fit none.off --template template.mesh -o out.glb", 3, "none.off");
  refuses("fit target.off --template none.mesh -o out.glb", 3, "none.mesh");
  refuses("fit target.off --template target.off -o out.glb", 3, "target.off");
  refuses("check none.mesh", 3, "none.mesh");
  refuses("check template.mesh --target none.off", 3, "none.off");
  refuses("convert target.off -o out.mesh", 2, "out.mesh");
  refuses("convert template.mesh -o cage:out.obj", 2, "cage");
  refuses("convert template.mesh", 2, "output");
  refuses("subdivide template.mesh", 2, "-o");
  refuses("subdivide template.mesh --levels 9 -o out.mesh", 2, "levels");
}

TEST_CASE("Options may come from a file; the command line wins and unknown keys are errors", "[cli]") {
  const Workplace place(subvol::samples::bracket_sample());
  place.file("good.toml", "levels = 1\ntarget = \"unused.off\"\n");
  place.file("marked.toml", "\xEF\xBB\xBF[subdivide]\nlevels = 2\n");  // by an editor that begins files so
  place.file("table.toml", "[subdivide]\nlevels = 2\n[check]\njson = true\n");
  place.file("flat.toml", "levels = 2\n");
  place.file("wrong.toml", "levles = 2\n");
  CHECK(place.run("--config good.toml subdivide template.mesh -o a.mesh").status == 2);
  CHECK(place.run("--config wrong.toml subdivide template.mesh -o a.mesh").status == 2);
  CHECK(!place.has("a.mesh"));
  REQUIRE(place.run("subdivide template.mesh --config flat.toml -o b.mesh").status == 0);
  CHECK(subvol::read_volume_mesh(place / "b.mesh").num_cells() == 10 * 64);
  REQUIRE(place.run("subdivide template.mesh --config table.toml -o c.mesh").status == 0);
  CHECK(subvol::read_volume_mesh(place / "c.mesh").num_cells() == 10 * 64);
  REQUIRE(place.run("subdivide template.mesh --config marked.toml -o e.mesh").status == 0);
  CHECK(content_of(place / "e.mesh") == content_of(place / "c.mesh"));
  REQUIRE(place.run("subdivide template.mesh --config flat.toml --levels 1 -o d.mesh").status == 0);
  CHECK(subvol::read_volume_mesh(place / "d.mesh").num_cells() == 10 * 8);
}

TEST_CASE("A key of a file of options that means nothing is refused with its line, whichever table it is in", "[cli]") {
  const Workplace place(subvol::samples::bracket_sample());
  const std::string grid = "template grid --box 0 0 0 1 1 1 --counts 1 1 1 -o grid.mesh --force --config a.toml";
  const auto refuses = [&](const std::string& text, const std::string& message) {
    place.file("a.toml", text);
    const Run run = place.run(grid);
    CAPTURE(text, run.err);
    CHECK(run.status == 2);
    CHECK(run.err.find(message) != std::string::npos);
  };
  refuses("quiet = true\n\nlevles = 2\n", "a.toml:3: template grid has no option 'levles'");
  refuses("[fit]\ncells = 300\n# more\nlevles = 2\n", "a.toml:4: fit has no option 'levles'");
  refuses("[template.grid]\ncounts = [1,\n1,\n1]\nlevels = 2\n", "a.toml:5: template grid has no option 'levels'");
  refuses("[template]\nquiet = true\n", "a.toml:2: template has no option 'quiet': expected a table of a verb below");
  refuses("[fti]\ncells = 300\n", "a.toml:2: there is no verb 'fti'");
  refuses("[template.gird]\nquiet = true\n", "a.toml:2: there is no verb 'template gird'");
  refuses("margin = 1\n[template.grid]\nmargin = 2\n", "a.toml:3: 'margin' stands there a second time");
  place.file("a.toml", "[fit]\ncells = 300\n[template.auto]\ncells = 50\n[template.grid]\nquiet = true\n");
  CHECK(place.run(grid).status == 0);
}

TEST_CASE("Options that have no effect beside others or on the target are told", "[cli]") {
  const Workplace place;
  const Run run = place.run(kFit + "--levels 1 --max-iterations 1 --keep-groups --lambda-far 0.001 -o out.mesh");
  CAPTURE(run.err);
  CHECK(run.err.find("--keep-groups has no effect: the target's faces have no borders") != std::string::npos);
  CHECK(run.err.find("--lambda-far 0.001 has no effect: it is below --lambda-close, 0.005") != std::string::npos);
  std::string points;
  for (int i = 0; i < 64; ++i)
    points += std::to_string(i % 4) + " " + std::to_string(i / 4 % 4) + " " + std::to_string(i / 16) + "\n";
  place.file("points.xyz", points);
  CHECK(place.run("fit points.xyz --template template.mesh --keep-groups -o out.vtu").status == 2);
}
