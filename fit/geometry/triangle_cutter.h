// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/geometry/barycentric.h"
#include "subvol/fit/geometry/cell_envelope.h"
#include "subvol/fit/geometry/restricted_voronoi.h"

namespace subvol::internal {

/// Cuts triangles, one after the other, by the Voronoi cells of sites: the inner loop of `RestrictedVoronoi`.
///
/// A point of the triangle is given by its barycentric coordinates l. For a site s with the values at the corners
///
///   e_s[k] = |p_k - s|^2 - |p_k - r|^2                             (r: the triangle's first site)
///
/// the difference of squared distances |p - a|^2 - |p - b|^2 is the linear function l . (e_a - e_b): the cell of s is
/// where l . e_s is lowest. Every corner of a part carries the site found to be nearest to it.
///
/// If few sites can matter to a part, its cells are found at once (`CellEnvelope`). Otherwise, and if sites are equally
/// near within rounding, the part is cut in two.
///
/// Termination: a part is cut by the bisector of c and b only if b is lower than c by more than rounding at one of its
/// corners. In one half c is then nowhere higher than b at any corner, old or new (the function is linear), in the
/// other nowhere lower; so no pair of sites is used twice on a branch.
class TriangleCutter {
 public:
  /// The tree must outlive the cutter. Cost: one integer per site.
  explicit TriangleCutter(const SiteTree& tree);

  /// Appends the pieces of the triangle with the given corners; `nearest` are the places of the sites nearest to them.
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
  /// Returns by how much, beyond rounding, the corner's own site is lower than slot c at the corner.
  double violation(int c, const Corner& corner) const;
  /// Returns true if the part on top of the stack lies in one cell, that of c; else false, with the pair of sites c and
  /// b to cut it by.
  bool inside_one_cell(int& c, int& b) const;
  /// Finds the cells of the part on top of the stack among the sites that may matter to it. Returns false if it must be
  /// cut in two.
  bool part_at_once();
  bool gather(std::span<const Corner> part);
  /// Adds the candidates to the envelope. Returns a bound on the rounding errors of their values.
  double add_candidates();
  void split(int c, int b);
  /// Returns the point where edge ij of `polygon_` meets the bisector; its slot is -1 if c and b are nearest there.
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
  std::vector<Corner> corners_;     ///< corners of the parts still to do, one part after the other
  std::vector<std::size_t> parts_;  ///< where each part begins in `corners_`
  std::vector<Corner> polygon_;
  CellEnvelope envelope_;
  std::vector<SiteTree::Ball> balls_;
  std::vector<Index> candidates_;
  std::vector<Barycentric> outline_;
  int num_failures_ = 0;  ///< failures of `part_at_once` in a row
  std::vector<double> height_;
  std::array<Vec3, 3> positions_;
};

}  // namespace subvol::internal
