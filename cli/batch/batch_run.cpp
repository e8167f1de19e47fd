// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/batch/batch_run.h"

#include "cli/batch/child_process.h"
#include "cli/batch/latest_records.h"
#include "cli/batch/record_file.h"
#include "cli/runs/exit_status.h"
#include "cli/runs/interrupt.h"
#include "cli/runs/progress.h"
#include "cli/runs/standard_output.h"
#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/base/version.h"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>
#include <iostream>
#include <numeric>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <stdio.h>

namespace subvol::cli {

using namespace internal;
namespace {

namespace fs = std::filesystem;
using Clock = ChildProcess::Clock;

constexpr const char* kReportName = "report.json";
constexpr const char* kMessagesName = "messages.txt";
/// Longest sleep between two looks at limits and at Ctrl-C.
constexpr std::chrono::milliseconds kLongestSleep{200};

/// The last line of a file that is not blank, without "subvol: ".
std::string last_message(const fs::path& path) {
  constexpr std::streamoff kTail = 8192;
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) return {};
  const std::streamoff size = file.tellg();
  file.seekg(std::max<std::streamoff>(0, size - kTail));
  std::string line, last;
  while (std::getline(file, line, '\n'))
    if (line.find_first_not_of(" \t\r") != std::string::npos) last = line.substr(line.rfind('\r', line.size() - 2) + 1);
  constexpr std::string_view kPrefix = "subvol: ";
  return last.starts_with(kPrefix) ? last.substr(kPrefix.size()) : last;
}

/// Names a file as the manifest does, in place of its absolute path: reasons do not depend on the machine.
void restore_name(std::string& message, const std::string& absolute, const std::string& name) {
  if (absolute.size() < 2) return;
  for (std::size_t at; (at = message.find(absolute)) != std::string::npos && name.find(absolute) == std::string::npos;)
    message.replace(at, absolute.size(), name);
}

/// Puts a new folder in the place of an old one, or where none is: there is never part of one.
void publish(const fs::path& made, const fs::path& place) {
  if (::rename(made.c_str(), place.c_str()) == 0) return;
  if (errno == ENOTEMPTY || errno == EEXIST) {
    // The old folder changes places with the new one, and goes.
    if (::renameat2(AT_FDCWD, made.c_str(), AT_FDCWD, place.c_str(), RENAME_EXCHANGE) == 0) return;
    std::error_code ignored;
    fs::remove_all(place, ignored);
    if (::rename(made.c_str(), place.c_str()) == 0) return;
  }
  throw IoError(place.string() + ": cannot be written: " + std::strerror(errno));
}

/// A model whose process runs.
struct Job {
  std::uint32_t model;
  ModelFiles files;
  ChildProcess process;
  double started;            ///< seconds since 1970
  Clock::time_point end_by;  ///< when to ask it to end, or when to kill it
  bool was_asked = false, is_timed_out = false;
  std::optional<ChildEnd> end;  ///< how it ended, if a signal from outside has ended it
  Clock::time_point judge_at;   ///< when to take that for an end of its own
};

/// Whoever ends a batch together with its processes (a scheduler that requeues a task) may reach a process first. So a
/// signal from outside is taken for one that was sent to the process alone only if the batch itself lives this long
/// without one.
constexpr std::chrono::milliseconds kSignalSettles{1000};

class Batch {
 public:
  Batch(const BatchManifest& manifest, const VerbLookup& verbs, const BatchOptions& options)
      : manifest_(manifest),
        verbs_(verbs),
        options_(options),
        program_(options.plan.program.empty() ? this_program() : find_program(options.plan.program)),
        plan_(manifest, options.plan),
        hasher_(manifest.folders),
        teller_(options.progress, options.quiet),
        records_(options.folder) {}

  BatchResult run() {
    catch_interrupt();
    records_.read_new([&](std::string_view line) { plan_.note(line); });
    pending_ = plan_.pending(hasher_, [&](double) { return !interrupted(); });
    result_.num_models = plan_.size();
    tell_plan();
    if (options_.dry_run)
      print_pending();
    else
      run_pending();
    teller_.finish();
    count_outcomes();
    if (options_.print_records) print_records();
    return result_;
  }

 private:
  void tell_plan() {
    if (options_.quiet) return;
    if (plan_.num_damaged() > 0)
      std::cerr << "subvol: warning: " << plan_.num_damaged() << " lines of " << kRecordsName << " are damaged\n";
    std::cerr << plan_.size() << " models, " << pending_.size() << " to run\n";
  }

  void print_pending() const {
    std::string ids;
    for (const std::uint32_t model : pending_) ids.append(manifest_.models[model].id).append("\n");
    print(ids);
  }

