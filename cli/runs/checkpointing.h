// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/loading.h"
#include "cli/runs/run_options.h"
#include "subvol/fit/stages/checkpoint.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <chrono>
#include <string>
#include <utility>
#include <vector>

namespace subvol::cli {

using internal::RunIdentity;
using internal::StageLog;

/// Identifies an input: covers everything that a fit reads of it.
std::string fingerprint(const TriangleMesh& mesh);
std::string fingerprint(const PointCloud& cloud);
std::string fingerprint(const Target& target);
std::string fingerprint(const VolumeMesh& mesh);

/// Identifies a run by its version, verb, inputs (name and fingerprint), and those options that affect the result of
/// the fit.
RunIdentity run_identity(const std::string& verb, const Json& options,
                         const std::vector<std::pair<std::string, std::string>>& inputs);

/// Refuses an unsuitable --resume file before the template is made: InputError as `Checkpointing`, except that the
/// template is not compared.
void require_resumable(const RunOptions& run, const RunIdentity& identity_but_template);

/// Resumes from the checkpoint of an earlier run, and writes one for this run as its minimizations proceed.
class Checkpointing {
 public:
  /// Reads the file of --resume. InputError: it cannot be used, or belongs to another run.
  Checkpointing(const RunOptions& run, RunIdentity identity);
  Checkpointing(const Checkpointing&) = delete;
  Checkpointing& operator=(const Checkpointing&) = delete;

  /// The log to put into the options of a fit; null if nothing is written or resumed.
  StageLog* log() { return run_.checkpoint.empty() && run_.resume.empty() ? nullptr : &log_; }
  /// Writes the stages that are not on the disk yet. A disk that refuses does not cost the result: the report gets a
  /// warning.
  void finish(std::vector<std::string>& warnings);
  /// Adds "resumed_from" and "recalled_stages" to a report if the run was resumed.
  void describe(Json& report) const;

 private:
  using Clock = std::chrono::steady_clock;
  void write();

  const RunOptions& run_;
  RunIdentity identity_;
  StageLog log_;
  Clock::time_point written_ = Clock::now();
  bool is_written_ = false;
  std::string failure_;  ///< why the last write failed; empty: it did not
};

}  // namespace subvol::cli
