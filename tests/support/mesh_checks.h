// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/mesh_topology.h"
#include "subvol/mesh/validate.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/boundary.h"

#include <catch2/catch.hpp>

#include <set>

namespace subvol::test {

/// Volume inside the boundary, cut into triangles.
inline double volume_of(const VolumeMesh& mesh) {
  const TriangleMesh surface = triangulate(boundary_surface(mesh, MeshTopology(mesh)));
  double sum = 0;
  for (const auto& t : surface.triangles)
    sum += surface.positions[t[0]].dot(surface.positions[t[1]].cross(surface.positions[t[2]])) / 6;
  return sum;
}

inline long euler_number(const VolumeMesh& mesh) {
  const MeshTopology topology(mesh);
  std::set<Index> used(mesh.cell_vertices.begin(), mesh.cell_vertices.end());
  return static_cast<long>(used.size()) - static_cast<long>(topology.num_edges()) +
         static_cast<long>(topology.num_faces()) - static_cast<long>(mesh.num_cells());
}

/// Sound, with the Euler number and volume given.
inline void check_mesh_is(const VolumeMesh& mesh, long euler, double volume) {
  for (const MeshDefect& defect : validate(mesh)) FAIL_CHECK(defect.message);
  CHECK(euler_number(mesh) == euler);
  CHECK(volume_of(mesh) == Approx(volume).epsilon(1e-12));
}

}  // namespace subvol::test
