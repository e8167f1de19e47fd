// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/checkpointing.h"
#include "python/keywords.h"
#include "python/work.h"

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace subvol::python {

/// The checkpoint of one call: `checkpoint`, `every` and `resume`, with the same meaning as in the program.
class Checkpoints {
 public:
  /// Takes these options from the keywords.
  explicit Checkpoints(Keywords& keywords);

  /// Reads the file of an earlier run. InputError: it is not a checkpoint, or belongs to another call. Before `run`.
  ///
  /// call    the function's name.
  /// inputs  names and fingerprints of what is read.
  void begin(const std::string& call, const Keywords& keywords,
             const std::vector<std::pair<std::string, std::string>>& inputs);

  /// Calls work.run(part, [] { return function(log); }); the checkpoint is written to the disk however that ends.
  template <class Function>
  auto run(Work& work, const char* part, std::vector<std::string>& warnings, const Function& function) {
    try {
      auto result = work.run(part, [&] { return function(checkpointing_->log()); });
      checkpointing_->finish(warnings);
      return result;
    } catch (...) {
      checkpointing_->finish(warnings);
      throw;
    }
  }

  void describe(cli::Json& report) const { checkpointing_->describe(report); }

 private:
  cli::RunOptions files_;
  std::optional<cli::Checkpointing> checkpointing_;
};

}  // namespace subvol::python
