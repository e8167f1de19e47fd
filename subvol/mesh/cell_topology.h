// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace subvol {

/// The kinds of cells. The local numbering is that of Medit; the corners of every face are listed so that its
/// right-hand normal points out of a cell of positive volume.
///
///       3            5             7------6
///      /|\          /|\           /|     /|        tet   0 1 2 seen from 3 counter-clockwise
///     / | \        3---4         4------5 |        prism 0 1 2 seen from 3 4 5 counter-clockwise
///    0--|--2       | 2 |         | 3----|-2        hex   0 1 2 3 seen from 4 5 6 7 counter-clockwise
///     \ | /        |/ \|         |/     |/
///       1          0---1         0------1
///
/// Canonical coordinates: hex [0,1]^3 with vertex 1 at (1,0,0), 3 at (0,1,0), 4 at (0,0,1); prism {u+v<=1} x [0,1] with
/// 1 at (1,0,0), 2 at (0,1,0), 3 at (0,0,1); tet {u+v+w<=1} with 1, 2, 3 at the unit vectors. (Paper: section 3.2.)
///
/// A pyramid has the base 0 1 2 3 of a hex, seen counter-clockwise from its apex 4. It is the hex whose upper side has
/// collapsed to the apex: x(s, t, w) = (1-w) B(s, t) + w x_4 with B the bilinear base. In the canonical coordinates
/// u = s (1-w), v = t (1-w), w, its Jacobian J depends on s and t alone, and det J is bilinear in them: the apex has
/// the values of the base, one for each ray.
enum class CellKind : std::uint8_t { tet = 0, prism = 1, hex = 2, pyramid = 3 };

inline constexpr int kNumCellKinds = 4;
inline constexpr int kMaxCellVertices = 8;
inline constexpr int kMaxCellEdges = 12;
inline constexpr int kMaxCellFaces = 6;

/// Local tables of one cell kind. Unused entries are -1.
struct CellTopology {
  const char* name;
  int num_vertices, num_edges, num_faces;
  std::array<std::array<std::int8_t, 2>, kMaxCellEdges> edges;  ///< end vertices of each edge
  std::array<std::int8_t, kMaxCellFaces> face_sizes;            ///< 3 or 4
  std::array<std::array<std::int8_t, 4>, kMaxCellFaces> faces;  ///< corners of each face, outward
  int num_trivalent;  ///< corners at which three edges meet: all, or the first four of a pyramid
  /// The three neighbors of each of these, ordered so that det[n0-c, n1-c, n2-c] > 0 in a cell of positive volume.
  std::array<std::array<std::int8_t, 3>, kMaxCellVertices> corner_neighbors;
};

/// Returns the table of a kind. Never fails; cost: one array access.
const CellTopology& cell_topology(CellKind kind);

}  // namespace subvol
