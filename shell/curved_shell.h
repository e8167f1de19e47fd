// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/boundary_samples.h"
#include "subvol/fit/elements/high_order_mesh.h"
#include "subvol/fit/geometry/curved_boundary.h"
#include "subvol/fit/stages/fit_report.h"
#include "subvol/fit/stages/solve_control.h"
#include "subvol/shell/shell.h"
#include "subvol/shell/thickness.h"

#include <array>
#include <functional>
#include <vector>

namespace subvol {

/// Options of `curve_shell`.
struct CurvedShellOptions {
  int order = 2;                  ///< order of every edge, face and cell, 1 .. kMaxOrder
  Basis basis = Basis::legendre;  ///< Legendre prisms can be certified at any order, Fourier prisms up to order 3 or so
  SolveControl control{};
  /// Makes the triangles that represent the boundary in the search for intersections, as finely as the caller requires
  /// (`curved_boundary` in export). If empty, each edge gets `max(4, 2 order)` intervals, which miss sharp folds.
  std::function<CurvedBoundary(const HighOrderMesh&)> boundary;
};

/// A shell of curved cells, in the unit of the linear one, and its properties.
struct CurvedShell {
  HighOrderMesh mesh;     ///< vertices, cells and references as in `ShellResult::mesh`
  QualityReport quality;  ///< relative to `shell_reference(layers, limited)`; includes the certificate
  /// Pairs of boundary faces whose triangles (see the options) intersect, as positions in
  /// `MeshTopology::boundary_faces()`. A face with a degenerate triangle, or whose own triangles intersect, is paired
  /// with itself.
  std::vector<std::array<Index, 2>> intersecting_faces;
  MeasuredThickness thickness;
  FitReport report;  ///< of this solve only
  bool valid() const { return quality.certificate.all_certified() && intersecting_faces.empty(); }
};

/// Curves the cells of a shell (paper: sections 3.2 and 4.4).
///
///   E(x) = mean over cells and quadrature points of e(F),  F = dx/du A^-1
///
/// is minimized over all nodes except those of the surface's sheet, which keeps its flat or bilinear faces. Energy and
/// references A are those of `make_shell`, with more quadrature points and more degrees of freedom: curved cells can
/// spread the distortion that straight cells concentrate at their corners. If faces intersect afterwards or cells are
/// not certified, the curves are moved back toward the straight shell, strand by strand (`advance`).
///
/// shell  must be valid (`failures.none()`), else InputError.
/// InputError: also for options out of range.
/// Same bits for any number of threads.
CurvedShell curve_shell(const ShellResult& shell, const CurvedShellOptions& options);

/// Returns the volume mesh's faces on one sheet, in the order of the surface's faces. sheet: 0 .. num_sheets() - 1.
std::vector<Index> sheet_faces(const ShellLayers& layers, const MeshTopology& topology, int sheet);

/// Samples one sheet of the curved cells: triangles oriented like the surface's faces, and its edges as polylines.
///
/// layers, space  belong to the same shell.
/// intervals      number along every edge, >= 1, else InputError.
BoundarySamples sheet_samples(const ShellLayers& layers, const ElementSpace& space, int sheet, int intervals);

}  // namespace subvol
