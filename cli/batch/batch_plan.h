// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/batch/batch_model.h"
#include "cli/batch/model_files.h"
#include "cli/batch/outcome.h"
#include "cli/batch/record.h"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace subvol::cli {

/// Which models to run.
struct PlanOptions {
  Shard shard;
  bool force = false;           ///< also those with a record of the same work
  bool only_failed = false;     ///< only those whose last record is a failure
  std::optional<Outcome> only;  ///< only those whose last record has this outcome
  std::string program;          ///< as given; empty: subvol itself
};

/// Holds what the last record of each model says, and which models are left to do.
///
/// Memory: about 150 bytes for each model.
class BatchPlan {
 public:
  BatchPlan(const BatchManifest& manifest, const PlanOptions& options);

  /// Notes a line of the records; lines of other models, and damaged ones, are passed over.
  void note(std::string_view line);
  /// Models to run, by number, in the order of the manifest. To be called when all records have been noted. progress:
  /// called with the share of models that have been looked at; returns false to end early.
  std::vector<std::uint32_t> pending(FileHasher& hasher, const std::function<bool(double share)>& progress) const;
  /// Number of models in the shard.
  std::size_t size() const { return num_in_shard_; }
  /// Lines that are no records.
  std::size_t num_damaged() const { return num_damaged_; }

  /// True if `note` has got a record of this model since `begin_run`: another process has done it.
  bool is_done_elsewhere(std::uint32_t model) const { return seen_[model].is_new; }
  void begin_run() { is_running_ = true; }
  /// Outcome of the last record.
  std::optional<Outcome> outcome(std::uint32_t model) const;

 private:
  /// The last record of a model.
  struct Seen {
    std::uint64_t options_hash = 0, input_hash = 0, input_stamp = 0;
    Outcome outcome = Outcome::valid;
    bool exists = false, same_version = false, is_new = false;
  };
  bool is_current(const BatchModel& model, const Seen& seen, FileHasher& hasher) const;

  const BatchManifest& manifest_;
  PlanOptions options_;
  std::unordered_map<std::string_view, std::uint32_t> numbers_;  ///< of the models in the shard
  std::vector<Seen> seen_;
  RecordReader reader_;
  std::size_t num_in_shard_ = 0, num_damaged_ = 0;
  bool is_running_ = false;
};

}  // namespace subvol::cli
