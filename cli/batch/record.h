// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/batch/batch_model.h"
#include "cli/batch/model_files.h"
#include "cli/batch/outcome.h"
#include "cli/runs/run_options.h"

#include <limits>
#include <optional>
#include <string>
#include <string_view>

namespace subvol::cli {

/// What identifies the work of a record: if all of it is the same, the work need not be done again.
struct WorkKey {
  std::string options_hash, input_hash, version;
  friend bool operator==(const WorkKey&, const WorkKey&) = default;
};

/// Returns the record of a model: one line of JSON without its end. Its entry "run", the last one, holds all that
/// differs between two runs of the same work: times, memory, computer.
///
/// started  seconds since 1970.
std::string record_line(const BatchModel& model, const WorkKey& key, const Verdict& verdict, const ChildEnd& end,
                        const Remains& remains, const std::string& input_stamp, double started);

/// The entries of a record that plans and summaries need. Numbers that a record lacks are NaN.
struct RecordFields {
  static constexpr double kMissingNumber = std::numeric_limits<double>::quiet_NaN();
  std::string id, outcome, reason, verb, input;
  WorkKey key;
  std::string input_stamp;
  double cells = kMissingNumber, min_scaled_jacobian = kMissingNumber, mean_scaled_jacobian = kMissingNumber;
  double mean_distance_percent = kMissingNumber, max_distance_percent = kMissingNumber;
  double sharp_edges = kMissingNumber, followed_edges = kMissingNumber;
  double wall_seconds = kMissingNumber, cpu_seconds = kMissingNumber, peak_memory_bytes = kMissingNumber;
};

/// Reads records, one after the other, into the same fields.
class RecordReader {
 public:
  /// Returns the fields of a line; null if it is no record. Valid until the next call.
  const RecordFields* read(std::string_view line);

 private:
  RecordFields fields_;
};

/// Returns the id of a record line as it stands between its quotes; empty if the line does not begin as records do. It
/// is the id itself unless it has a backslash.
std::string_view quoted_id(std::string_view line);

/// Returns a record without "run": the same for every run of the same work. InputError: not a record.
std::string without_run(std::string_view line);

}  // namespace subvol::cli
