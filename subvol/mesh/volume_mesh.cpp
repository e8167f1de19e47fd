// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/mesh/volume_mesh.h"

#include "subvol/base/error.h"

namespace subvol {

void VolumeMesh::add_cell(CellKind kind, std::span<const Index> vertices) {
  const CellTopology& topology = cell_topology(kind);
  if (vertices.size() != static_cast<std::size_t>(topology.num_vertices))
    throw InputError(std::string("VolumeMesh::add_cell: a ") + topology.name + " has " +
                     std::to_string(topology.num_vertices) + " corners, got " + std::to_string(vertices.size()));
  kinds.push_back(kind);
  cell_vertices.insert(cell_vertices.end(), vertices.begin(), vertices.end());
  cell_offsets.push_back(cell_vertices.size());
}

}  // namespace subvol
