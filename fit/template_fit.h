// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/automatic_fit.h"
#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <cstddef>

namespace subvol {

/// Numbers of cells of a template that are tried if none is given, in this order until the flat cells come as close as
/// the following distances: the fit that starts from them brings them closer.
inline constexpr std::array<std::size_t, 3> kTemplateCells{300, 1000, 3000};
inline constexpr double kTemplateMeanPercent = 0.3, kTemplateMaxPercent = 2;  ///< of the diagonal

/// Number that is tried after those for curved cells, which are not subdivided, if the target has sharp edges to
/// follow.
inline constexpr std::size_t kCurvedEdgeCells = 10000;
/// The fit that a template is made for.
enum class TemplateUse { subdivision, curved_cells };

/// Number of cells of the template if the target has several regions and no number is given.
inline constexpr std::size_t kRegionTemplateCells = 1500;

/// Largest share of a fit's time limit that the template may take if the fit makes it itself.
inline constexpr double kTemplateShareOfTime = 0.5;

/// Makes a template for a subdivision volume or for curved elements from the surface alone: a mesh of few flat cells by
/// `fit_automatically`, which follows the sharp edges of designed parts. Its creases are completed by those that keep
/// its subdivision surface from folding (`unfolding_tags`).
///
/// options  as for `fit_automatically`; distances larger than the two above are aimed at all the same.
/// use      what the template is for: curved cells may need more cells.
/// returns  the best of the numbers of cells tried; without cells if the fit was ended before there was a mesh.
/// InputError: as `fit_automatically`. Deterministic, except under a time limit.
AutomaticFitResult fit_template(const TriangleMesh& target, AutomaticFitOptions options = {},
                                TemplateUse use = TemplateUse::subdivision);

}  // namespace subvol
