// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/geometry/site_tree.h"
#include "subvol/base/types.h"

#include <array>
#include <span>
#include <vector>

namespace subvol {

/// The part of a triangle that is nearer to one site than to all others, by what an integral over it needs.
struct VoronoiPiece {
  Index triangle;
  Index site;
  /// 1/area(triangle) * integral over the piece of lambda_i lambda_j, for ij = 00 01 02 11 12 22 (lambda: barycentric
  /// coordinates in the triangle). Dimensionless; a whole triangle has 1/6 1/12 1/12 1/6 1/12 1/6.
  std::array<double, 6> moments;

  /// m_ij of the symmetric 3x3 matrix of moments.
  double moment(int i, int j) const {
    constexpr int kSlot[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
    return moments[kSlot[i][j]];
  }
  /// 1/area(triangle) * integral of lambda_i over the piece.
  double first_moment(int i) const { return moment(i, 0) + moment(i, 1) + moment(i, 2); }
  /// area(piece) / area(triangle), in (0, 1].
  double share() const { return first_moment(0) + first_moment(1) + first_moment(2); }
};

/// The Voronoi diagram of sites in space, restricted to triangles.
///
///   Vor(i) cut with t = { y in t : |y - x_i| <= |y - x_j| for all j }         Paper: Eq. 9 integrates over it
///
/// A triangle's cells are found among the few sites that may matter to it, and accepted where they part its area
/// exactly. Elsewhere (ties, crowds of sites) it is cut in two by bisectors until every part lies in one cell, which,
/// cells being convex, its corners decide: so no area is lost or counted twice in whatever position the sites are, and
/// nearest-site queries are enough however far away they are. Shares of a triangle add up to 1 within a few roundings.
///
/// Ties: where sites are equally near within rounding, on a set of positive area (equal sites, a triangle in a
/// bisector), one of them gets it all; of equal sites the one with the lowest number.
class RestrictedVoronoi {
 public:
  /// Sites are finite and there is at least one, else InputError. Equal sites are allowed.
  explicit RestrictedVoronoi(std::span<const Vec3> sites);

  /// Moves the sites (as many as before, else InputError); cheaper than building anew. The results are the same.
  void update_sites(std::span<const Vec3> sites);

  std::size_t num_sites() const { return tree_.num_sites(); }

  /// The nearest site, of equally near ones the lowest number. Points are finite.
  Index nearest_site(const Vec3& point) const;

  /// The pieces of all triangles, by triangle, then by site; at most one per pair.
  ///
  /// positions, triangles   finite; corners in [0, positions.size()), else InputError. Soups are welcome.
  /// pieces                 receives the result; its memory is used again.
  ///
  /// Triangles without area have no pieces. Runs in parallel over triangles; same bits for any number of threads.
  /// Cost: a query per position, some 0.1 microseconds, and 0.2 to 0.8 microseconds per piece of the triangles that
  /// more than one cell meets.
  void compute(std::span<const Vec3> positions, std::span<const std::array<Index, 3>> triangles,
               std::vector<VoronoiPiece>& pieces) const;
  std::vector<VoronoiPiece> compute(std::span<const Vec3> positions,
                                    std::span<const std::array<Index, 3>> triangles) const;

 private:
  void take_sites(std::span<const Vec3> sites);

  Vec3 centre_ = Vec3::Zero();  ///< sites and triangles are handled relative to it, or far origins would cost digits
  SiteTree tree_;
};

}  // namespace subvol
