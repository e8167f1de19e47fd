// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/mesh_topology.h"
#include "subvol/mesh/volume_mesh.h"

#include <algorithm>

namespace subvol::test {

/// The same mesh with the groups "floor", number 1, and "roof", number 2: the boundary faces at z = 0 and z = height.
inline VolumeMesh with_floor_and_roof(VolumeMesh mesh, double height) {
  mesh.face_groups.groups = {{"floor", 1, 2}, {"roof", 2, 2}};
  const MeshTopology topology(mesh);
  for (const Index f : topology.boundary_faces()) {
    const auto face = topology.face(f);
    for (const Index group : {0, 1})
      if (std::all_of(face.begin(), face.end(),
                      [&](Index v) { return mesh.positions[v].z() == (group == 0 ? 0 : height); }))
        mesh.face_groups.faces.push_back({face_key(face), group});
  }
  normalize(mesh.face_groups);
  return mesh;
}

}  // namespace subvol::test
