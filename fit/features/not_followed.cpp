// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/not_followed.h"

namespace subvol {

std::string to_string(NotFollowed reason) {
  switch (reason) {
    case NotFollowed::excluded: return "excluded";
    case NotFollowed::too_acute: return "too acute";
    case NotFollowed::shorter_than_cell: return "shorter than a cell";
    case NotFollowed::no_vertex_at_corner: return "no vertex near its corner";
    case NotFollowed::too_many_edges_at_corner: return "too many sharp edges at its corner";
    case NotFollowed::no_path_nearby: return "no path nearby";
    case NotFollowed::lost_to_neighbor: return "lost to a neighbor";
  }
  return "unknown";
}

}  // namespace subvol