  void run_pending() {
    for (const char* name : {"models", "work"}) fs::create_directories(options_.folder / name);
    plan_.begin_run();
    watch_children();
    while (has_work()) {
      start_jobs();
      if (!jobs_.empty() || !elsewhere_.empty()) wait_for_child(time_to_sleep());
      collect();
      enforce_limits();
      records_.flush_if_due();
    }
    result_.is_interrupted = interrupted();
    result_.num_elsewhere = elsewhere_.size();
  }

  bool has_work() { return !jobs_.empty() || (!interrupted() && (next_ < pending_.size() || is_patient())); }

  /// True for a while after all else is done, if other processes have claimed models: they may be what a killed batch
  /// has left, and end soon.
  bool is_patient() {
    if (elsewhere_.empty()) return false;
    if (!patience_end_) patience_end_ = Clock::now() + after(options_.grace_seconds);
    return Clock::now() < *patience_end_;
  }

  void start_jobs() {
    const auto is_full = [&] { return jobs_.size() >= static_cast<std::size_t>(options_.jobs) || interrupted(); };
    while (!is_full() && next_ < pending_.size())
      if (const std::uint32_t model = pending_[next_++]; !start(model)) elsewhere_.push_back(model);
    if (next_ == pending_.size() && jobs_.empty())
      std::erase_if(elsewhere_, [&](std::uint32_t model) { return !is_full() && start(model); });
  }

  fs::path work_folder(const BatchModel& model) const { return options_.folder / "work" / folder_name(model.id); }

  void read_new() {
    records_.read_new([&](std::string_view line) { plan_.note(line); });
  }

  /// Starts a model, unless it has been done meanwhile; returns false if another process has claimed it.
  bool start(std::uint32_t number) {
    const BatchModel& model = manifest_.models[number];
    if (!records_.claim(model.id)) return false;
    // Another process may have done the model between the plan and the claim.
    read_new();
    if (plan_.is_done_elsewhere(number)) {
      records_.release(model.id);
      return true;
    }
    const fs::path folder = work_folder(model);
    fs::remove_all(folder);  // left by a process that was killed
    fs::create_directory(folder);
    ModelFiles files = hasher_.hash(model);
    const double now = std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
    ChildProcess process({.program = program_,
                          .words = model_words(model, *verbs_(model.verb),
                                               [&](const std::string& word) { return hasher_.absolute(model, word); }),
                          .folder = folder,
                          .messages = kMessagesName,
                          .environment = {"OMP_NUM_THREADS=" + std::to_string(options_.threads),
                                          "SUBVOL_PROGRAM=" + this_program().string()},
                          .memory_limit = options_.memory_limit});
    const Clock::time_point end_by = options_.time_limit_seconds > 0
                                         ? process.start() + after(options_.time_limit_seconds)
                                         : Clock::time_point::max();
    jobs_.push_back({number, std::move(files), std::move(process), now, end_by});
    return true;
  }

  static Clock::duration after(double seconds) {
    return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  }

  std::chrono::milliseconds time_to_sleep() const {
    auto sleep = kLongestSleep;
    const auto now = Clock::now();
    for (const Job& job : jobs_) {
      const auto due = job.end ? job.judge_at : job.end_by;
      if (due < now + sleep)
        sleep = std::max(std::chrono::milliseconds(0), std::chrono::ceil<std::chrono::milliseconds>(due - now));
    }
    return sleep;
  }

  void collect() {
    for (std::size_t i = 0; i < jobs_.size();) {
      if (!has_ended(jobs_[i])) {
        ++i;
        continue;
      }
      const Job job = std::move(jobs_[i]);
      jobs_.erase(jobs_.begin() + static_cast<std::ptrdiff_t>(i));
      finish(job);
      tell();
    }
  }

  /// True if the process of a job has ended and it is known whom a signal from outside was meant for.
  static bool has_ended(Job& job) {
    if (job.end) return interrupted() || Clock::now() >= job.judge_at;
    job.end = job.process.poll();
    if (!job.end) return false;
    if (job.was_asked || !is_ended_from_outside(*job.end)) return true;
    job.judge_at = Clock::now() + kSignalSettles;
    return interrupted();
  }

  /// Asks jobs to end whose time is over, and all if the batch is interrupted; kills those that do not.
  void enforce_limits() {
    const auto now = Clock::now();
    for (Job& job : jobs_) {
      if (job.end) continue;
      const bool is_over = now >= job.end_by;
      if (job.was_asked && is_over) {
        job.process.signal(SIGKILL);
        job.end_by = Clock::time_point::max();
      } else if (!job.was_asked && (is_over || interrupted())) {
        job.process.signal(SIGTERM);
        job.was_asked = true;
        job.is_timed_out = is_over;
        job.end_by = now + after(options_.grace_seconds);
      }
    }
  }

