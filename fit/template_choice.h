// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/basis.h"
#include "subvol/fit/stages/fit_report.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/solid_topology.h"
#include "subvol/surface/triangle_mesh.h"

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace subvol {

struct TemplateChoiceOptions {
  /// Approximate number; empty: as many as the trials show to be needed, from kFirstCells on.
  std::optional<std::size_t> cells;
  std::optional<double> crease_angle_degrees;  ///< as in `FitOptions`; not for curved elements
  int order = 0;                 ///< order of the curved elements that the template is for; 0: for a subdivision volume
  Basis basis = Basis::legendre;  ///< basis of these elements
  double time_limit_seconds = 0; ///< for the trials; 0: no limit
  std::function<bool(const FitProgress&)> progress;  ///< returns false to cancel; may be empty
  /// Also polled within steps, from the calling thread; returns true to cancel; may be empty.
  std::function<bool()> cancelled;
};

/// Numbers of cells that are tried if none is given, in this order until one fits well.
inline constexpr std::size_t kFirstCells = 250, kSecondCells = 600, kLastCells = 1000;

/// Largest share of a fit's time limit that the trials may take if the fit makes its own template.
inline constexpr double kTrialsShareOfTime = 0.5;

/// One template that was tried, and its fit after one subdivision or with elements of order 2 at most.
struct TemplateTrial {
  std::size_t cells = 0;
  bool pillowed = false;
  double mean_percent = 0, max_percent = 0;  ///< distance, per cent of the target's diagonal
  double mean_scaled_jacobian = 0;
  std::size_t self_intersections = 0;
  double merit = 0;        ///< lower is better
};

struct TemplateChoice {
  VolumeMesh mesh;                    ///< the template to fit; no cells if canceled
  BettiNumbers topology;
  std::vector<TemplateTrial> trials;
  std::size_t chosen = 0;             ///< position in trials
  std::vector<std::string> warnings;
  bool cancelled = false;
};

/// Makes several templates from a surface (`auto_templates`) and keeps the one that fits best.
///
/// Correct Betti numbers alone do not make a good template: a handle may sit in the wrong place. So each candidate is
/// fitted like the final result, with one subdivision or with elements of order 2 at most, for a limited number of
/// steps, and judged by
///
///   max distance / 1.5 % + mean distance / 0.15 % + 5 max(0, 0.9 - mean scaled Jacobian)
///   + 1 if the boundary intersects itself
///
/// A pillowed candidate is tried if its core is several cells thick: on thin parts, a pillow only takes cells away. If
/// the best candidate's max distance exceeds 1.5 % or its boundary intersects itself, the next larger count is tried.
///
/// The trial during which the time runs out is judged by its current state and is the last one.
///
/// InputError: as `auto_templates`; options out of range; a target whose topology no grid can reproduce.
/// Deterministic, except under a time limit.
TemplateChoice choose_template(const TriangleMesh& target, const TemplateChoiceOptions& options = {});

}  // namespace subvol
