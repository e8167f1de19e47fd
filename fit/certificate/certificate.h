// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace subvol {

/// Verdict on a cell: is det J > 0 at every point of it?
enum class CellValidity : std::uint8_t {
  valid,     ///< proved; rounding errors are accounted for
  invalid,   ///< refuted by a point where det J < 0 beyond rounding
  undecided  ///< neither within the limits, e.g. if det J touches 0 or a coordinate is not finite
};
/// Returns "valid", "invalid" or "undecided".
const char* to_string(CellValidity validity);

/// Limits of the search for a proof.
struct CertificateOptions {
  int max_depth = 10;    ///< bisections of a cell per direction, 0 to 50; 0: its own coefficients only
  int max_boxes = 4096;  ///< boxes examined per cell (linear cells: up to 7 more); >= 1
};

/// InputError: an option is out of range.
void check_options(const CertificateOptions& options);

/// Result of certifying one cell.
struct CellCertificate {
  CellValidity validity = CellValidity::undecided;
  double lower_bound = 0;  ///< lower bound of det J over the cell in canonical coordinates; > 0 exactly if valid
  Vec3 witness{0, 0, 0};   ///< canonical coordinates: det J < 0 there if invalid, else the lowest det J that was met
  double witness_determinant = 0;  ///< det J at the witness; 0 (not computed) for valid curved cells
  int boxes = 0;                   ///< number of boxes examined
};

/// Proves or disproves that a linear cell is nowhere inverted.
///
///   det J(u) = sum_b d_b B_b(u),  B_b >= 0,  sum_b B_b = 1   =>   min_b d_b <= det J(u) <= max_b d_b
///
/// The hex is certified by its 27 coefficients (degree 2 per direction), the prism by 9, the tet by 1, the pyramid by
/// 4: its det J is bilinear over the base and constant along rays to the apex (`pyramid_coefficients`), so the values
/// at the base's corners decide. Boxes that the coefficients of hexes and prisms do not decide are bisected in each
/// direction (de Casteljau); each bisection reduces the gap by a factor of four. A
/// sign counts only if it exceeds an a priori bound on the rounding errors: about 2e-15 times the product of the
/// longest edges along the three directions.
/// The paper leaves this open (section 5); the approach is that of Johnen, Remacle and Geuzaine for polynomial cells.
///
/// corners  corners of the cell in its kind's order; edge lengths in [1e-50, 1e50].
/// returns  `valid` and `invalid` are never wrong. Cells with non-finite or out-of-range coordinates are `undecided`.
/// InputError: wrong number of corners; options out of range.
/// Cost: about 0.1 us if the first coefficients decide; 0.2 us per box after that.
CellCertificate certify_cell(CellKind kind, std::span<const Vec3> corners, const CertificateOptions& options = {});

/// Returns the smallest Bernstein coefficient of det J of one cell (not lowered by the rounding margin). InputError as
/// above.
double min_bernstein(CellKind kind, std::span<const Vec3> corners);

/// The verdicts on all cells of a mesh.
struct CertificateSummary {
  std::size_t certified = 0, invalid = 0, undecided = 0;
  std::vector<Index> not_certified;  ///< cells that are invalid or undecided, ascending
  std::vector<Index> invalid_cells;  ///< those of them that are invalid, ascending
  bool all_certified() const { return not_certified.empty(); }
};
/// Counts the verdicts on cells.
CertificateSummary summarize(std::span<const CellValidity> cells);

/// Certifies all cells of a mesh at the given positions (e.g. those of a trial step) instead of the mesh's own.
///
/// Runs in parallel; the result does not depend on the number of threads. InputError: positions.size() <
/// mesh.num_vertices(); options out of range. Cost: 0.05 us per hex on one core, plus `certify_cell` for each cell that
/// its coefficients do not decide.
CertificateSummary certify(std::span<const Vec3> positions, const VolumeMesh& mesh,
                           const CertificateOptions& options = {});
CertificateSummary certify(const VolumeMesh& mesh, const CertificateOptions& options = {});

/// The cheap half of `certify`: sets each cell's entry to 1 if the coefficients alone prove det J > 0, else to 0.
///
/// positive  output, num_cells() entries. Returns the number of zeros. InputError: wrong sizes.
std::size_t positive_bernstein(std::span<const Vec3> positions, const VolumeMesh& mesh,
                               std::span<std::uint8_t> positive);

/// Writes the smallest Bernstein coefficient of each cell into num_cells() entries. InputError: wrong sizes.
void min_bernstein(std::span<const Vec3> positions, const VolumeMesh& mesh, std::span<double> minima);

}  // namespace subvol
