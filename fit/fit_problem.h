// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/fit_report.h"
#include "fit/point_tables.h"
#include "fit/surface_term.h"
#include "fit/volume_term.h"
#include "subvol/sparse_map.h"

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace subvol {

/// The function that a stage minimises over its unknowns x (control vertices, in the target's unit):
///
///   E(x) = E_S(N x + z0) + lambda E_W(M x + y0)                                Paper: Eqs. 1, 10
///
/// M takes the unknowns to the nodes of the finite element mesh, N to the samples of its boundary; gradients and
/// Hessians come back through the transposes. E_S is taken with the correspondences of the last `SurfaceTerm::assign`.
/// Nodes that are to stay have no entries in M and their positions in y0; samples likewise.
struct FitProblem {
  FitProblem(SparseMap node_map, SparseMap sample_map, std::unique_ptr<VolumeTerm> volume_energy,
             std::unique_ptr<SurfaceTerm> surface_energy, double volume_weight);

  /// out = M x + y0.
  void apply_nodes(std::span<const Vec3> x, std::span<Vec3> out) const;
  /// out = N x + z0.
  void apply_samples(std::span<const Vec3> x, std::span<Vec3> out) const;
  /// out = N d, how the samples go with the unknowns; out = N^T g, a gradient by the samples pulled back.
  void multiply_samples(std::span<const Vec3> d, std::span<Vec3> out) const;
  void pull_back_samples(std::span<const Vec3> g, std::span<Vec3> out) const;

  SparseMap nodes, nodes_transposed;      ///< M, M^T
  std::vector<Vec3> fixed_nodes;          ///< y0, one per node; empty: none is fixed
  SparseMap samples, samples_transposed;  ///< N, N^T
  std::optional<PointTables> tables;      ///< N once more, for all products with it; none: by `samples`
  std::vector<Vec3> fixed_samples;        ///< z0, one per sample; empty: none is fixed
  std::unique_ptr<VolumeTerm> volume;
  std::unique_ptr<SurfaceTerm> surface;   ///< null: none, N then has no rows
  double lambda;                          ///< > 0
};

struct MinimizerResult {
  MinimizerStop stop;
  std::string explanation;  ///< the test that fired, with its figure
  std::vector<IterationRecord> iterations;
  std::vector<std::vector<Index>> densified{};  ///< cells that were given more quadrature points, in this order
  std::vector<Vec3> densified_at{};             ///< x when the last of them were; empty: none were
  int small_steps = 0;                          ///< how many of the last steps decreased E by next to nothing
};

/// Does to the problem's cells what was done to them on the way to this result, so that E is the same function again.
/// InputError: `densified` and `densified_at` are not those of such a problem.
void densify_again(FitProblem& problem, const MinimizerResult& result);

struct MinimizerOptions {
  int max_iterations = 20;
  double relative_decrease = 1e-3;  ///< converged when two steps in a row decrease E by less than this share of E
  double cg_tolerance = 0.1;        ///< of the preconditioned residual
  int cg_max_iterations = 200;
  /// Called after each step; returns false to stop.
  std::function<bool(const IterationRecord&)> progress;
  /// Asked many times within a step, which may be long; true: it is given up, and the minimisation ends as cancelled
  /// with the step before.
  std::function<bool()> ended;
  /// Newton's method only: called every few steps with x and what has been done so far, which is all that it takes to
  /// go on from there (`begun`).
  std::function<void(std::span<const Vec3> x, const MinimizerResult& so_far)> keep;
  const MinimizerResult* begun = nullptr;  ///< what was done to get to x, as `keep` was told; null: nothing
};

/// Ends the result as cancelled where the caller wants an end within a step.
bool has_ended(const MinimizerOptions& options, MinimizerResult& result);

/// Keeps the record of a step and tells the caller; false, with the result's stop set, when they want to end here.
bool record_step(const IterationRecord& record, const MinimizerOptions& options, MinimizerResult& result);

/// Newton's method with frozen correspondences and conjugate gradients, preconditioned by the 3x3 diagonal blocks of
/// the pulled-back Hessian. Each step keeps E decreasing and every cell that is certified (`VolumeTerm`) certified;
/// cells that stand in the way get a denser quadrature for the steps to come. Where few points would make the step
/// shorter than a half, or cells stand in its way, the Hessian is made stiffer there (`VolumeTerm::stiffen`) and the
/// direction found again, so that they stay nearly as they are and the rest moves on.
///
/// x  feasible start (finite E), else `infeasible_start`; receives the result. With `begun`, where that was kept: it
///    then ends at the same bits as the minimisation that was interrupted would have. The problem must be as it was at
///    the start of that one, else InputError where a cell does not exist.
MinimizerResult minimize_newton(FitProblem& problem, std::vector<Vec3>& x, const MinimizerOptions& options);

/// The reference that Newton is measured against, and the paper's algorithm 2: L-BFGS (m = 10) with a weak Wolfe line
/// search by bisection, which takes +infinity as too long a step. Correspondences are exact at every evaluation.
/// Converged where ten steps decrease E by less than `relative_decrease`.
MinimizerResult minimize_lbfgs(FitProblem& problem, std::vector<Vec3>& x, const MinimizerOptions& options);

}  // namespace subvol
