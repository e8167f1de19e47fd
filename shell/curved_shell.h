// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/elements/boundary_samples.h"
#include "fit/elements/high_order_mesh.h"
#include "fit/geometry/curved_boundary.h"
#include "shell/shell.h"
#include "shell/thickness.h"

#include <array>
#include <functional>
#include <vector>

namespace subvol {

struct CurvedShellOptions {
  int order = 2;                  ///< of every edge, face and cell, 1 .. kMaxOrder
  Basis basis = Basis::legendre;  ///< prisms of this one are certified at any order, of fourier up to order 3 or so
  int max_iterations = 0;         ///< 0: the default
  double time_limit_seconds = 0;  ///< 0: none
  std::function<bool(const FitProgress&)> progress;  ///< returns false to cancel; empty: none
  std::function<bool()> cancelled;  ///< asked within steps too, from the calling thread; true cancels; empty: none
  /// Triangles that stand for the boundary where it is looked at for intersections, as fine as the caller wants it
  /// known (`curved_boundary` of export). Empty: `max(4, 2 order)` samples an edge, which overlook sharp folds.
  std::function<CurvedBoundary(const HighOrderMesh&)> boundary;
};

/// A shell of curved cells, in the unit of the linear one, and what is true of it.
struct CurvedShell {
  HighOrderMesh mesh;      ///< vertices, cells and references as in `ShellResult::mesh`
  QualityReport quality;   ///< against `shell_reference(layers, limited)`; with the certificate
  /// Boundary faces that meet improperly, places in `MeshTopology::boundary_faces()`, on the triangles of the options.
  std::vector<std::array<Index, 2>> intersecting_faces;
  MeasuredThickness thickness;
  FitReport report;        ///< of this solve alone
  bool valid() const { return quality.certificate.all_certified() && intersecting_faces.empty(); }
};

/// Curves the cells of a shell (paper: sections 3.2 and 4.4).
///
///   E(x) = mean over cells and quadrature points of e(F),  F = dx/du A^-1
///
/// is minimised over everything but the sheet that is the surface, which keeps its flat or bilinear faces: the energy
/// and the references A of `make_shell`, at more points and with more unknowns. So cells share out among themselves
/// what straight ones leave to the corners. Where faces meet afterwards, or cells are not certified, curves go back
/// towards the straight shell, strand by strand (`advance`).
///
/// shell  valid (`failures.none()`), else InputError; InputError too: options out of range.
/// Same bits for any number of threads.
CurvedShell curve_shell(const ShellResult& shell, const CurvedShellOptions& options);

/// Volume faces of one sheet, in the order of the surface's faces.
std::vector<Index> sheet_faces(const ShellLayers& layers, const MeshTopology& topology, int sheet);

/// One sheet of the curved cells as triangles that run like the surface's faces, and its edges as polylines.
///
/// layers, space  of one shell. intervals: on every edge, >= 1, else InputError.
BoundarySamples sheet_samples(const ShellLayers& layers, const ElementSpace& space, int sheet, int intervals);

}  // namespace subvol
