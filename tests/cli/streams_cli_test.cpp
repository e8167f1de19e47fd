// SPDX-License-Identifier: GPL-3.0-or-later
// The program with files that are none, names that are no text, a standard output that fails, and signals.

#include "subvol/io/mesh_io.h"
#include "tests/support/glb_reader.h"
#include "tests/support/workplace.h"

#include <catch2/catch.hpp>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include <signal.h>
#include <sys/stat.h>

namespace fs = std::filesystem;
using namespace subvol::test;

namespace {

/// Runs shell commands in a workplace, with the program as $SUBVOL; their exit status.
int shell(const Workplace& place, const std::string& commands) {
  const std::string folder = (place / "").string();
  const int status = std::system(("cd '" + folder + "' && SUBVOL='" + program() + "' && " + commands).c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace

TEST_CASE("Options from a file without a verb are a usage error", "[cli]") {
  const Workplace place;
  place.file("options.toml", "levels = 2\n[fit]\nlevels = 1\n");
  const Run run = place.run("--config options.toml");
  CHECK(run.status == 2);
  CHECK(run.err.find("subcommand") != std::string::npos);
  CHECK(place.run("--config options.toml template").status == 2);
}

TEST_CASE("Names that are not UTF-8 are written with a sign in place of what is not text", "[cli][slow]") {
  const Workplace place;
  place.file("t\xff.off", content_of(place / "target.off"));
  const Run run = place.run(
      "fit t\xff.off --template template.mesh --levels 1 --max-iterations 1 --chord 1 -o o\xff.glb "
      "-o o\xff.gltf -o o\xff.usda -o o\xff.vtu -o o\xff.msh --report r.json");
  INFO(run.err);
  CHECK(run.status == 4);
  for (const char* file : {"o\xff.gltf", "o\xff.usda", "o\xff.vtu", "o\xff.msh"}) CHECK(place.has(file));
  const subvol_tests::GlbFile glb(content_of(place / "o\xff.glb"));
  CHECK(glb.json.at("asset").at("extras").at("source") == "t\xEF\xBF\xBD.off");
  CHECK(place.json("r.json").at("input").at("target").at("path") == "t\xEF\xBF\xBD.off");
  CHECK(place.json("r.json").at("outputs").size() == 5);
}

TEST_CASE("A standard output that cannot be written to is an error, and costs no file", "[cli][slow]") {
  const Workplace place;
  const std::string check = "\"$SUBVOL\" check template.mesh --json 2> err";
  if (fs::exists("/dev/full")) {
    CHECK(shell(place, check + " > /dev/full") == 1);
    CHECK(content_of(place / "err") == "subvol: standard output: cannot write: No space left on device\n");
  }
  // The reader has gone before the first word.
  CHECK(shell(place, "{ sleep 0.2; " + check + "; echo $? > status; } | true") == 0);
  CHECK(content_of(place / "status") == "1\n");
  CHECK(content_of(place / "err") == "subvol: standard output: cannot write: Broken pipe\n");

  const std::string fit = "\"$SUBVOL\" " + kFit + "--levels 1 --max-iterations 1 --progress json --quiet -o ";
  CHECK(shell(place, "{ sleep 0.2; " + fit + "a.mesh 2> err; echo $? > status; } | true") == 0);
  CHECK(content_of(place / "status") == "4\n");
  CHECK(content_of(place / "err") == "subvol: standard output: cannot write: Broken pipe\n");
  // No file takes the place of an output that is closed.
  CHECK(shell(place, fit + "b.mesh >&- 2> err") == 4);
  CHECK(content_of(place / "err") == "subvol: standard output: cannot write: Bad file descriptor\n");
  for (const char* file : {"a.mesh", "b.mesh"}) CHECK(subvol::read_volume_mesh(place / file).num_cells() == 56);
  CHECK(shell(place, "\"$SUBVOL\" --help > out 2> err") == 0);
  CHECK(content_of(place / "err").empty());
}

TEST_CASE("Inputs that are pipes, devices or folders are refused, not waited for", "[slow][cli]") {
  const Workplace place;
  REQUIRE(mkfifo((place / "pipe.mesh").c_str(), 0600) == 0);
  REQUIRE(mkfifo((place / "pipe.off").c_str(), 0600) == 0);
  fs::create_symlink("/dev/zero", place / "zero.mesh");
  fs::create_directory(place / "folder.mesh");
  const auto refuses = [&](const std::string& words, int status, const std::string& why) {
    const Run run = place.run(words);
    INFO(words << '\n' << run.err);
    CHECK(run.status == status);
    CHECK(run.err.find(why) != std::string::npos);
  };
  refuses("check pipe.mesh", 3, "pipe.mesh: is a pipe, expected a file");
  refuses("check zero.mesh", 3, "zero.mesh: is a device, expected a file");
  refuses("check folder.mesh", 3, "folder.mesh: is a folder, expected a file");
  refuses("fit pipe.off --template template.mesh -o out.mesh", 3, "pipe.off: is a pipe");
  refuses(kFit + "--levels 1 --resume pipe.off -o out.mesh", 3, "pipe.off: is a pipe");
  refuses("shell target.off --thickness-file pipe.off -o out.mesh", 3, "pipe.off: is a pipe");
  refuses(kFit + "-o out.mesh --config pipe.off", 2, "pipe.off: expected a file");
  refuses(kFit + "-o out.mesh --config zero.mesh", 2, "zero.mesh: expected a file");
}

TEST_CASE("Outputs that are pipes are written to and not read back", "[cli][slow]") {
  const Workplace place(subvol::samples::bracket_sample());
  for (const std::string& words : {kFit + "--levels 1 --max-iterations 1", std::string("subdivide template.mesh")}) {
    fs::remove(place / "pipe.mesh");
    REQUIRE(mkfifo((place / "pipe.mesh").c_str(), 0600) == 0);
    const int status = shell(
        place, "{ cat pipe.mesh > copy.mesh & \"$SUBVOL\" " + words + " -o pipe.mesh --quiet; s=$?; wait; exit $s; }");
    CHECK(status % 4 == 0);
    CHECK(subvol::read_volume_mesh(place / "copy.mesh").num_cells() == 80);
  }
}

TEST_CASE("A link to the standard output is written through, to a file and to a pipe", "[cli][slow]") {
  const Workplace place;
  fs::create_symlink("/dev/stdout", place / "out.obj");
  CHECK(shell(place, "\"$SUBVOL\" convert template.mesh -o out.obj --force --quiet > to_file.obj") == 0);
  CHECK(shell(place, "\"$SUBVOL\" convert template.mesh -o out.obj --force --quiet | cat > to_pipe.obj") == 0);
  CHECK(content_of(place / "to_file.obj").starts_with("#"));
  CHECK(content_of(place / "to_file.obj") == content_of(place / "to_pipe.obj"));
  CHECK(shell(place,
              "export SUBVOL; bash -c '\"$SUBVOL\" template grid --box 0 0 0 1 1 1 --counts 1 1 1 --quiet "
              "--report >(cat > r.json); s=$?; sleep 1; exit $s'") == 0);
  CHECK(place.json("r.json")["command"] == "template grid");
}

TEST_CASE("A pipe that nobody reads is waited for until a signal comes", "[cli][slow]") {
  const Workplace place;
  REQUIRE(mkfifo((place / "pipe").c_str(), 0600) == 0);
  CHECK(place.run(kFit + "--levels 1 --checkpoint pipe -o out.mesh").status == 2);
  const pid_t child = place.start(kFit + "--levels 1 --max-iterations 1 -o out.mesh --report pipe");
  for (int i = 0; i < 600 && !place.has("out.mesh"); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  for (siginfo_t ended{}; ended.si_pid == 0;) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1000));
    kill(child, SIGTERM);
    waitid(P_PID, static_cast<id_t>(child), &ended, WEXITED | WNOHANG | WNOWAIT);
  }
  CHECK(place.finish(child).status == 130);
  CHECK(place.run("check out.mesh --quiet").status == 0);
}

TEST_CASE("An option without a value is a usage error, not one that was not given", "[cli]") {
  const Workplace place;
  for (const char* words : {"check template.mesh --target ''", "subdivide template.mesh -o a.mesh --report ''",
                            "fit target.off --template '' -o a.mesh", "check ''"})
    CHECK(shell(place, std::string("\"$SUBVOL\" ") + words) == 2);
  CHECK_FALSE(place.has("a.mesh"));
}

TEST_CASE("What cannot be done is said before a template is made", "[cli][templates][slow]") {
  const Workplace place;
  place.file("other.checkpoint", "OFF\n");
  REQUIRE(place.run(kFit + "--levels 1 --max-iterations 1 --report r.json --checkpoint c").status == 4);
  const auto before = place.names();
  const auto refuses = [&](const std::string& words, int status, const std::string& why) {
    const Run run = place.run("fit target.off --progress plain " + words);
    INFO(words << '\n' << run.err);
    CHECK(run.status == status);
    CHECK(run.err.find(why) != std::string::npos);
    CHECK(run.err.find('%') == std::string::npos);  // no progress has been told
    CHECK(place.names() == before);
  };
  refuses("-o x.bad", 2, "x.bad");
  refuses("-o nowhere/x.mesh", 1, "nowhere/x.mesh");
  refuses("--order 2 --levels 2 -o x.vtu", 2, "levels");
  refuses("--order 2 -o x.usda", 2, "x.usda");
  refuses("--order 10 -o x.msh", 2, "hex up to order 9, not 10");
  refuses("--point-weights area -o x.mesh", 2, "--point-weights");
  refuses("--levels 1 --resume other.checkpoint -o x.mesh", 3, "is no checkpoint");
  refuses("--levels 1 --resume none -o x.mesh", 3, "none: no such file");
  refuses("--levels 2 --max-iterations 1 --resume c -o x.mesh", 3, "--levels was 1, is 2");
  refuses("--order 2 --max-iterations 1 --resume c -o x.vtu", 3, "--order was");
}

TEST_CASE("A second Ctrl-C ends the program at once, with nothing half-written", "[cli][slow]") {
  const int signal = GENERATE(SIGINT, SIGTERM);
  const Workplace place(subvol::samples::torus_sample());
  const pid_t child = place.start(kFit + "--levels 4 --progress json -o out.mesh --report report.json");
  for (int i = 0; i < 600 && content_of(place / "stdout.txt").empty(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  const auto pause = [](int milliseconds) { std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds)); };
  kill(child, signal);
  pause(20);
  kill(child, SIGSTOP);  // so that it cannot come to its orderly end meanwhile
  pause(300);
  kill(child, signal);
  kill(child, SIGCONT);
  const Run run = place.finish(child);
  INFO(run.err);
  CHECK(run.status == 130);
  std::set<std::string> names = place.names();
  // The first may have brought it as far as the mesh already, which then is whole; never to the report.
  if (names.erase("out.mesh") > 0) CHECK(place.run("check out.mesh --quiet").status <= 1);
  CHECK(names == std::set<std::string>{"target.off", "template.mesh"});
}

TEST_CASE("Options of several values stand in the report with all of them", "[cli]") {
  const Workplace place;
  REQUIRE(place.run("template grid --box 0 0 0 2 1 1 --counts 2 1 1 -o a.mesh -o a.glb --report g.json").status == 0);
  const auto options = place.json("g.json").at("options");
  CHECK(options.at("box") == nlohmann::json({0, 0, 0, 2, 1, 1}));
  CHECK(options.at("counts") == nlohmann::json({2, 1, 1}));
  CHECK(place.json("g.json").at("outputs") == nlohmann::json({"a.mesh", "a.glb"}));
  REQUIRE(place.run("template carve a.mesh --list 0,1 -o b.mesh --report c.json").status == 0);
  CHECK(place.json("c.json").at("options").at("list") == nlohmann::json({0, 1}));
  CHECK(place.json("c.json").at("options").at("force") == false);
}
