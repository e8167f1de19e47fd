// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/batch/batch_model.h"
#include "cli/batch/batch_plan.h"
#include "cli/batch/outcome.h"

#include <array>
#include <cstddef>
#include <filesystem>
#include <string>

namespace subvol::cli {

/// How a batch is run.
struct BatchOptions {
  std::filesystem::path folder;  ///< of the batch: records.jsonl, and models/ID for what each model leaves
  PlanOptions plan;
  int jobs = 1;                   ///< processes at a time
  int threads = 1;                ///< threads of each (OMP_NUM_THREADS)
  double time_limit_seconds = 0;  ///< of each model; 0: none
  double grace_seconds = 10;      ///< between a request to end and the end by force
  std::size_t memory_limit = 0;   ///< bytes, of each model; 0: none
  std::string progress;           ///< as for `ProgressTeller`
  bool quiet = false;
  bool print_records = false;  ///< prints the record of each model of the batch to standard output, at its end
  bool dry_run = false;        ///< prints the ids of the models that would run, and runs none
};

/// How a batch went. The counts are of the last record of each model of the manifest (in the shard).
struct BatchResult {
  std::array<std::size_t, kNumOutcomes> counts{};
  std::size_t num_models = 0, num_run = 0, num_kept = 0;
  std::size_t num_elsewhere = 0;  ///< claimed by other processes at that time
  bool is_interrupted = false;
  std::size_t num_failed() const;
  std::size_t num_recorded() const;  ///< models that have a record
};

/// Runs the models of a manifest that have no record of the same work, each in a process of its own.
///
/// IoError: the folder cannot be written to, or the program cannot be started. What has been recorded by then stays.
BatchResult run_batch(const BatchManifest& manifest, const VerbLookup& verbs, const BatchOptions& options);

}  // namespace subvol::cli
