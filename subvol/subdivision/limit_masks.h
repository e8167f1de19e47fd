// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <span>
#include <vector>

namespace subvol::internal {

/// Weights on the ring of a surface vertex v of valence n among quads: [v][e_0 .. e_n-1][f_0 .. f_n-1], where e_i are
/// its neighbors counter-clockwise and f_i the corner opposite v in the quad between e_i and e_i+1.
using RingMask = std::vector<double>;

/// The sharpnesses around one vertex: its own, and those of its edges in ring order.
struct RingSharpness {
  float corner;
  std::vector<float> edges;
};

/// Returns the weights of the Catmull-Clark limit position of v; they sum to 1.
///
///   smooth (n^2 v + 4 sum e_i + sum f_i) / (n (n + 5)),  crease (e_a + 4 v + e_b) / 6,  corner v
///
/// The mask is also exact for semi-sharp features (the rules of all levels until they have decayed are multiplied) and
/// for darts (the left eigenvector of eigenvalue 1 of the dart's own ring rules, by power iteration). Cost: O(n); darts
/// take 512 steps of O(n).
RingMask limit_mask(const RingSharpness& ring);

/// A smooth piece of the surface at v: the quads from `first` to first + count - 1 (modulo n).
struct TangentSector {
  int first, count;
};

/// Returns the smooth pieces at v: one from each infinitely sharp edge to the next, or the whole ring if there are
/// fewer than two such edges.
std::vector<TangentSector> tangent_sectors(const RingSharpness& ring);

/// Returns masks of two directions u, v that span the tangent plane of the surface at v in one of its sectors. The
/// weights of each mask sum to 0. u x v points outward, but may be reversed in a sector of more than 180 degrees.
///
/// Smooth and crease tangents are the left eigenvectors of the dominant eigenvalues; normals at darts are accurate to
/// 2e-5. At corners they are the crease edges (for up to two quads), which are the tangents of the limit. On a crease
/// side of one quad the surface flattens only logarithmically: its mean direction is used, accurate to a few
/// hundredths. Cost: O(n).
std::array<RingMask, 2> tangent_masks(const RingSharpness& ring, const TangentSector& sector);

}  // namespace subvol::internal
