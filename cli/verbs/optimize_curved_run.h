// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/checkpointing.h"
#include "cli/runs/written_result.h"
#include "cli/verbs/long_run.h"
#include "cli/verbs/optimize_run.h"
#include "subvol/export/high_order_file.h"
#include "subvol/fit/mesh_check.h"
#include "subvol/fit/optimize_curved.h"
#include "subvol/fit/quality/quality.h"

#include <optional>
#include <string>
#include <vector>

namespace subvol::cli {

/// The rest of a run of `optimize` whose mesh turned out to have curved cells.
class CurvedOptimizeRun : public LongRun {
 public:
  /// begun  the run so far, with its outputs and its clock.
  /// UsageError: options that do not apply to curved cells; outputs that do not hold them.
  CurvedOptimizeRun(const OptimizeArguments& arguments, const LongRun& begun, HighOrderFile file);
  int run();

 private:
  void optimize();
  void write();
  void check();
  Json report() const;
  void summarize() const;

  const OptimizeArguments& arguments_;
  HighOrderFile file_;
  Json input_;
  QualityReport before_;
  std::optional<Checkpointing> checkpointing_;
  FitReport fit_;
  MeshCheck mesh_check_;
  std::optional<MeshCheck> linear_;  ///< of linear cells that were written in place of the curved ones
  std::vector<PolynomialCells> polynomials_;
};

}  // namespace subvol::cli
