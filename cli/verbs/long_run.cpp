// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/verbs/long_run.h"

#include "cli/runs/exit_status.h"
#include "cli/runs/report.h"
#include "cli/verbs/verb_options.h"
#include "subvol/base/process_memory.h"

#include <algorithm>
#include <iostream>
#include <iterator>

namespace subvol::cli {

void LongRun::check_outputs(const std::vector<Part>& parts) {
  if (run_.outputs.empty() && run_.report.empty())
    throw UsageError(verb_.get_name() + ": nothing to write; give -o FILE or --report FILE");
  outputs_ = checked_outputs(run_, parts);
  apply_resources(run_);
}

void LongRun::prepare(const std::vector<Part>& parts) {
  check_outputs(parts);
  add_warnings(unused_output_options(verb_, outputs_));
}

bool LongRun::precedes_result(std::string_view stage) {
  constexpr std::string_view kEarlyStages[] = {"template", "directions", "thickness", "start"};
  return std::find(std::begin(kEarlyStages), std::end(kEarlyStages), stage) != std::end(kEarlyStages);
}

void LongRun::tell_warnings() {
  for (; told_ < warnings_.size(); ++told_)
    if (!run_.quiet) std::cerr << "subvol: warning: " << warnings_[told_] << '\n';
}

void LongRun::add_warnings(const std::vector<std::string>& warnings) {
  warnings_.insert(warnings_.end(), warnings.begin(), warnings.end());
  tell_warnings();
}

void LongRun::add_warnings_of_names(const Marks& result) {
  std::vector<std::string> warnings;
  warn_of_names(result, outputs_, warnings);
  add_warnings(warnings);
}

void LongRun::write_report(Json json, const Json& parts) const {
  if (run_.report.empty()) return;
  Json seconds = seconds_;
  seconds.update(parts);
  seconds["total"] = this->seconds();
  json["warnings"] = warnings_json(warnings_, failures_);
  json["seconds"] = std::move(seconds);
  json["peak_memory_bytes"] = internal::peak_memory_bytes();
  json["outputs"] = output_names(outputs_);
  cli::write_report(run_.report, json);
}

void LongRun::write_each(const std::function<void(const Output&)>& write,
                         const std::function<bool(const Output&)>& which) {
  const std::vector<std::string> failures = cli::write_each(outputs_, write, which);
  failures_.insert(failures_.end(), failures.begin(), failures.end());
}

void LongRun::tell_outputs() const {
  for (const Output& output : outputs_) std::cerr << "wrote " << output.path.string() << '\n';
}

int LongRun::status(const FitReport& report, bool valid) {
  if (report.stop_reason == StopReason::cancelled) return kInterrupted;
  if (!valid) return kFailed;
  return report.stop_reason == StopReason::converged ? kDone : kNotConverged;
}

}  // namespace subvol::cli
