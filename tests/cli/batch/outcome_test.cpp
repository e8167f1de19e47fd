// SPDX-License-Identifier: GPL-3.0-or-later
// What became of a model, from its exit status, signal and report.

#include "cli/batch/outcome.h"

#include <catch2/catch.hpp>

#include <csignal>
#include <string>

using namespace subvol::cli;

namespace {

Verdict judged(int exit_code, int signal, const Remains& remains = {.has_outputs = true}) {
  ChildEnd end;
  end.exit_code = exit_code;
  end.signal = signal;
  return judge(end, remains);
}

const Json kSound{{"valid", true}, {"quality", {{"cells", 8}, {"certified_cells", 8}}}};
const Json kUnproved{{"quality", {{"cells", 8}, {"certified_cells", 5}}}};

}  // namespace

TEST_CASE("Outcomes follow exit statuses, signals and reports", "[cli][batch]") {
  CHECK(judged(0, 0).outcome == Outcome::valid);
  CHECK(judged(0, 0, {}).outcome == Outcome::no_result);
  CHECK(judged(4, 0, {.report = kSound, .has_outputs = true}).outcome == Outcome::not_converged);
  CHECK(judged(4, 0, {.report = kUnproved, .has_outputs = true}).outcome == Outcome::not_valid);
  CHECK(judged(4, 0, {.report = kSound}).outcome == Outcome::no_result);
  CHECK(judged(1, 0, {.report = kUnproved, .has_outputs = true}).outcome == Outcome::not_valid);
  CHECK(judged(1, 0, {.report = kSound, .has_outputs = true}).outcome == Outcome::error);
  CHECK(judged(1, 0, {.last_message = "out of memory"}).outcome == Outcome::out_of_memory);
  CHECK(judged(2, 0).outcome == Outcome::usage);
  CHECK(judged(3, 0).outcome == Outcome::rejected);
  CHECK(judged(17, 0).outcome == Outcome::error);
  CHECK(judged(130, 0).outcome == Outcome::killed);
  CHECK(judged(-1, SIGSEGV).outcome == Outcome::crash);
  CHECK(judged(-1, SIGABRT).outcome == Outcome::crash);
  CHECK(judged(-1, SIGKILL).outcome == Outcome::killed);
  CHECK(judged(-1, SIGKILL, {.was_timed_out = true}).outcome == Outcome::time_limit);
  CHECK(judged(130, 0, {.was_timed_out = true}).outcome == Outcome::time_limit);
}

TEST_CASE("Every failure has a reason in one line", "[cli][batch]") {
  CHECK(judged(1, 0, {.report = kUnproved}).reason == "3 of 8 cells are not certified");
  const Json open{
      {"fillable", false},
      {"findings", {{"open_rim", {{"prevents_filling", true}}}, {"sharp_angle", {{"prevents_filling", false}}}}}};
  CHECK(judged(1, 0, {.report = open, .has_outputs = true}).reason == "open_rim");
  CHECK(judged(3, 0, {.last_message = "a.off:3: expected"}).reason == "a.off:3: expected");
  CHECK(judged(17, 0).reason == "exit status 17");
  CHECK(judged(-1, SIGSEGV).reason == "SIGSEGV");
  CHECK(judged(-1, SIGKILL).reason.starts_with("SIGKILL"));
  CHECK(judged(3, 0, {.last_message = std::string(5000, 'x')}).reason.size() < 500);
  CHECK(judged(3, 0, {.last_message = "t\xff"}).reason == "t\xEF\xBF\xBD");
  for (int status = 1; status < 256; ++status) CHECK((status == 4 || !judged(status, 0).reason.empty()));
}

TEST_CASE("Names of outcomes lead back to them", "[cli][batch]") {
  for (std::size_t i = 0; i < kNumOutcomes; ++i) {
    const auto outcome = static_cast<Outcome>(i);
    CHECK(outcome_named(name_of(outcome)) == outcome);
    CHECK_FALSE(meaning_of(outcome).empty());
    CHECK(is_failure(outcome) == (status_of(outcome) == "failed"));
  }
  CHECK_FALSE(outcome_named("failed"));
}
