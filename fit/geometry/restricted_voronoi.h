// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/fit/geometry/site_tree.h"

#include <array>
#include <span>
#include <vector>

namespace subvol::internal {

/// The part of a triangle that is nearer to one site than to all others, with what an integral over it needs.
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
/// A triangle's cells are found among the few sites that may matter to it, and accepted if their areas add up to its
/// own. Otherwise (ties, many sites close together) it is cut in two by bisectors until every part lies in one cell. As
/// cells are convex, the corners of a part decide that: so no area is lost or counted twice for any position of the
/// sites, and nearest-site queries suffice, however far away the sites are. Shares of a triangle sum to 1 to rounding.
///
/// Ties: if sites are equally near within rounding on a set of positive area (equal sites, a triangle in a bisector),
/// one of them gets all of it; of equal sites, the one with the lowest number.
class RestrictedVoronoi {
 public:
  /// Sites must be finite, and there must be at least one, else InputError. Equal sites are allowed.
  explicit RestrictedVoronoi(std::span<const Vec3> sites);

  /// Moves the sites (as many as before, else InputError); cheaper than a new object, with the same results.
  void update_sites(std::span<const Vec3> sites);

  std::size_t num_sites() const { return tree_.num_sites(); }

  /// Returns the nearest site; of equally near ones, that with the lowest number. The point must be finite.
  Index nearest_site(const Vec3& point) const;

  /// Returns the pieces of all triangles, ordered by triangle, then by site; at most one per pair.
  ///
  /// positions, triangles   corners finite and in [0, positions.size()), else InputError. Soups are allowed.
  /// pieces                 receives the result; its memory is reused.
  ///
  /// Triangles without area have no pieces. Runs in parallel over triangles; same bits for any number of threads.
  /// Cost: a query per position, about 0.1 microseconds, and 0.2 to 0.8 microseconds per piece of the triangles that
  /// meet more than one cell.
  void compute(std::span<const Vec3> positions, std::span<const std::array<Index, 3>> triangles,
               std::vector<VoronoiPiece>& pieces) const;
  std::vector<VoronoiPiece> compute(std::span<const Vec3> positions,
                                    std::span<const std::array<Index, 3>> triangles) const;

 private:
  void take_sites(std::span<const Vec3> sites);

  Vec3 center_ = Vec3::Zero();  ///< origin of all coordinates in use, so that a far origin costs no digits
  SiteTree tree_;
};

}  // namespace subvol::internal
