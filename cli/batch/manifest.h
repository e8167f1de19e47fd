// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/batch/batch_model.h"

#include <span>
#include <string>
#include <vector>

namespace subvol::cli {

/// What holds for models that do not say otherwise.
struct ModelDefaults {
  std::string verb = "fit";
  std::vector<std::string> options;          ///< come before those of the model
  std::vector<std::string> outputs{"mesh"};  ///< for verbs that have -o
};

/// Reads the models of a batch.
///
/// sources  manifests (.csv, .tsv, .jsonl, .ndjson); all else is a model's input, or a pattern of such (*, ?, [...]).
///          The id of an input is its name as given.
/// rows     models as JSON texts, as lines of a .jsonl; their files are relative to the current folder.
///
/// InputError, with file and line or the row: a file that cannot be read, a row that is not understood, an id that
/// another model has, an option that the verb does not have, a pattern that no file matches. UsageError: no models.
BatchManifest read_manifest(std::span<const std::string> sources, std::span<const std::string> rows,
                            const ModelDefaults& defaults, const VerbLookup& verbs);

}  // namespace subvol::cli
