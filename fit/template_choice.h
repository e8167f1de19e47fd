// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/elements/basis.h"
#include "fit/stages/fit_report.h"
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
  std::optional<std::size_t> cells;  ///< about so many; empty: as many as the trials ask for, from kFirstCells on
  std::optional<double> crease_angle_degrees;  ///< as `FitOptions` has it; not for curved elements
  int order = 0;                 ///< of the curved elements that the template is for; 0: for a subdivision volume
  Basis basis = Basis::legendre;  ///< of these
  double time_limit_seconds = 0; ///< of the trials; 0: none
  std::function<bool(const FitProgress&)> progress;  ///< returns false to cancel; empty: none
  std::function<bool()> cancelled;  ///< asked within steps too, from the calling thread; true cancels; empty: none
};

/// Counts that are tried where none is asked for, until one fits well.
inline constexpr std::size_t kFirstCells = 250, kSecondCells = 600, kLastCells = 1000;

/// Of the time limit of a fit whose template is made: what goes to the trials at most.
inline constexpr double kTrialsShareOfTime = 0.5;

/// One template that was tried, and its fit after one subdivision or at order 2.
struct TemplateTrial {
  std::size_t cells = 0;
  bool pillowed = false;
  double mean_percent = 0, max_percent = 0;  ///< distance, per cent of the target's diagonal
  double mean_scaled_jacobian = 0;
  std::size_t self_intersections = 0;
  double merit = 0;        ///< lower is better
};

struct TemplateChoice {
  VolumeMesh mesh;                    ///< the template to fit; no cells where cancelled
  BettiNumbers topology;
  std::vector<TemplateTrial> trials;
  std::size_t chosen = 0;             ///< place in trials
  std::vector<std::string> warnings;
  bool cancelled = false;
};

/// Makes several templates from a surface (`auto_templates`) and keeps the one that fits best.
///
/// Right Betti numbers alone do not make a good template: a handle may sit in the wrong place. So each candidate is
/// fitted as the result will be, with one subdivision or with elements of order 2 at most, for a limited number of
/// steps, and judged by
///
///   max distance / 1.5 % + mean distance / 0.15 % + 5 max(0, 0.9 - mean scaled Jacobian) + 1 where the boundary meets
///   itself
///
/// A pillowed candidate is tried where its core is several cells thick: on thin parts a pillow only takes cells away.
/// Where the best candidate's max distance is above 1.5 % the next larger count is tried.
///
/// The trial during which the time runs out is judged where it stands and is the last one.
///
/// InputError: as `auto_templates`; options out of range; a target whose topology no grid carries.
/// Deterministic, but for a time limit.
TemplateChoice choose_template(const TriangleMesh& target, const TemplateChoiceOptions& options = {});

}  // namespace subvol
