// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/geometry/barycentric.h"
#include "fit/geometry/cell_envelope.h"
#include "fit/geometry/restricted_voronoi.h"

namespace subvol {

/// Cuts one triangle after the other by the Voronoi cells of sites: the inner loop of `RestrictedVoronoi`.
///
/// A point of the triangle is its barycentric coordinates l. For a site s with corners' values
///
///   e_s[k] = |p_k - s|^2 - |p_k - r|^2                             (r: the triangle's first site)
///
/// the difference of squared distances |p - a|^2 - |p - b|^2 is the linear function l . (e_a - e_b): cells are where
/// l . e_s is lowest. Every corner of a part carries the site found nearest to it.
///
/// Where the sites that could matter to a part are few, its cells are found at once (`CellEnvelope`); otherwise, and
/// where sites are equally near within rounding, the part is cut in two.
///
/// Why it ends: a part is cut by the bisector of c and b only where b is lower than c by more than rounding at a
/// corner. In the one half c is then nowhere higher than b at any corner, old or new (the function is linear), in the
/// other nowhere lower; so on no branch is a pair of sites used twice.
class TriangleCutter {
 public:
  /// The tree must outlive the cutter. Cost: one integer per site.
  explicit TriangleCutter(const SiteTree& tree);

  /// Appends the pieces of the triangle with the given corners, whose nearest sites' places are given.
  void cut(Index triangle, const std::array<Vec3, 3>& positions, const std::array<Index, 3>& nearest,
           std::vector<VoronoiPiece>& pieces);

 private:
  struct Corner {
    Barycentric at;
    int slot;
  };
  struct Slot {
    Index place;
    Barycentric value;  ///< e_s
    double noise;       ///< bound on the rounding errors of l . e_s
    std::array<double, 6> moments;
  };

  int slot_of(Index place);
  double value(int slot, const Barycentric& at) const;
  const Vec3& position(int slot) const { return tree_.position(slots_[slot].place); }
  /// How much lower than slot c the corner's own site is at the corner, beyond rounding.
  double violation(int c, const Corner& corner) const;
  /// The site whose cell holds the part on top of the stack; or none, and the pair of sites to cut it by.
  bool inside_one_cell(int& c, int& b) const;
  /// Finds the cells of the part on top of the stack among the sites that may matter to it; false: must be cut in two.
  bool part_at_once();
  bool gather(std::span<const Corner> part);
  /// Hands the candidates' values to the envelope. returns a bound on their rounding errors.
  double add_candidates();
  void split(int c, int b);
  /// Where edge ij of `polygon_` meets the bisector; slot -1 where c and b are nearest.
  Corner crossing(std::size_t i, std::size_t j, int c, int b);
  int nearest_slot(const Barycentric& at, int c, int b);
  void integrate(int slot);
  Vec3 point(const Barycentric& at) const;
  void pop();
  void emit(Index triangle, std::vector<VoronoiPiece>& pieces);

  std::span<const Corner> top() const { return {corners_.data() + parts_.back(), corners_.size() - parts_.back()}; }

  const SiteTree& tree_;
  std::vector<int> slot_of_place_;
  std::vector<Slot> slots_;
  std::vector<Corner> corners_;     ///< of the parts still to do, one part after the other
  std::vector<std::size_t> parts_;  ///< where each begins
  std::vector<Corner> polygon_;
  CellEnvelope envelope_;
  std::vector<SiteTree::Ball> balls_;
  std::vector<Index> candidates_;
  std::vector<Barycentric> outline_;
  int num_failures_ = 0;  ///< of `part_at_once`, in a row
  std::vector<double> height_;
  std::array<Vec3, 3> positions_;
};

}  // namespace subvol
