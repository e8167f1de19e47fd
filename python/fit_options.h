// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/writing.h"
#include "python/keywords.h"
#include "subvol/fit/elements/basis.h"
#include "subvol/fit/high_order_fit.h"
#include "subvol/fit/tuning/tuning.h"
#include "subvol/fit/untangle_before_fit.h"
#include "subvol/subdivision/subdivision.h"

namespace subvol::python {

// Options that several functions share.

Choices<BoundaryRule> boundary_rules();
Choices<Basis> bases();

/// Takes tune: tuned numbers by name. InputError: as `set_tuned_number`.
void take_tuning(Keywords& keywords, Tuning& tuning);

/// Takes correspondence, lambda_close, solver, max_iterations, time_limit, tune, for either kind of fit.
template <class Options>
void take_solver_options(Keywords& keywords, Options& options) {
  keywords.take("lambda_close", options.lambda_close);
  keywords.take("correspondence", options.correspondence,
                {{"closest", Correspondence::closest}, {"voronoi", Correspondence::voronoi}});
  keywords.take("solver", options.solver, {{"newton", SolverKind::newton}, {"lbfgs", SolverKind::lbfgs}});
  keywords.take("max_iterations", options.control.max_iterations);
  keywords.take("time_limit", options.control.time_limit_seconds);
  take_tuning(keywords, options.tuning);
}

/// Takes order, basis, adaptive, tolerance, and the above.
HighOrderFitOptions high_order_options(Keywords& keywords);

/// Throws InputError, naming the function, if the work was ended before all cells were valid.
void require_untangled(const UntangledStart& start, const char* function);

/// Takes chord. InputError: as `require_chord`, before any work is done.
void take_chord(Keywords& keywords, cli::WritingOptions& writing);
/// InputError: a chord that the program would refuse, too.
void require_chord(double percent);

}  // namespace subvol::python
