// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/batch/outcome.h"

#include "cli/runs/exit_status.h"

#include <algorithm>
#include <csignal>
#include <cstring>

namespace subvol::cli {
namespace {

struct Words {
  std::string_view name, meaning;
};

/// In the order of `Outcome`.
constexpr std::array<Words, kNumOutcomes> kOutcomeWords{{
    {"valid", "a valid result"},
    {"not_converged", "a valid result that misses a tolerance or met a limit"},
    {"not_valid", "the mesh is not valid, or the surface bounds no solid"},
    {"no_result", "ended without a result"},
    {"rejected", "the input cannot be used"},
    {"usage", "the options make no sense"},
    {"time_limit", "ended at the time limit of the batch"},
    {"out_of_memory", "out of memory"},
    {"crash", "crashed"},
    {"killed", "killed from outside"},
    {"error", "another error"},
}};

/// The most bytes of a reason: a record stays a line that one can read.
constexpr std::size_t kLongestReason = 400;

double number_at(const Json& report, const char* part, const char* entry) {
  if (!report.contains(part) || !report[part].is_object() || !report[part].contains(entry)) return -1;
  const Json& value = report[part][entry];
  return value.is_number() ? value.get<double>() : -1;
}

bool is_false(const Json& report, const char* entry) { return report.contains(entry) && report[entry] == false; }

/// True if a report says that its mesh or surface is not valid.
bool says_not_valid(const Json& report) {
  if (!report.is_object()) return false;
  return is_false(report, "valid") || is_false(report, "fillable") ||
         number_at(report, "quality", "certified_cells") < number_at(report, "quality", "cells");
}

std::string explanation_of(const Json& report) {
  if (!report.is_object() || !report.contains("explanation") || !report["explanation"].is_string()) return {};
  return report["explanation"].get<std::string>();
}

/// What is not valid, from the report.
std::string defects_of(const Json& report) {
  std::string text;
  const double cells = number_at(report, "quality", "cells"), proved = number_at(report, "quality", "certified_cells");
  if (proved < cells)
    text = std::to_string(static_cast<long long>(cells - proved)) + " of " +
           std::to_string(static_cast<long long>(cells)) + " cells are not certified";
  if (report.contains("findings") && report["findings"].is_object())
    for (const auto& [name, finding] : report["findings"].items())
      if (finding.is_object() && finding.value("prevents_filling", Json()) == true)
        text += (text.empty() ? "" : ", ") + name;
  return text;
}

bool is_sent_from_outside(int signal) {
  constexpr std::array<int, 6> kSignalsFromOutside{SIGKILL, SIGTERM, SIGINT, SIGHUP, SIGQUIT, SIGXCPU};
  return std::find(kSignalsFromOutside.begin(), kSignalsFromOutside.end(), signal) != kSignalsFromOutside.end();
}

Verdict judge_signal(int signal) {
  if (!is_sent_from_outside(signal)) return {Outcome::crash, signal_name(signal)};
  return {Outcome::killed, signal_name(signal) + (signal == SIGKILL ? "; the system does so if memory runs out" : "")};
}

Verdict judge_exit(int status, const Remains& remains) {
  const auto said = [&](const std::string& otherwise) {
    return remains.last_message.empty() ? otherwise : remains.last_message;
  };
  const auto not_valid = [&] {
    const std::string defects = defects_of(remains.report);
    return Verdict{Outcome::not_valid, defects.empty() ? said("the mesh is not valid") : defects};
  };
  switch (status) {
    case kDone:
      return remains.has_outputs ? Verdict{Outcome::valid, {}}
                                 : Verdict{Outcome::no_result, said("exit status 0 without the outputs")};
    case kUsage: return {Outcome::usage, said("usage error")};
    case kRejected: return {Outcome::rejected, said("input rejected")};
    case kNotConverged:
      if (!remains.has_outputs) return {Outcome::no_result, said(explanation_of(remains.report))};
      if (says_not_valid(remains.report)) return not_valid();
      return {Outcome::not_converged, explanation_of(remains.report)};
    case kInterrupted: return {Outcome::killed, said("interrupted")};
    case kFailed:
      if (remains.last_message.ends_with(kOutOfMemory)) return {Outcome::out_of_memory, remains.last_message};
      if (says_not_valid(remains.report)) return not_valid();
      [[fallthrough]];
    default: return {Outcome::error, said("exit status " + std::to_string(status))};
  }
}

}  // namespace

std::string_view name_of(Outcome outcome) { return kOutcomeWords[static_cast<std::size_t>(outcome)].name; }
std::string_view meaning_of(Outcome outcome) { return kOutcomeWords[static_cast<std::size_t>(outcome)].meaning; }

std::optional<Outcome> outcome_named(std::string_view name) {
  for (std::size_t i = 0; i < kOutcomeWords.size(); ++i)
    if (kOutcomeWords[i].name == name) return static_cast<Outcome>(i);
  return {};
}

bool is_ended_from_outside(const ChildEnd& end) {
  return end.signal != 0 ? is_sent_from_outside(end.signal) : end.exit_code == kInterrupted;
}

std::string_view status_of(Outcome outcome) { return is_failure(outcome) ? "failed" : name_of(outcome); }

Verdict judge(const ChildEnd& end, const Remains& remains) {
  Verdict verdict = remains.was_timed_out ? Verdict{Outcome::time_limit, "ended at the time limit of the batch"}
                    : end.signal != 0     ? judge_signal(end.signal)
                                          : judge_exit(end.exit_code, remains);
  verdict.reason = as_utf8(verdict.reason.substr(0, kLongestReason));
  return verdict;
}

std::string signal_name(int number) {
  const char* name = sigabbrev_np(number);
  return name != nullptr ? std::string("SIG") + name : "signal " + std::to_string(number);
}

}  // namespace subvol::cli
