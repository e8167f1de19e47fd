// SPDX-License-Identifier: GPL-3.0-or-later
// subvol batch as its users run it: what is recorded, what is kept, and what is left if it is ended in any way.

#include "tests/support/workplace.h"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include <chrono>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <signal.h>

namespace fs = std::filesystem;
using namespace subvol::test;
using nlohmann::json;

namespace {

/// A program in the place of subvol that does what the name of its input says, and notes that it was run.
constexpr const char* kActor = R"sh(#!/bin/sh
base=$(basename "$2" .off)
echo "$base" >> "$LOG"
case "$base" in
  good*) ;;
  status*) echo "about status" >&2; exit "${base#status}" ;;
  crash*) kill -SEGV $$ ;;
  killed*) kill -KILL $$ ;;
  slow*) sleep 60 ;;
  stubborn*) trap '' TERM; sleep 60 & wait; sleep 60 ;;
  pause*) sleep 0.2 ;;
  family*) sleep 60 & ;;
  ended*) [ "$(grep -c "$base" "$LOG")" -eq 1 ] || exit 0
    setsid --fork sh -c ": > \"$LOG.killer\"; sleep 0.3; kill -${base#ended} $PPID"
    while [ ! -e "$LOG.killer" ]; do sleep 0.01; done
    kill "-${base#ended}" $$ ;;
esac
)sh";

/// A folder in which batches are run.
class BatchPlace {
 public:
  BatchPlace() : log_("LOG", (place_ / "log").string()) {
    place_.file("actor", kActor);
    fs::permissions(place_ / "actor", fs::perms::owner_all);
  }

  Run act(const std::string& words) const {
    return place_.run("batch --program ./actor --quiet --verb check " + words);
  }
  pid_t start(const std::string& words) const {
    return place_.start("batch --program ./actor --quiet --verb check " + words);
  }
  void manifest(const std::vector<std::string>& inputs) const {
    std::string text = "input\n";
    for (const std::string& input : inputs) text += input + ".off\n";
    place_.file("m.csv", text);
  }
  /// All records of a folder.
  std::vector<json> records(const std::string& folder = "out") const {
    std::vector<json> all;
    std::istringstream lines(content_of(place_ / (folder + "/records.jsonl").c_str()));
    for (std::string line; std::getline(lines, line);) all.push_back(json::parse(line));
    return all;
  }
  std::string class_of(const std::string& id) const {
    std::string found = "none";
    for (const json& record : records())
      if (record["id"] == id + ".off") found = record["class"];
    return found;
  }
  /// How often the program was run, by input.
  std::map<std::string, int> runs() const {
    std::map<std::string, int> all;
    std::istringstream lines(content_of(place_ / "log"));
    for (std::string line; std::getline(lines, line);) ++all[line];
    return all;
  }
  const Workplace& operator*() const { return place_; }
  const Workplace* operator->() const { return &place_; }

 private:
  Workplace place_;
  Environment log_;
};

std::vector<std::string> numbered(const std::string& name, int count) {
  std::vector<std::string> names;
  for (int i = 0; i < count; ++i) names.push_back(name + std::to_string(i));
  return names;
}

template <class Condition>
bool comes_true(const Condition& condition) {
  for (int i = 0; i < 500; ++i) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return false;
}

bool any_process_named(const std::string& words) {
  for (const auto& entry : fs::directory_iterator("/proc")) {
    const std::string line = content_of(entry.path() / "cmdline");
    if (line.find(words) != std::string::npos) return true;
  }
  return false;
}

}  // namespace

