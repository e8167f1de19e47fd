// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/curve_walk.h"
#include "subvol/fit/features/path_negotiation.h"
#include "tests/support/feature_fixtures.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <vector>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

constexpr std::array<double, 3> kAnyEdge{1, 1, 1};

VolumeMesh block() {
  return voxels(8, 8, 2, [](int, int, int) { return true; });
}

Index vertex_at(const VolumeMesh& mesh, const Vec3& point) {
  const auto at = std::ranges::find(mesh.positions, point);
  REQUIRE(at != mesh.positions.end());
  return static_cast<Index>(at - mesh.positions.begin());
}

Occupied nothing(const RoutingGraph& graph) {
  return {std::vector<std::uint8_t>(graph.num_vertices()), std::vector<std::uint8_t>(graph.edges().size()), {}, {}};
}

}  // namespace

TEST_CASE("a walk along a hairpin takes no short cut") {
  const VolumeMesh mesh = block();
  const RoutingGraph graph(mesh);
  CurveWalk walk({{1, 3, 2}, {7, 3, 2}, {7, 4, 2}, {1, 4, 2}}, kAnyEdge, 0.1, 1.1);
  const Index from = vertex_at(mesh, {1, 3, 2}), to = vertex_at(mesh, {1, 4, 2});
  const std::vector<Index> path = walk.cheapest_path(graph, from, to, nothing(graph));
  CHECK(path.size() == 14);
  REQUIRE_FALSE(path.empty());
  CHECK(path.front() == from);
  CHECK(path.back() == to);
  CHECK(std::ranges::count(path, vertex_at(mesh, {7, 3, 2})) == 1);

  SECTION("and passes by what is occupied") {
    const std::vector<Index> others = {vertex_at(mesh, {4, 3, 2})};
    const std::vector<Index> around = walk.cheapest_path(graph, from, to, nothing(graph), others);
    CHECK(around.size() == 16);
    CHECK_FALSE(std::ranges::binary_search(others, around[4]));
  }
  SECTION("but finds none if there is no room") {
    Occupied occupied = nothing(graph);
    for (int y = 0; y <= 8; ++y) occupied.vertices[vertex_at(mesh, Vec3(5, y, 2))] = 1;
    CHECK(walk.cheapest_path(graph, from, to, occupied).empty());
  }
}

TEST_CASE("a walk that would pass through a vertex twice is none") {
  const VolumeMesh mesh = block();
  const RoutingGraph graph(mesh);
  CurveWalk walk({{1, 3.9, 2}, {7, 3.9, 2}, {7, 4.1, 2}, {1, 4.1, 2}}, kAnyEdge, 0.1, 0.8);
  CHECK(walk.cheapest_path(graph, vertex_at(mesh, {1, 4, 2}), vertex_at(mesh, {2, 4, 2}), nothing(graph)).empty());
}

TEST_CASE("paths that want the same row come to terms") {
  const VolumeMesh mesh = block();
  SignedFeatures features;
  for (int i = 0; i < 3; ++i) {
    const double y = 3 + i;
    const auto first = static_cast<Index>(2 * i);
    features.curves.curves.push_back(
        {{first, 6, first + 1}, {Vec3(0, y, 2), Vec3(4, 4 + 0.1 * (i - 1), 2), Vec3(8, y, 2)}});
    features.curves.corners.insert(features.curves.corners.end(), {first, first + 1});
    features.curves.corner_edges.insert(features.curves.corner_edges.end(), {1, 1});
    features.angles.push_back(150);
    features.segment_angles.push_back({150, 150});
  }
  const RoutingGraph graph(mesh);
  const std::vector<std::uint8_t> followed(3, 1);
  const std::vector<std::uint8_t> vanishing(3, 0);
  const CornerPlacement corners(graph, features, followed, vanishing);
  CurveSearch search(graph, features, corners, std::nullopt);
  Occupied base = nothing(graph);
  base.vertices = corners.taken();
  const std::vector<Index> curves = {0, 2, 1};  // alone, the first two would meet in the middle
  std::set<Index> shared;
  for (const Index c : curves) {
    const auto found = search.find(c, base);
    REQUIRE(found);
    shared.insert(found->path.begin(), found->path.end());
  }
  const auto paths = negotiated_paths(graph, features.curves, curves, base, search);
  REQUIRE(paths.size() == 3);
  std::set<Index> used;
  std::size_t number = 0;
  for (const std::vector<Index>& path : paths) {
    CHECK(path.size() >= 9);
    used.insert(path.begin(), path.end());
    number += path.size();
  }
  CHECK(shared.size() < 27);
  CHECK(used.size() == number);
}
