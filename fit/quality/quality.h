// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/certificate/certificate.h"
#include "subvol/fit/elements/cell_reference.h"
#include "subvol/mesh/volume_mesh.h"

#include <array>
#include <cstddef>
#include <functional>
#include <vector>

namespace subvol {

inline constexpr int kNumHistogramBins = 20;  ///< of scaled Jacobians from -1 to 1, each 0.1 wide

/// Quality of the cells of a mesh, and what is proved about them.
struct QualityReport {
  struct WorstCell {
    Index cell;    ///< from 0
    Vec3 center;   ///< mean of its corners
    double value;  ///< its lowest scaled Jacobian
  };
  std::size_t num_cells = 0, num_samples = 0;
  double min_scaled_jacobian = 1;  ///< over all samples of all cells; 1 without cells
  /// Mean over each cell with the trapezoidal rule's weights (so that faces, on which many samples lie, do not count
  /// too much), then mean over all cells, where a cell counts as often as it has samples. 1 without cells.
  double mean_scaled_jacobian = 1;
  std::vector<double> cell_minima;                         ///< lowest scaled Jacobian of each cell
  std::array<std::size_t, kNumHistogramBins> histogram{};  ///< of cell_minima; equal bins over [-1, 1]
  std::size_t inverted_cells = 0;                          ///< with a sample <= 0, or refuted by the certificate
  std::vector<WorstCell> worst_cells;                      ///< the ten lowest, ascending by value, then by number
  CertificateSummary certificate;

  /// Adds one cell to cell_minima, min_scaled_jacobian, histogram and inverted_cells.
  void add_cell(double least);
  /// Fills worst_cells from cell_minima.
  void keep_worst(const std::function<Vec3(Index)>& center);
};

/// Samples the scaled Jacobian of every cell and certifies det J > 0.
///
///   SJ = det F / (|F e1| |F e2| |F e3|),   F = dx/dxi A^-1
///
/// with A the ideal cell (cube, equilateral prism, regular tetrahedron; paper: section 3.2; pyramid of eight equal
/// edges), or the given reference.
///
/// samples_per_direction  n >= 2: n^3 points for a hex, n^2 (n+1)/2 for a prism, n(n+1)(n+2)/6 for a tet, corners
///                        included; n^2 for a pyramid, each of which stands for a ray from its base to its apex.
/// reference  of each cell; empty: the ideal cells. Cost with a reference: ten times that without.
/// returns   values in [-1, 1]; 1 for ideal cells of any size and orientation, 0 if a column of F vanishes, -1 if a
///           coordinate is not finite.
/// InputError: n < 2. The mesh must have valid vertex numbers. Runs in parallel, with the same bits for any number of
/// threads. Cost: about 0.8 us per hex on one core at n = 5.
QualityReport measure_quality(const VolumeMesh& mesh, int samples_per_direction = 5,
                              const CellReference& reference = {});

}  // namespace subvol
