// SPDX-License-Identifier: GPL-3.0-or-later
// Outputs that cannot be written, or that exist already.

#include "subvol/io/mesh_io.h"
#include "tests/support/workplace.h"

#include <catch2/catch.hpp>

#include <chrono>
#include <filesystem>
#include <string>
#include <thread>

#include <sys/types.h>

using subvol::test::content_of;
using subvol::test::kFit;
using subvol::test::Run;
using subvol::test::Workplace;

TEST_CASE("An output that exists is replaced only with --force", "[cli]") {
  const Workplace place;
  place.file("out.obj", "mine");
  const Run refused = place.run("convert template.mesh -o out.obj");
  CHECK(refused.status == 2);
  CHECK(refused.err.find("out.obj") != std::string::npos);
  CHECK(content_of(place / "out.obj") == "mine");
  CHECK(place.run("convert template.mesh -o out.obj --force").status == 0);
  CHECK(content_of(place / "out.obj") != "mine");
}

TEST_CASE("One file is no two outputs, whatever links lead to it", "[cli]") {
  const Workplace place;
  std::filesystem::create_symlink("a.mesh", place / "b.mesh");
  std::filesystem::create_directory_symlink(".", place / "here");
  for (const char* second : {"-o b.mesh", "--report b.mesh", "-o here/a.mesh"})
    CHECK(place.run(std::string("subdivide template.mesh -o a.mesh --force ") + second).status == 2);
  CHECK_FALSE(place.has("a.mesh"));
}

TEST_CASE("An output that cannot be written does not cost the others", "[cli][slow]") {
  const Workplace place;
  std::filesystem::create_symlink("/dev/full", place / "full.mesh");
  for (const char* verb : {"convert template.mesh", "subdivide template.mesh --report r.json",
                           "optimize template.mesh --max-iterations 1 --report r.json",
                           "fit target.off --template template.mesh --levels 1 --max-iterations 1 --report r.json"}) {
    const Run run = place.run(std::string(verb) + " --force -o full.mesh -o whole.mesh");
    INFO(verb << '\n' << run.err);
    CHECK(run.status == 1);
    CHECK(run.err.find("No space left") != std::string::npos);
    CHECK(subvol::read_volume_mesh(place / "whole.mesh").num_cells() > 0);
    std::filesystem::remove(place / "whole.mesh");
    if (!place.has("r.json")) continue;
    CHECK(place.json("r.json")["outputs"] == nlohmann::json{"whole.mesh"});
    std::filesystem::remove(place / "r.json");
  }
}

TEST_CASE("A name that is too long is found before the work", "[cli]") {
  const Workplace place;
  const Run run = place.run(kFit + "-o " + std::string(300, 'x') + ".mesh");
  CHECK(run.status == 1);
  CHECK(run.err.find(" s  ") == std::string::npos);  // no progress was told
}

TEST_CASE("A folder that cannot be written to is found before the work", "[cli]") {
  const Workplace place;
  const Run run = place.run(kFit + "-o /proc/out.mesh");
  CHECK(run.status == 1);
  CHECK(run.err.find("/proc/out.mesh") != std::string::npos);
  CHECK(run.err.find(" s  ") == std::string::npos);  // no progress was told
}

TEST_CASE("A file that somebody makes during the work is not replaced without --force", "[cli][slow]") {
  const Workplace place;
  const pid_t child = place.start(kFit + "--levels 1 --progress json -o out.mesh");
  for (int i = 0; i < 600 && content_of(place / "stdout.txt").empty() && content_of(place / "stderr.txt").empty(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  place.file("out.mesh", "precious");
  CHECK(place.finish(child).status == 1);
  CHECK(content_of(place / "out.mesh") == "precious");
}
