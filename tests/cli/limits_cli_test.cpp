// SPDX-License-Identifier: GPL-3.0-or-later
// The program where something ends it: killed and resumed, without memory, without room on the disk.

#include "subvol/export/high_order_file.h"
#include "tests/support/workplace.h"

#include <catch2/catch.hpp>

#include <cmath>
#include <filesystem>
#include <thread>

#include <signal.h>

namespace fs = std::filesystem;
using namespace subvol::test;

namespace {

const std::string kShort = kFit + "--max-iterations 1 ";
constexpr int kStepsRanOut = 4;

/// Says that a test of memory is left out, where the sanitizers take more of it than any limit leaves.
bool memory_cannot_be_limited() {
  if (kSanitized) WARN("SKIPPED: with a sanitizer memory cannot be limited");
  return kSanitized;
}

/// Waits until a file is there; false after a while.
bool appears(const fs::path& file) {
  constexpr int kMostMilliseconds = kSanitized ? 600000 : 5000;
  for (int i = 0; i < kMostMilliseconds && !fs::exists(file); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  return fs::exists(file);
}

}  // namespace

TEST_CASE("A run that is killed goes on from its checkpoint to the same bytes", "[cli][checkpoint][slow]") {
  const auto [name, words] = GENERATE(table<std::string, std::string>(
      {{"out.mesh", kFit + "--levels 2 --max-iterations 3 -o out.mesh -o cage:cage.mesh"},
       {"out.vtu", kFit + "--order 2 --max-iterations 3 -o out.vtu"},
       {"out.mesh", "optimize template.mesh --target target.off -o out.mesh"}}));
  const Workplace place;
  REQUIRE(place.run(words).status % 4 == 0);
  const std::string wanted = content_of(place / name.c_str());

  const pid_t child = place.start(words + " --force --checkpoint c --every 0");
  REQUIRE(appears(place / "c"));
  kill(child, SIGKILL);
  place.finish(child);
  const Run resumed = place.run(words + " --force --checkpoint c --resume c --report r.json");
  INFO(resumed.err);
  CHECK(resumed.status % 4 == 0);
  CHECK(content_of(place / name.c_str()) == wanted);
  CHECK(place.json("r.json").at("resumed_from") == "c");
  CHECK(place.json("r.json").at("recalled_stages") >= 1);
}

TEST_CASE("A run that was interrupted leaves a checkpoint and goes on", "[cli][checkpoint][slow]") {
  const int signal = GENERATE(SIGINT, SIGTERM);
  const Workplace place;
  const std::string words = kFit + "--levels 2 --max-iterations 3 -o out.mesh";
  REQUIRE(place.run(words).status == kStepsRanOut);
  const std::string wanted = content_of(place / "out.mesh");
  const pid_t child = place.start(words + " --force --checkpoint c --every 0");
  REQUIRE(appears(place / "c"));
  kill(child, signal);
  const int status = place.finish(child).status;
  CHECK((status == 130 || status == kStepsRanOut));  // the latter: it was done already
  CHECK(place.run(words + " --force --resume c").status == kStepsRanOut);
  CHECK(content_of(place / "out.mesh") == wanted);
}

TEST_CASE("A run that was interrupted before anything was done leaves a checkpoint all the same",
          "[cli][checkpoint][slow]") {
  const Workplace place;
  place.file("c", "something else");
  const pid_t child = place.start(kFit + "--levels 3 --progress json -o out.mesh --checkpoint c --force");
  for (int i = 0; i < 600 && content_of(place / "stdout.txt").empty(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  kill(child, SIGINT);
  REQUIRE(place.finish(child).status == 130);
  CHECK(content_of(place / "c") != "something else");
  CHECK(place.run(kFit + "--levels 3 --time-limit 0.3 -o out.mesh --resume c --force").status == 4);
}

TEST_CASE("A checkpoint whose template depends on the time is kept with a warning", "[cli][checkpoint][slow]") {
  const Workplace place;
  const auto is_warned = [&](const std::string& words) {
    return place.run("fit target.off --levels 1 --cage-only --report r.json --force " + words).err.find("--resume") !=
           std::string::npos;
  };
  CHECK(is_warned("--time-limit 6 --checkpoint c"));  // half of it is enough for a template
  CHECK_FALSE(is_warned("--time-limit 6"));
  CHECK_FALSE(is_warned("--time-limit 0.1 --checkpoint c --template template.mesh"));
}

TEST_CASE("A checkpoint of another run is refused, and said why", "[cli][checkpoint][slow]") {
  const Workplace place;
  REQUIRE(place.run(kShort + "--levels 1 --report r.json --checkpoint c").status == kStepsRanOut);
  const auto refused = [&](const std::string& words, const char* why) {
    const Run run = place.run(words + " --resume c -o out.mesh");
    INFO(run.err);
    CHECK(run.status == 3);
    CHECK(run.err.find(why) != std::string::npos);
    CHECK(!place.has("out.mesh"));
  };
  refused(kShort + "--levels 2", "c: this checkpoint is of another run: --levels was 1, is 2");
  refused(kShort + "--levels 1 --solver lbfgs", "--solver was \"newton\", is \"lbfgs\"");
  refused(kShort + "--order 2", "--order was");
  place.file("target.off", subvol::samples::off_text(subvol::samples::torus_sample().target));
  refused(kShort + "--levels 1", "target was");

  const std::string bytes = content_of(place / "c");
  place.file("c", bytes.substr(0, bytes.size() / 2));
  refused(kShort + "--levels 1", "c: this checkpoint was cut off or changed");
  place.file("c", "OFF\n");
  refused(kShort + "--levels 1", "c: is no checkpoint");
  fs::remove(place / "c");
  refused(kShort + "--levels 1", "c");
}

TEST_CASE("A checkpoint is an output like others", "[cli][checkpoint]") {
  const Workplace place;
  place.file("c", "something else");
  CHECK(place.run(kFit + "--levels 1 --report r.json --checkpoint c").status == 2);
  CHECK(content_of(place / "c") == "something else");
  CHECK(place.run(kFit + "--levels 1 --report r.json --checkpoint r.json").status == 2);
  CHECK(place.run(kFit + "--levels 1 --report r.json --checkpoint nowhere/c").status == 1);
  CHECK(place.run(kFit + "--levels 1 --report r.json --every 5").status == 2);  // of what?
  CHECK(!place.has("r.json"));
}

TEST_CASE("A fit ends before the level that would take more memory than it may", "[cli][memory][slow]") {
  if (memory_cannot_be_limited()) return;
  const Workplace place;
  const Run run = place.run(kFit +
                            "--levels 6 --max-iterations 3 --memory-limit 200M --chord 1 -o out.mesh "
                            "--report r.json");
  INFO(run.err);
  CHECK(run.status == 4);
  const auto report = place.json("r.json");
  CHECK(report.at("stop_reason") == "memory_limit");
  CHECK(report.at("explanation").get<std::string>().find("MB of memory, the limit is 210 MB") != std::string::npos);
  CHECK(report.at("peak_memory_bytes") < 200 << 20);
  const std::size_t cells = subvol::read_volume_mesh(place / "out.mesh").num_cells();
  CHECK(report.at("quality").at("certified_cells") == cells);
}

TEST_CASE("Where memory ends the program, files are whole or not there", "[cli][memory][slow]") {
  if (memory_cannot_be_limited()) return;
  const Workplace place;
  for (const std::string& words : {kShort + "--levels 3 -o out.mesh -o out.glb", kShort + "--order 8 -o out.vtu"}) {
    const Run run = place.run(words + " --memory-limit 64M --force");
    INFO(words << '\n' << run.err);
    CHECK((run.status == 1 || run.status == 4));
    if (run.status == 1) CHECK(run.err.find("out of memory") != std::string::npos);
    if (place.has("out.mesh")) CHECK(subvol::read_volume_mesh(place / "out.mesh").num_cells() > 0);
    if (place.has("out.vtu")) CHECK(subvol::read_high_order(place / "out.vtu").mesh.space.num_cells() == 7);
  }
}

TEST_CASE("A limit of memory that makes no sense is a usage error", "[cli][memory]") {
  const Workplace place;
  CHECK(place.run(kFit + "--memory-limit 1K -o out.obj").status == 2);
  CHECK(place.run(kFit + "--memory-limit lots -o out.obj").status == 2);
}

TEST_CASE("A process that gets no memory ends in order, wherever that is", "[cli][memory][slow]") {
  if (memory_cannot_be_limited()) return;
  const Workplace place;
  for (const std::string& words : {kShort + "--levels 2 -o out.mesh -o out.glb", kShort + "--order 4 -o out.vtu"})
    for (const rlim_t megabytes : {2, 6, 13, 20, 30}) {
      const Run run =
          place.run(words + " --threads 2 --chord 0.05 --report r.json --quiet", RLIMIT_DATA, megabytes << 20);
      INFO(words << ", " << megabytes << " MB: " << run.err);
      const bool is_loaded = run.err.find("error while loading shared libraries") == std::string::npos;
      CHECK((run.status == 0 || run.status == 1 || run.status == 4 || !is_loaded));
      if (run.status == 1)  // the second: there is not even room for a second thread
        CHECK((run.err.find("out of memory") != std::string::npos ||
               run.err.find("Thread creation failed") != std::string::npos));
      for (const auto& file : place.names()) {
        CHECK(file.find(".tmp") == std::string::npos);
        if (file != "target.off" && file != "template.mesh") fs::remove(place / file.c_str());
      }
    }
}

TEST_CASE("A disk without room leaves what stood there, for every kind of output", "[cli][disk][slow]") {
  const Workplace place;
  // The thread sanitizer starts with a large file there, if it can, and dies of the limit.
  const subvol::test::Environment no_temporary_files("TMPDIR", (place / "none").string());
  for (const char* file : {"out.mesh", "out.vtk", "out.vtu", "out.msh", "out.glb", "out.gltf", "out.obj", "out.usda"})
    for (const bool existed : {false, true}) {
      if (existed) place.file(file, "old");
      const std::string name = file;
      // Some OpenMP libraries need files of a kilobyte for themselves.
      const Run run = place.run("subdivide template.mesh --levels 2 --force --chord 1 -o " + name, RLIMIT_FSIZE, 1200);
      INFO(name << ": " << run.err);
      CHECK(run.status == 1);
      CHECK(run.err.find(name + ": cannot write: File too large") != std::string::npos);
      std::set<std::string> left{"target.off", "template.mesh"};
      if (existed) left.insert(name);
      CHECK(place.names() == left);
      if (existed) CHECK(content_of(place / file) == "old");
      fs::remove(place / file);
    }
}

TEST_CASE("A report or checkpoint without room costs nothing else", "[cli][disk][slow]") {
  const Workplace place;
  fs::create_symlink("/dev/full", place / "full.json");
  const Run run = place.run(kShort + "--levels 1 --force -o out.mesh --report full.json");
  CHECK(run.status == 1);
  CHECK(run.err.find("full.json: cannot write: No space left on device") != std::string::npos);
  CHECK(subvol::read_volume_mesh(place / "out.mesh").num_cells() == 7 * 8);

  fs::create_symlink("/dev/full", place / "full");
  const Run kept = place.run(kShort + "--levels 1 --force -o out.mesh --checkpoint full --every 0 --report r.json");
  INFO(kept.err);
  CHECK(kept.status == kStepsRanOut);
  CHECK(kept.err.find("the checkpoint is not up to date: full: cannot write") != std::string::npos);
  CHECK(place.json("r.json").at("warnings").size() >= 1);
}

TEST_CASE("A report or a checkpoint does not replace a model, nor is a whole fit lost to an order", "[cli]") {
  const Workplace place;
  const std::string before = content_of(place / "target.off");
  for (const char* option : {"--report", "--checkpoint"}) {
    const Run run = place.run(kFit + "-o out.mesh --force " + option + " target.off");
    CHECK(run.status == 2);
    CHECK_THAT(run.err, Catch::Contains("target.off: .off is an extension of models"));
    CHECK(content_of(place / "target.off") == before);
  }
  const Run run = place.run(kFit + "--order 3 -o out.inp");
  CHECK(run.status == 2);
  CHECK_THAT(run.err, Catch::Contains("order 2 at most"));
}