TEST_CASE("A batch runs verbs, keeps what they write, and records what is true of it", "[cli][batch][slow]") {
  const Workplace place;
  place.file("bad.off", "OFF\nnonsense\n");
  place.file("m.csv",
             "id,verb,input,options\n"
             "ball,template auto,target.off,--cells 50\n"
             "surface,check,target.off,\n"
             "mesh,check,template.mesh,--target target.off\n"
             "bad,check,bad.off,\n"
             "gone,check,gone.off,\n");
  const Run run = place.run("batch m.csv -o out --jobs 2 --progress plain");
  INFO(run.err);
  CHECK(run.status == 1);
  CHECK(run.err.find("5 models, 5 to run") != std::string::npos);
  CHECK(run.err.find("5 run, 0 kept; 3 valid; 2 rejected") != std::string::npos);
  CHECK(place.run("check out/models/ball/result.mesh --quiet").status == 0);
  std::map<std::string, json> records;
  std::istringstream lines(content_of(place / "out/records.jsonl"));
  for (std::string line; std::getline(lines, line);) records[json::parse(line)["id"]] = json::parse(line);
  REQUIRE(records.size() == 5);
  const json report = json::parse(content_of(place / "out/models/ball/report.json"));
  const json& ball = records["ball"];
  CHECK(ball["status"] == "valid");
  CHECK(ball["outputs"] == json{"result.mesh"});
  CHECK(ball["cells"] == report["quality"]["cells"]);
  CHECK(ball["min_scaled_jacobian"] == report["quality"]["min_scaled_jacobian"]);
  CHECK(ball["certified"] == true);
  CHECK(ball["run"]["cpu_seconds"].get<double>() > 0);
  CHECK(ball["run"]["peak_memory_bytes"] == report["peak_memory_bytes"]);
  CHECK(records["surface"]["fillable"] == true);
  CHECK(records["mesh"]["mean_distance_percent"].get<double>() > 0);
  CHECK(records["bad"]["class"] == "rejected");
  CHECK(records["bad"]["reason"].get<std::string>().starts_with("bad.off:2"));  // not the path on this machine
  CHECK(records["gone"]["reason"].get<std::string>().starts_with("gone.off"));
  CHECK(fs::is_empty(place / "out/work"));
  // Nothing is left to do, until something changes.
  CHECK(place.run("batch m.csv -o out --dry-run").out.empty());
  place.file("bad.off", content_of(place / "target.off"));
  CHECK(place.run("batch m.csv -o out --dry-run").out == "bad\n");
  CHECK(place.run("batch m.csv -o out --only rejected --dry-run").out == "bad\ngone\n");
  place.file("m.csv",
             "id,verb,input,options\nball,template auto,target.off,--cells 60\nmesh,check,template.mesh,"
             "--target target.off\n");
  CHECK(place.run("batch m.csv -o out --dry-run").out == "ball\n");
}

TEST_CASE("A crash, a signal and a time limit cost one record", "[cli][batch][slow]") {
  const BatchPlace place;
  place.manifest({"good1", "crash", "killed", "slow", "stubborn", "status2", "status3", "status17", "family", "good2"});
  const auto begin = std::chrono::steady_clock::now();
  CHECK(place.act("m.csv -o out --jobs 4 --time-limit 1 --grace 0.5").status == 1);
  CHECK(std::chrono::steady_clock::now() - begin < std::chrono::seconds(15));
  const std::map<std::string, std::string> wanted{
      {"good1", "valid"},      {"good2", "valid"},     {"family", "valid"},        {"crash", "crash"},
      {"killed", "killed"},    {"slow", "time_limit"}, {"stubborn", "time_limit"}, {"status2", "usage"},
      {"status3", "rejected"}, {"status17", "error"}};
  for (const auto& [id, outcome] : wanted) {
    INFO(id);
    CHECK(place.class_of(id) == outcome);
  }
  CHECK(place.records().size() == 10);
  for (const json& record : place.records())
    if (record["id"] == "status17.off") {
      CHECK(record["exit_code"] == 17);
      CHECK(record["reason"] == "about status");
    } else if (record["id"] == "crash.off") {
      CHECK(record["signal"] == "SIGSEGV");
    }
  CHECK(content_of(*place / "out/models/status3.off/messages.txt") == "about status\n");
  // Only failures are run again.
  CHECK(place.act("m.csv -o out --only failed --time-limit 0.2 --grace 0.2").status == 1);
  CHECK(place.runs()["crash"] == 2);
  CHECK(place.runs()["good1"] == 1);
  CHECK(place.act("m.csv -o out").status == 1);  // all have a record
  CHECK(place.runs()["crash"] == 2);
}

TEST_CASE("A limit on memory is one for each model", "[cli][batch][slow]") {
  if (kSanitized) return;
  const Workplace place;
  const Run run = place.run("batch target.off -o out --memory-limit 64M --quiet -- --cells 200000 --time-limit 60");
  CHECK(run.status == 1);
  CHECK(json::parse(content_of(place / "out/records.jsonl"))["class"] == "out_of_memory");
}

