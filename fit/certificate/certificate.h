// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace subvol {

/// Whether det J > 0 at every point of a cell.
enum class CellValidity : std::uint8_t {
  valid,     ///< proved, rounding included
  invalid,   ///< disproved by a point where det J <= 0 beyond rounding
  undecided  ///< neither within the limits: det J touches 0, or a coordinate is not finite
};
const char* to_string(CellValidity validity);

struct CertificateOptions {
  int max_depth = 10;    ///< halvings of a cell; >= 0. 0: the cell's own coefficients only
  int max_boxes = 4096;  ///< boxes looked at per cell; >= 1
};

/// What is known of one cell.
struct CellCertificate {
  CellValidity validity = CellValidity::undecided;
  double lower_bound = 0;  ///< of det J over the cell by its canonical coordinates; > 0 exactly when valid
  Vec3 witness{0, 0, 0};   ///< canonical coordinates: det J <= 0 there if invalid, else where the least value was seen
  double witness_determinant = 0;  ///< det J there; of valid curved cells none is computed, but 0
  int boxes = 0;                   ///< boxes looked at
};

/// Proves or disproves that a linear cell is nowhere inverted.
///
///   det J(u) = sum_b d_b B_b(u),  B_b >= 0,  sum_b B_b = 1   =>   min_b d_b <= det J(u) <= max_b d_b
///
/// The hex is certified by its 27 coefficients (degree 2 per direction), the prism by 9, the tet by 1; boxes that these
/// do not decide are halved in each direction (de Casteljau), the gap falling by four per halving. Signs count only
/// beyond an a priori bound of the rounding errors: about 2e-15 of the product of the three longest edges.
/// Paper: left open there (section 5); the approach is the one of Johnen, Remacle and Geuzaine for polynomial cells.
///
/// corners  of the cell, in its kind's order; edges with lengths in [1e-50, 1e50].
/// returns  never a wrong `valid` or `invalid`. Non-finite or out-of-range coordinates end `undecided`.
/// InputError: wrong number of corners; options out of range.
/// Cost: about 0.1 us where the first coefficients decide; 0.2 us a box after that.
CellCertificate certify_cell(CellKind kind, std::span<const Vec3> corners, const CertificateOptions& options = {});

/// Least Bernstein coefficient of det J of one cell (not lowered by the rounding margin). InputError as above.
double min_bernstein(CellKind kind, std::span<const Vec3> corners);

struct CertificateSummary {
  std::size_t certified = 0, invalid = 0, undecided = 0;
  std::vector<Index> not_certified;  ///< cells that are invalid or undecided, ascending
  std::vector<Index> invalid_cells;  ///< those of them that are invalid, ascending
  bool all_certified() const { return not_certified.empty(); }
};
CertificateSummary summarize(std::span<const CellValidity> cells);

/// Certifies all cells of a mesh, read at the given positions (a trial step, say) instead of the mesh's own.
///
/// Parallel; the answer does not depend on the number of threads. positions.size() >= mesh.num_vertices(), else
/// InputError. Cost: 0.05 us a hex on one core, and `certify_cell` for those that their coefficients do not decide.
CertificateSummary certify(std::span<const Vec3> positions, const VolumeMesh& mesh,
                           const CertificateOptions& options = {});
CertificateSummary certify(const VolumeMesh& mesh, const CertificateOptions& options = {});

/// The cheap half of `certify`: per cell, whether the coefficients alone prove det J > 0 (1) or not (0).
///
/// positive  num_cells() entries, written. Returns the number of zeros. InputError: wrong sizes.
std::size_t positive_bernstein(std::span<const Vec3> positions, const VolumeMesh& mesh,
                               std::span<std::uint8_t> positive);

/// Least Bernstein coefficient of each cell, into num_cells() entries. InputError: wrong sizes.
void min_bernstein(std::span<const Vec3> positions, const VolumeMesh& mesh, std::span<double> minima);

}  // namespace subvol
