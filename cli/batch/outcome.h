// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/batch/child_process.h"
#include "cli/runs/run_options.h"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace subvol::cli {

/// What became of a model. All but the first two are failures.
enum class Outcome : std::uint8_t {
  valid,          ///< done: the result is valid (exit status 0)
  not_converged,  ///< a valid result was written that misses a tolerance or met a limit of its own (exit status 4)
  not_valid,      ///< the mesh is not valid, or the checked surface bounds no solid
  no_result,      ///< ended in order without anything to write
  rejected,       ///< the input cannot be used (exit status 3)
  usage,          ///< the options make no sense (exit status 2)
  time_limit,     ///< ended by the batch at --time-limit
  out_of_memory,  ///< an allocation failed
  crash,          ///< ended by a signal of its own making, such as SIGSEGV
  killed,         ///< ended by a signal from outside
  error,          ///< another exit status: something could not be read or written, or a wrapper failed
};
inline constexpr std::size_t kNumOutcomes = 11;

/// Name of an outcome in records: "valid", "out_of_memory".
std::string_view name_of(Outcome outcome);
std::optional<Outcome> outcome_named(std::string_view name);
/// Meaning of an outcome in a few words.
std::string_view meaning_of(Outcome outcome);
inline bool is_failure(Outcome outcome) { return outcome > Outcome::not_converged; }
/// "valid", "not_converged" or "failed".
std::string_view status_of(Outcome outcome);

/// What a process left behind.
struct Remains {
  Json report;                       ///< null if it wrote none
  std::vector<std::string> outputs;  ///< files that it wrote
  bool has_outputs = false;          ///< all that it was to write are there
  bool was_timed_out = false;        ///< the batch ended it because its time was over
  std::string last_message;          ///< last line on standard output or error, without "subvol: "
};

/// What became of a model, and why.
struct Verdict {
  Outcome outcome;
  std::string reason;  ///< in one line; empty for valid results
};

/// True if a signal that others send, such as SIGTERM or SIGKILL, has ended a process.
bool is_ended_from_outside(const ChildEnd& end);

/// Judges a process by its exit status or signal, by its report, and by its last message if that is "out of memory".
Verdict judge(const ChildEnd& end, const Remains& remains);

/// Name of a signal, as "SIGKILL".
std::string signal_name(int number);

}  // namespace subvol::cli