TEST_CASE("Batches that are killed at any moment lose nothing but the models that were running", "[cli][batch][slow]") {
  const BatchPlace place;
  constexpr int kModels = 60, kJobs = 3;
  place.manifest(numbered("pause", kModels));
  std::size_t before = 0;
  int kills = 0;
  for (; kills < 3; ++kills) {
    const pid_t batch = place.start("m.csv -o out --jobs 3");
    const auto num_records = [&] { return place->has("out/records.jsonl") ? place.records().size() : 0; };
    REQUIRE(comes_true([&] { return num_records() >= before + 9; }));
    kill(batch, SIGKILL);
    place->finish(batch);
    before = place.records().size();  // each line can be read
  }
  CHECK(comes_true([&] { return !any_process_named("./pause") && !any_process_named((*place / "actor").string()); }));
  CHECK(place.act("m.csv -o out --jobs 3").status == 0);
  std::set<std::string> ids;
  for (const json& record : place.records()) ids.insert(record["id"]);
  CHECK(ids.size() == kModels);
  CHECK(place.records().size() == kModels);  // none was done twice
  int runs = 0;
  for (const auto& [input, count] : place.runs()) runs += count;
  CHECK(runs <= kModels + kills * kJobs);
  CHECK(fs::is_empty(*place / "out/work"));
}

TEST_CASE("A scheduler that ends a batch may end its processes first", "[cli][batch][slow]") {
  for (const std::string model : {"endedTERM", "endedKILL"}) {
    INFO(model);
    const BatchPlace place;
    place.manifest({model, "good"});
    CHECK(place.act("m.csv -o out --jobs 1").status != 0);
    CHECK(place.class_of(model) == "none");
    CHECK(place.act("m.csv -o out --jobs 1").status == 0);
    CHECK(place.class_of(model) == "valid");
    CHECK(place.records().size() == 2);
  }
}

TEST_CASE("Workers on one folder share the models", "[cli][batch][slow]") {
  const BatchPlace place;
  place.manifest(numbered("pause", 30));
  const pid_t first = place.start("m.csv -o out --jobs 2"), second = place.start("m.csv -o out --jobs 2"),
              third = place.start("m.csv -o out --jobs 2 --shard 1/2");
  for (const pid_t worker : {first, second, third}) CHECK(place->finish(worker).status == 0);
  CHECK(place.records().size() == 30);
  for (const auto& [input, count] : place.runs()) CHECK(count == 1);
}

TEST_CASE("Ctrl-C ends a batch in order, and it goes on afterwards", "[cli][batch][slow]") {
  const BatchPlace place;
  place.manifest({"good1", "slow1", "slow2", "good2"});
  for (const int signal : {SIGINT, SIGTERM}) {
    const pid_t batch = place.start("m.csv -o out --jobs 1 --grace 5");
    REQUIRE(comes_true([&] { return place.runs()["slow1"] == (signal == SIGINT ? 1 : 2); }));
    kill(batch, signal);
    CHECK(place->finish(batch).status == 130);
    CHECK(place.class_of("good1") == "valid");
    CHECK(place.class_of("slow1") == "none");
    CHECK(fs::is_empty(*place / "out/work"));
  }
  CHECK(place.runs()["good1"] == 1);
  CHECK(place.runs()["slow2"] == 0);
}

TEST_CASE("Shards, jobs and threads make the same results and records", "[cli][batch][slow]") {
  const Workplace place;
  std::string rows = "id,verb,input,cells\n";
  for (int i = 0; i < 8; ++i)
    rows += "m" + std::to_string(i) + ",template auto,target.off," + std::to_string(20 + 5 * i) + "\n";
  place.file("m.csv", rows);
  CHECK(place.run("batch m.csv -o whole --jobs 1 --threads 2 --quiet").status == 0);
  for (const char* shard : {"3/3", "1/3", "2/3"}) {
    CHECK(place.run(std::string("batch m.csv -o shared --jobs 2 --quiet --shard ") + shard).status == 0);
    CHECK(place.run(std::string("batch m.csv --quiet -o apart") + shard[0] + " --shard " + shard).status == 0);
  }
  CHECK(place.run("batch merge whole -o whole.jsonl --reproducible").status == 0);
  CHECK(place.run("batch merge shared -o shared.jsonl --reproducible").status == 0);
  CHECK(place.run("batch merge apart1 apart2 apart3 -o apart.jsonl --reproducible").status == 0);
  CHECK(content_of(place / "whole.jsonl") == content_of(place / "shared.jsonl"));
  CHECK(content_of(place / "whole.jsonl") == content_of(place / "apart.jsonl"));
  CHECK(content_of(place / "whole.jsonl").find("seconds") == std::string::npos);
  for (int i = 0; i < 8; ++i) {
    const std::string file = "/models/m" + std::to_string(i) + "/result.mesh";
    CHECK(content_of(place / ("whole" + file).c_str()) == content_of(place / ("shared" + file).c_str()));
  }
}

