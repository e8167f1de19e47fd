// SPDX-License-Identifier: GPL-3.0-or-later
// Records: written and read, claimed by several processes, and the plan that they lead to.

#include "cli/batch/record.h"
#include "cli/batch/batch_plan.h"
#include "cli/batch/latest_records.h"
#include "cli/batch/record_file.h"
#include "subvol/base/version.h"
#include "tests/support/temporary_folder.h"

#include <catch2/catch.hpp>

#include <fstream>
#include <map>
#include <string>
#include <vector>

#include <sys/wait.h>
#include <unistd.h>

using namespace subvol::cli;
using subvol::test::TemporaryFolder;
namespace fs = std::filesystem;

namespace {

std::string line_of(const BatchModel& model, Outcome outcome = Outcome::valid, const std::string& input_hash = "1f",
                    const Remains& remains = {}) {
  const WorkKey key{options_hash(model, ""), input_hash, subvol::version()};
  ChildEnd end;
  end.exit_code = 0;
  end.wall_seconds = 1.5;
  return record_line(model, key, {outcome, ""}, end, remains, "", 0);
}

BatchModel model_named(const std::string& id) { return {id, "check", "missing.off", {}, {}}; }

/// Runs `work` in a process of its own; returns its exit status.
template <class Work>
int in_process(const Work& work) {
  const pid_t child = fork();
  if (child == 0) _exit(work());
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace

TEST_CASE("A record is one line that gives its fields back", "[cli][batch]") {
  const Json report{{"quality", {{"cells", 8}, {"certified_cells", 8}, {"min_scaled_jacobian", 0.25}}},
                    {"distance", {{"mean_percent", 0.5}}},
                    {"creases", {{"target_curves", 18}, {"followed_curves", 17}}},
                    {"peak_memory_bytes", 12345}};
  const BatchModel model{"a \"b\"\n/c", "fit", "x.off", {"--cells", "3"}, {"mesh"}};
  const std::string line = line_of(model, Outcome::valid, "1f", {.report = report, .outputs = {"result.mesh"}});
  CHECK(line.find('\n') == std::string::npos);
  RecordReader reader;
  const RecordFields* fields = reader.read(line);
  REQUIRE(fields != nullptr);
  CHECK(fields->id == model.id);
  CHECK(fields->outcome == "valid");
  CHECK(fields->cells == 8);
  CHECK(fields->min_scaled_jacobian == 0.25);
  CHECK(std::isnan(fields->mean_scaled_jacobian));
  CHECK(fields->mean_distance_percent == 0.5);
  CHECK(fields->followed_edges == 17);
  CHECK(fields->wall_seconds == 1.5);
  CHECK(fields->peak_memory_bytes == 12345);
  CHECK(fields->key == WorkKey{options_hash(model, ""), "1f", subvol::version()});
  CHECK('"' + std::string(quoted_id(line)) + '"' == Json(model.id).dump());
  const Json json = Json::parse(line);
  CHECK(json["certified"] == true);
  CHECK(json["outputs"] == Json{"result.mesh"});
  CHECK(Json::parse(without_run(line)).contains("run") == false);
  for (const std::string& damaged : {line.substr(0, line.size() / 2), std::string("{}"), std::string(),
                                     std::string("\0", 1), std::string("{\"id\":\"x\"}"), "x" + line})
    CHECK(reader.read(damaged) == nullptr);
  CHECK(std::isnan(reader.read(line_of(model_named("y")))->cells));  // nothing is left of the record before
}

TEST_CASE("Only one process has a claim; it ends with the process and with those that it started", "[cli][batch]") {
  const TemporaryFolder folder;
  RecordFile records(folder.path());
  REQUIRE(records.claim("a"));
  const auto claims = [&](const char* id) {
    return in_process([&] { return int(RecordFile(folder.path()).claim(id)); });
  };
  CHECK(claims("a") == 0);
  CHECK(claims("b") == 1);
  CHECK(records.claim("b"));  // the other process is gone
  records.release("a");
  CHECK(claims("a") == 1);
  // A process that outlives the one that has started it keeps the claim: the model still runs.
  int ends[2];
  REQUIRE(pipe(ends) == 0);
  const int status = in_process([&] {
    RecordFile own(folder.path());
    if (!own.claim("c")) return 1;
    if (fork() == 0) {
      char byte = 0;
      close(ends[1]);
      (void)!read(ends[0], &byte, 1);  // until the test closes its end
      _exit(0);
    }
    return 0;
  });
  CHECK(status == 0);
  CHECK_FALSE(records.claim("c"));
  close(ends[1]);
  bool claimed = false;
  for (int i = 0; i < 100 && !claimed; ++i) usleep(20000), claimed = records.claim("c");
  CHECK(claimed);
  close(ends[0]);
}

TEST_CASE("Records of several processes do not mix, and each process sees those of others", "[cli][batch]") {
  const TemporaryFolder folder;
  RecordFile records(folder.path());
  constexpr int kProcesses = 4, kLines = 200;
  std::vector<pid_t> children;
  for (int p = 0; p < kProcesses; ++p) {
    children.push_back(fork());
    if (children.back() != 0) continue;
    RecordFile own(folder.path());
    for (int i = 0; i < kLines; ++i)
      own.append(line_of(model_named(std::to_string(p) + '/' + std::to_string(i)), Outcome::valid,
                         std::string(static_cast<std::size_t>(17 * i), 'f')));
    _exit(0);
  }
  for (const pid_t child : children) waitpid(child, nullptr, 0);
  records.append(line_of(model_named("own")));
  RecordReader reader;
  std::map<std::string, int> seen;
  records.read_new([&](std::string_view line) {
    const RecordFields* fields = reader.read(line);
    REQUIRE(fields != nullptr);
    ++seen[fields->id];
  });
  CHECK(seen.size() == kProcesses * kLines + 1);
  int more = 0;
  records.read_new([&](std::string_view) { ++more; });
  records.append(line_of(model_named("own")));
  records.read_new([&](std::string_view) { ++more; });  // of lines of its own a process needs no notice
  CHECK(more == 0);
}

TEST_CASE("A line that was cut off does not spoil the next one", "[cli][batch]") {
  const TemporaryFolder folder;
  const std::string whole = line_of(model_named("a"));
  folder.file("records.jsonl", whole + "\n" + whole.substr(0, 40));
  RecordFile(folder.path()).append(line_of(model_named("b")));
  const LatestRecords latest(std::vector{folder.path()});
  CHECK(latest.size() == 2);
  CHECK(latest.num_damaged() == 1);
  CHECK(latest.find("a") == whole);
  CHECK_THROWS(LatestRecords(std::vector{folder.path() / "none"}));
}

TEST_CASE("The last record of an id counts, over all folders", "[cli][batch]") {
  const TemporaryFolder one, two;
  RecordFile first(one.path()), second(two.path());
  first.append(line_of(model_named("b"), Outcome::crash));
  first.append(line_of(model_named("b")));
  first.append(line_of(model_named("c")));
  second.append(line_of(model_named("a")));
  second.append(line_of(model_named("c"), Outcome::rejected));
  const LatestRecords latest(std::vector{one.path(), two.path()});
  std::string text;
  latest.for_each([&](const LatestRecords::Entry& entry) {
    const Json json = Json::parse(entry.line);
    text += json["id"].get<std::string>() + ' ' + json["class"].get<std::string>() + ' ' +
            std::to_string(entry.folder) + '\n';
  });
  CHECK(text == "a valid 1\nb valid 0\nc rejected 1\n");
}

TEST_CASE("A plan leaves out what was done with the same input, options and version", "[cli][batch]") {
  const TemporaryFolder folder;
  folder.file("a.off", "surface");
  BatchManifest manifest{{folder.path()}, {}};
  for (const char* id : {"done", "other_input", "other_options", "other_version", "failed", "new"})
    manifest.models.push_back({id, "check", "a.off", {}, {}});
  FileHasher hasher(manifest.folders);
  const std::string hash = hasher.hash(manifest.models[0]).hash;
  std::vector<std::string> lines;
  for (const BatchModel& model : manifest.models)
    if (model.id != "new")
      lines.push_back(line_of(model, model.id == "failed" ? Outcome::crash : Outcome::valid, hash));
  lines[1] = line_of(manifest.models[1], Outcome::valid, "abc");
  BatchModel other = manifest.models[2];
  other.options = {"--quiet"};
  lines[2] = line_of(other, Outcome::valid, hash);
  const std::string version = '"' + std::string(subvol::version()) + '"';
  lines[3].replace(lines[3].find(version), version.size(), "\"0.0.0\"");
  lines.push_back("{\"id\":\"stranger\"}");
  lines.push_back("damaged");

  const auto pending = [&](const PlanOptions& options) {
    BatchPlan plan(manifest, options);
    for (const std::string& line : lines) plan.note(line);
    CHECK(plan.num_damaged() == 1);
    std::string ids;
    for (const std::uint32_t i : plan.pending(hasher, [](double) { return true; })) ids += manifest.models[i].id + ' ';
    return ids;
  };
  CHECK(pending({}) == "other_input other_options other_version new ");
  CHECK(pending({.force = true}) == "done other_input other_options other_version failed new ");
  CHECK(pending({.only_failed = true}) == "failed ");
  CHECK(pending({.only = Outcome::crash}) == "failed ");
  CHECK(pending({.only = Outcome::rejected}).empty());
  std::string of_shards;
  for (std::uint32_t k = 1; k <= 3; ++k) of_shards += pending({.shard = {k, 3}});
  CHECK(of_shards.size() == pending({}).size());
}

TEST_CASE("Old files are known by their times and not read again", "[cli][batch]") {
  const TemporaryFolder folder;
  const fs::path input = folder.file("a.off", "surface");
  fs::last_write_time(input, fs::last_write_time(input) - std::chrono::hours(1));
  BatchManifest manifest{{folder.path()}, {{"a", "check", "a.off", {}, {}}}};
  FileHasher hasher(manifest.folders);
  const ModelFiles files = hasher.hash(manifest.models[0]);
  const WorkKey key{options_hash(manifest.models[0], ""), files.hash, subvol::version()};
  const std::string line = record_line(manifest.models[0], key, {Outcome::valid, ""}, {}, {}, files.stamp, 0);
  const auto num_pending = [&] {
    BatchPlan plan(manifest, {});
    plan.note(line);
    return plan.pending(hasher, [](double) { return true; }).size();
  };
  CHECK(num_pending() == 0);
  const auto time = fs::last_write_time(input);
  std::ofstream(input) << "surfacf";  // the same size; with the old time, nobody can tell
  fs::last_write_time(input, time);
  CHECK(num_pending() == 0);
  fs::last_write_time(input, time + std::chrono::seconds(1));
  CHECK(num_pending() == 1);
  std::ofstream(input) << "surface";
  CHECK(num_pending() == 0);  // the same content with another time
}
