// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/routing_graph.h"

#include "tests/support/sample_meshes.h"

#include <catch2/catch.hpp>

using namespace subvol;
using namespace subvol::internal;

namespace {

FeatureCurve curve_through(std::vector<Vec3> points) {
  FeatureCurve curve{{}, std::move(points)};
  for (std::size_t i = 0; i < curve.points.size(); ++i) curve.vertices.push_back(static_cast<Index>(i));
  return curve;
}

}  // namespace

TEST_CASE("an edge of the mesh lies on a straight curve of its length, and on no other") {
  // Flat cells: a tenth as high as wide.
  VolumeMesh mesh = test::lattice(3, 3, 3);
  for (Vec3& p : mesh.positions) p.z() *= 0.1;
  const RoutingGraph graph(mesh);
  const auto lies = [&](std::vector<Vec3> points) { return has_edge_on(graph, curve_through(std::move(points))); };
  CHECK(lies({{0, 0, 0}, {0, 0, 0.1}}));
  CHECK(lies({{0, 0, 0.1}, {0.001, 0, 0.15}, {0, 0.001, 0.2}}));
  CHECK_FALSE(lies({{0, 0, 0}, {0, 0, 0.2}}));                  // two edges
  CHECK_FALSE(lies({{0, 0, 0.03}, {0, 0, 0.13}}));              // between vertices
  CHECK_FALSE(lies({{0, 0, 0}, {0, 0.1, 0.05}, {0, 0, 0.1}}));  // bent
  CHECK_FALSE(lies({{1.5, 1.5, 0.1}, {1.5, 1.5, 0.2}}));        // inside
  CHECK_FALSE(has_edge_on(RoutingGraph(VolumeMesh{}), curve_through({{0, 0, 0}, {1, 0, 0}})));
}
