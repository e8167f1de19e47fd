// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/surface/orientation.h"

#include "subvol/base/error.h"
#include "subvol/surface/solid_topology.h"
#include "subvol/surface/welded_surface.h"

#include <catch2/catch.hpp>

#include <utility>

using namespace subvol;
using namespace subvol::internal;

TEST_CASE("Parts are oriented by their majorities, and those that cannot be stay as they are") {
  // A Moebius strip of five triangles on five vertices, a tetrahedron, and a triangle of its own.
  TriangleMesh mesh{std::vector<Vec3>(12, Vec3::Zero()), {}};
  for (Index i = 0; i < 5; ++i) mesh.triangles.push_back({i, (i + 1) % 5, (i + 2) % 5});
  const std::vector<std::array<Index, 3>> solid{{5, 7, 6}, {5, 8, 7}, {5, 6, 8}, {6, 7, 8}};
  mesh.triangles.insert(mesh.triangles.end(), solid.begin(), solid.end());
  mesh.triangles.push_back({9, 10, 11});
  std::swap(mesh.triangles[6][0], mesh.triangles[6][1]);
  std::vector<std::vector<TriangleNeighbor>> neighbors(mesh.triangles.size());
  for_each_edge(sorted_half_edges(mesh.triangles, mesh.positions.size()), [&](std::span<const SurfaceHalfEdge> edge) {
    if (edge.size() != 2) return;
    for (const int i : {0, 1})
      neighbors[edge[i].triangle].push_back({edge[1 - i].triangle, edge[0].forward == edge[1].forward});
  });
  TriangleMesh oriented = mesh;
  const OrientedParts parts = orient_parts(oriented, neighbors);
  CHECK(parts.part == std::vector<int>{0, 0, 0, 0, 0, 1, 1, 1, 1, -1});
  CHECK(parts.turned == 1);
  CHECK(parts.not_oriented >= 0);
  CHECK(parts.not_oriented < 5);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (t != 6) CHECK(oriented.triangles[t] == mesh.triangles[t]);
  CHECK(oriented.triangles[6] == std::array<Index, 3>{8, 7, 5});  // as {5, 8, 7}
}

TEST_CASE("A surface that cannot be oriented bounds no solid") {
  TriangleMesh strip;
  for (Index i = 0; i < 5; ++i) {
    strip.positions.emplace_back(i % 3, i % 2, i);
    strip.triangles.push_back({i, (i + 1) % 5, (i + 2) % 5});
  }
  CHECK_THROWS_WITH(solid_boundary(strip), Catch::Contains("cannot be oriented"));
}
