// SPDX-License-Identifier: GPL-3.0-or-later
#include "sample_meshes.h"
#include "subvol/audit.h"

#include <catch2/catch.hpp>

namespace subvol::test {

TEST_CASE("the audit counts smooth edges of one cell and forgets them once creased", "[audit]") {
  VolumeMesh cube = lattice(1, 1, 1);
  SubdivisionAudit found = audit(cube);
  CHECK(found.num_boundary_edges == 12);
  CHECK(found.flattened_edges.size() == 12);
  CHECK(found.warnings.size() == 1);
  tag_creases(cube, 40);
  found = audit(cube);
  CHECK(found.flattened_edges.empty());
  CHECK(found.reflex_creases.empty());
  CHECK(found.folding_corners.empty());
  CHECK(found.warnings.empty());
}

TEST_CASE("the audit finds reflex creases and the corners where they end", "[audit]") {
  VolumeMesh mesh = l_shape(2);
  tag_creases(mesh, 40);
  const SubdivisionAudit found = audit(mesh);
  CHECK(found.can_subdivide());
  CHECK(found.reflex_creases.size() == 2);
  REQUIRE(found.folding_corners.size() == 2);
  for (Index v : found.folding_corners) CHECK(mesh.positions[v].head<2>() == Eigen::Vector2d(1, 1));
  for (const auto& [a, b] : found.reflex_creases) CHECK(mesh.positions[a].head<2>() == mesh.positions[b].head<2>());
  // Creases along the smooth edges within the span make its pieces convex.
  const MeshTopology topology(mesh);
  for (Index corner : found.folding_corners)
    for (std::size_t i = 0; i < topology.num_edges(); ++i) {
      const auto [a, b] = topology.edge(static_cast<Index>(i));
      const bool tagged = std::any_of(mesh.tags.creases.begin(), mesh.tags.creases.end(),
                                      [a = a, b = b](const CreaseEdge& c) { return c.v0 == a && c.v1 == b; });
      if ((a == corner || b == corner) && topology.is_boundary_edge(static_cast<Index>(i)) && !tagged)
        mesh.tags.creases.push_back({a, b, kInfiniteSharpness});
    }
  CHECK(audit(mesh).folding_corners.empty());
}

TEST_CASE("the audit names boundary edges and vertices that are no manifold", "[audit]") {
  const SubdivisionAudit edge = audit(voxels(2, 2, 1, [](int i, int j, int) { return i == j; }));
  CHECK(!edge.can_subdivide());
  CHECK(edge.nonmanifold_edges.size() == 1);
  const SubdivisionAudit vertex = audit(voxels(2, 2, 2, [](int i, int j, int k) { return i == j && j == k; }));
  CHECK(!vertex.can_subdivide());
  CHECK(vertex.nonmanifold_edges.empty());
  CHECK(vertex.nonmanifold_vertices.size() == 1);
}

}  // namespace subvol::test
