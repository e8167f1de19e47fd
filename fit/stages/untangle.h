// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/energies/volume_energy.h"
#include "fit/stages/stage_runner.h"

#include <vector>

namespace subvol {

struct UntangleOptions {
  double tangential_weight = 0;  ///< of the problem's surface term, for the report
  int max_rounds = 40;           ///< solves of some Newton steps, each with a smaller epsilon
  int patience = 6;              ///< rounds without a gain after which it ends
};

struct UntangleResult {
  bool going = true;               ///< false: the caller or the clock ended it (the report tells)
  std::vector<Index> uncertified;  ///< cells that are not proved positive in the end, ascending
};

/// Minimises E = E_S + lambda E_W with the regularised barrier (`regularised_barrier.h`) while epsilon falls, until
/// every cell is certified. Cells that are positive at their points but not certified get denser quadrature; cells that
/// fail round after round get more weight.
///
/// problem   its volume term is a VolumeEnergy over `mesh`, which is left without regularisation.
/// record    name, level and cells of the stages to report; one per round.
/// x         any finite start; receives the result, certified or not.
/// A round gains where fewer cells fail or the worst determinant rises.
UntangleResult untangle(FitProblem& problem, const VolumeMesh& mesh, const UntangleOptions& options,
                        const StageRunner& runner, const StageRecord& record, double fraction, std::vector<Vec3>& x,
                        FitReport& report);

}  // namespace subvol
