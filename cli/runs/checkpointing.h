// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/loading.h"
#include "cli/runs/run_options.h"
#include "fit/stages/checkpoint.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <chrono>
#include <string>
#include <utility>
#include <vector>

namespace subvol::cli {

/// What tells one input from another: all that a fit reads of it.
std::string fingerprint(const TriangleMesh& mesh);
std::string fingerprint(const PointCloud& cloud);
std::string fingerprint(const Target& target);
std::string fingerprint(const VolumeMesh& mesh);

/// A run by its version, verb, inputs (name and fingerprint), and those options that bear on the result of the fit.
RunIdentity run_identity(const std::string& verb, const Json& options,
                         const std::vector<std::pair<std::string, std::string>>& inputs);

/// Refuses the file of --resume before the template is made: InputError as `Checkpointing`, but for the template.
void require_resumable(const RunOptions& run, const RunIdentity& identity_but_template);

/// Goes on from the checkpoint of an earlier run, and keeps one of this run as its minimisations go on.
class Checkpointing {
 public:
  /// Reads the file of --resume. InputError: it cannot be used, or is of another run.
  Checkpointing(const RunOptions& run, RunIdentity identity);
  Checkpointing(const Checkpointing&) = delete;
  Checkpointing& operator=(const Checkpointing&) = delete;

  /// For the options of a fit; null where nothing is kept and nothing resumed.
  StageLog* log() { return run_.checkpoint.empty() && run_.resume.empty() ? nullptr : &log_; }
  /// Writes what is not on the disk yet. A disk that refuses does not cost the result: the report has a warning.
  void finish(std::vector<std::string>& warnings);
  /// What a report says of it: "resumed_from" and "recalled_stages", or nothing.
  void describe(Json& report) const;

 private:
  using Clock = std::chrono::steady_clock;
  void write();

  const RunOptions& run_;
  RunIdentity identity_;
  StageLog log_;
  Clock::time_point written_ = Clock::now();
  bool is_written_ = false;
  std::string failure_;  ///< of the last write; empty: none
};

}  // namespace subvol::cli
