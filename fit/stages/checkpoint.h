// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/stages/stage_log.h"

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace subvol::internal {

/// Properties that a run must share with the run that it continues, as pairs of name and value: the program's version,
/// the options that affect the result, and fingerprints of the inputs.
using RunIdentity = std::vector<std::pair<std::string, std::string>>;

/// A run that ended early, as read from its file.
struct Checkpoint {
  RunIdentity identity;
  std::vector<SolvedStage> stages;
};

/// Returns the content of a checkpoint file: a line that names the format, a line with the fingerprint of the rest,
/// then numbers in this machine's binary representation.
std::string checkpoint_bytes(const RunIdentity& identity, const std::vector<SolvedStage>& stages);

/// Parses the content of a checkpoint file. Memory use is bounded by the size of `bytes`, whatever sizes the file
/// claims.
/// InputError, naming the file: it is not a checkpoint of this version, was truncated or changed, or holds values that
/// no run writes.
Checkpoint parse_checkpoint(std::string_view bytes, const std::string& name);

/// Reads and parses a file. InputError as for `read_file` and `parse_checkpoint`.
Checkpoint read_checkpoint(const std::filesystem::path& path);

/// Throws InputError, naming the file and all differences, unless the run has the checkpoint's identity.
void require_same_run(const RunIdentity& checkpoint, const RunIdentity& run, const std::string& name);

}  // namespace subvol::internal
