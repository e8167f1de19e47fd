// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/subdivision/surface_refinement.h"
#include "subvol/surface/sheets.h"

#include <vector>

namespace subvol::internal {

/// Interior rows next to creases of two or more cells.
///
/// Around a crease of k cells the plain interior rows have the dominant eigenvalue
///
///   lambda = (5 + c + sqrt((c + 9)(c + 1))) / 16,   c = cos(pi / k)
///
/// while the two boundary faces there have 1/2. For k = 2 it is 1/2, too, but coupled to theirs (a Jordan block): the
/// interior face that leaves the crease (its *sheet*) turns on and on toward the mean of the boundary faces. For k = 3
/// it is .5797: the sheets shrink more slowly than the boundary and all turn one way. At a reflex crease both invert
/// cells, more with every level. Weights >= 0 that couple the sheets are no remedy: if the dominant eigenvalue is 1/2
/// or less, the sheets become positive combinations of the boundary faces, which lie outside a reflex sector. So the
/// sheets are decoupled at a crease, and each is refined as a surface of its own:
///
///   face of a sheet      its centroid
///   edge of a sheet with one end at the crease
///                        the smooth Catmull-Clark edge rule over the sheet's faces next to the crease; the midpoint
///                        if an end is fixed or if there is only one such face
///
/// Every sheet then has the eigenvalue 1/2 in its own direction, like the boundary faces, and cells that are positive
/// around a crease stay so. The rows depend on topology and tags alone. Boundary rows are unchanged, so the boundary
/// remains that of OpenSubdiv; inside, the map is only continuous across sheets at the crease. Weights stay >= 0, rows
/// sum to 1, and lattices are reproduced.
///
/// Interfaces between regions are sheets with rows of their own, like the boundary. Their creases, and the feature
/// curves at which they end, are treated as those of the boundary are.
class CreaseSheets {
 public:
  /// Creases of at least this many cells are treated.
  static constexpr int kMinCells = 2;

  CreaseSheets(const VolumeMesh& mesh, const MeshTopology& topology, const SheetSurface& sheets);

  /// Return the share, 0 to 1, of the sheet's rule in the row of an interior face or edge: min(1, sharpness) of its
  /// crease, the largest if it has several.
  double face_share(Index f) const { return face_shares_.empty() ? 0 : face_shares_[f]; }
  double edge_share(Index e) const { return edge_shares_.empty() ? 0 : edge_shares_[e]; }

  /// Adds `weight` times the sheet's row of an interior edge.
  void add_edge(Index e, double weight, RowBuilder& row) const;

 private:
  struct EdgeFace {
    Index edge, face;
  };
  void visit_face(Index f, const std::vector<double>& crease_shares);

  const MeshTopology& topology_;
  std::vector<double> face_shares_, edge_shares_;
  std::vector<char> on_sheet_;        // true for edges of the boundary and of interfaces
  std::vector<char> fixed_;           // true for vertices that stay in place
  std::vector<EdgeFace> edge_faces_;  // sheet faces of each treated edge, sorted
};

}  // namespace subvol::internal