TEST_CASE("The report of a batch is one page, and compares with another", "[cli][batch][slow]") {
  const Workplace place;
  place.file("m.csv", "id,input,options\nball,target.off,--cells 60 --time-limit 20\n");
  const std::string batch = "batch m.csv --verb template --quiet";
  CHECK(place.run("batch m.csv --quiet -o one --verb template").status == 3);  // not a verb, but a group
  for (const char* cells : {"60", "20"}) {
    place.file("m.csv", std::string("id,verb,input,cells\nball,template auto,target.off,") + cells +
                            "\nsurface,check,target.off,\n");
    CHECK(place.run(std::string("batch m.csv --quiet -o with") + cells).status == 0);
  }
  const Run run = place.run("batch report with20 -o page.html --compare with60 --json");
  INFO(run.err);
  CHECK(run.status == 0);
  const json summary = json::parse(run.out);
  CHECK(summary["models"] == 2);
  CHECK(summary["valid_share"] == 1);
  CHECK(summary["comparison"]["common"] == 2);
  const std::string page = content_of(place / "page.html");
  CHECK(page.find("with20/models/ball/report.json") != std::string::npos);
  CHECK(page.find("data:image/png;base64,") != std::string::npos);
  CHECK(page.find("<script") == std::string::npos);
  CHECK(place.run("batch report with20 -o page.html").status == 2);  // exists
  CHECK(place.run("batch report with20 -o page.html --force --no-pictures --quiet").err.empty());
  CHECK(content_of(place / "page.html").find("image/png") == std::string::npos);
  CHECK(place.run("batch report nowhere -o p.html").status == 3);
  CHECK(place.run("batch report with20").status == 2);
  CHECK(place.run("batch merge with20 with60 -o all.jsonl").status == 0);
}

TEST_CASE("A row on the command line is a batch of one, whose record can be printed", "[slow][cli][batch]") {
  const Workplace place;
  const std::string words = R"(batch --row {"id":"x","verb":"check","input":"target.off"} -o out --print --quiet)";
  const Run first = place.run(words);
  CHECK(first.status == 0);
  CHECK(json::parse(first.out)["id"] == "x");
  const Run again = place.run(words);  // is not run, and its record is printed
  CHECK(again.out == first.out);
  CHECK(place.run("batch target.off -o out --verb check --quiet -- --json").status == 0);
}

TEST_CASE("Command lines of batches that make no sense are refused before any work", "[cli][batch][slow]") {
  const Workplace place;
  place.file("file", "");
  const auto refuses = [&](const std::string& words, int status, const std::string& why) {
    const Run run = place.run("batch " + words);
    INFO(words << '\n' << run.err);
    CHECK(run.status == status);
    CHECK(run.err.find(why) != std::string::npos);
    CHECK_FALSE(place.has("out"));
  };
  refuses("target.off", 2, "-o: expected the folder");
  refuses("-o out", 2, "expected a manifest");
  refuses("target.off -o file", 2, "is not a folder");
  refuses("target.off -o out --shard 9/8", 2, "--shard");
  refuses("target.off -o out --only mending", 2, "--only: expected failed");
  refuses("target.off -o out --only failed --force", 2, "exclude");
  refuses("target.off -o out --write xyz", 2, "the extension must be one of");
  refuses("target.off -o out --program ./none", 2, "no such executable");
  refuses("target.off -o out --verb batch", 3, "no verb");
  refuses("target.off -o out -- --cels 3", 3, "fit has no option '--cels'");
  refuses("none.csv -o out", 3, "none.csv");
  refuses("no*.off -o out", 3, "no file matches");
  refuses("target.off target.off -o out", 3, "is also that of");
}