  void finish(const Job& job) {
    const ChildEnd& end = *job.end;
    const BatchModel& model = manifest_.models[job.model];
    const fs::path folder = work_folder(model);
    const bool ends_with_batch = job.was_asked ? !job.is_timed_out : interrupted() && is_ended_from_outside(end);
    if (ends_with_batch && end.exit_code != kDone) {  // the next batch runs it again
      fs::remove_all(folder);
      records_.release(model.id);
      return;
    }
    const Remains remains = remains_of(job, end, model, folder);
    const Verdict verdict = judge(end, remains);
    if (fs::is_empty(folder))
      fs::remove(folder);
    else
      publish(folder, options_.folder / "models" / folder_name(model.id));
    fs::remove_all(folder);  // what was published before
    const WorkKey key{options_hash(model, options_.plan.program), job.files.hash, version()};
    records_.append(record_line(model, key, verdict, end, remains, job.files.stamp, job.started));
    records_.release(model.id);
    ++result_.num_run;
    newest_[job.model] = verdict.outcome;
    num_failed_ += is_failure(verdict.outcome);
  }

  Remains remains_of(const Job& job, const ChildEnd& end, const BatchModel& model, const fs::path& folder) const {
    Remains remains;
    remains.was_timed_out = job.is_timed_out && end.exit_code != kDone;
    for (const std::string& output : model.outputs)
      if (std::string file = output_file(output); fs::exists(folder / file)) remains.outputs.push_back(std::move(file));
    // A wrapper decides itself which files it leaves, so none of them is required.
    remains.has_outputs = !options_.plan.program.empty() || remains.outputs.size() == model.outputs.size();
    if (fs::is_regular_file(folder / kReportName))
      remains.report = Json::parse(read_file(folder / kReportName), nullptr, false);
    const fs::path messages = folder / kMessagesName;
    remains.last_message = last_message(messages);
    restore_name(remains.last_message, hasher_.absolute(model, model.input), model.input);
    for (const std::string& word : model.options)
      if (const std::string path = hasher_.absolute(model, word); path != word)
        restore_name(remains.last_message, path, word);
    std::error_code ignored;
    if (fs::file_size(messages, ignored) == 0) fs::remove(messages, ignored);
    return remains;
  }

  void tell() {
    if (interrupted()) return;
    const std::size_t num_done = next_ - jobs_.size() - elsewhere_.size();
    teller_.tell_count(num_done, pending_.size(), std::to_string(num_failed_) + " failed");
  }

  void count_outcomes() {
    for (std::uint32_t i = 0; i < manifest_.models.size(); ++i) {
      std::optional<Outcome> outcome = plan_.outcome(i);
      if (const auto found = newest_.find(i); found != newest_.end()) outcome = found->second;
      if (outcome) ++result_.counts[static_cast<std::size_t>(*outcome)];
    }
    result_.num_kept = result_.num_models - pending_.size();
  }

  void print_records() const {
    const LatestRecords latest(std::span(&options_.folder, 1));
    for (const BatchModel& model : manifest_.models)
      if (options_.plan.shard.holds(model.id))
        if (const std::string_view line = latest.find(model.id); !line.empty()) print(std::string(line) + '\n');
  }

  const BatchManifest& manifest_;
  const VerbLookup& verbs_;
  const BatchOptions& options_;
  fs::path program_;
  BatchPlan plan_;
  FileHasher hasher_;
  ProgressTeller teller_;
  RecordFile records_;
  std::vector<std::uint32_t> pending_;
  std::size_t next_ = 0, num_failed_ = 0;
  std::vector<Job> jobs_;
  std::vector<std::uint32_t> elsewhere_;           ///< models that other processes have claimed
  std::optional<Clock::time_point> patience_end_;  ///< when to leave these to them
  std::unordered_map<std::uint32_t, Outcome> newest_;
  BatchResult result_;
};

}  // namespace

std::size_t BatchResult::num_failed() const {
  std::size_t failed = 0;
  for (std::size_t i = 0; i < kNumOutcomes; ++i)
    if (is_failure(static_cast<Outcome>(i))) failed += counts[i];
  return failed;
}

std::size_t BatchResult::num_recorded() const { return std::accumulate(counts.begin(), counts.end(), std::size_t{0}); }

BatchResult run_batch(const BatchManifest& manifest, const VerbLookup& verbs, const BatchOptions& options) {
  return Batch(manifest, verbs, options).run();
}

}  // namespace subvol::cli
