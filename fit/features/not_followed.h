// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

namespace subvol {

/// Reasons why no path of a mesh follows a curve.
enum class NotFollowed {
  excluded,                  ///< the caller excluded it
  too_acute,                 ///< the solid is so thin along it that no cell there has a good scaled Jacobian
  shorter_than_cell,         ///< it is shorter than an edge of the mesh
  no_vertex_at_corner,       ///< one of its corners has no vertex nearby, or another corner took it
  too_many_edges_at_corner,  ///< the vertex at one of its corners has fewer edges than curves that end there
  no_path_nearby,            ///< no path of edges stays close to it
  lost_to_neighbor           ///< paths of other curves are in its way
};

/// Returns text for people, such as "shorter than a cell".
std::string to_string(NotFollowed reason);

}  // namespace subvol
