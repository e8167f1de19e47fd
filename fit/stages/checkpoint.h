// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/stages/stage_log.h"

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace subvol {

/// What a run must have in common with the one that it continues: names, and what they stand for, as text. The
/// program's version, options that bear on the result, fingerprints of the inputs.
using RunIdentity = std::vector<std::pair<std::string, std::string>>;

/// A run that ended before its time, as its file has it.
struct Checkpoint {
  RunIdentity identity;
  std::vector<SolvedStage> stages;
};

/// The content of a checkpoint's file: a line that names the format, one with the fingerprint of the rest, then
/// numbers as this machine holds them.
std::string checkpoint_bytes(const RunIdentity& identity, const std::vector<SolvedStage>& stages);

/// Reads it back. Nothing is allocated by what the file claims.
/// InputError, naming the file: it is none, was cut off or changed, or holds what no run writes.
Checkpoint parse_checkpoint(std::string_view bytes, const std::string& name);

/// InputError as `read_file` and `parse_checkpoint`.
Checkpoint read_checkpoint(const std::filesystem::path& path);

/// InputError, naming the file and all that differs, unless a run has the identity of the checkpoint.
void require_same_run(const RunIdentity& checkpoint, const RunIdentity& run, const std::string& name);

}  // namespace subvol
