// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/crisp_edges.h"
#include "tests/support/feature_fixtures.h"

#include <catch2/catch.hpp>

#include <cmath>
#include <cstddef>
#include <optional>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

/// A block of many cells with bumps of the given height on all sides, as of a rough stone.
TriangleMesh rough_block(double height) {
  TriangleMesh mesh = surface_of(voxels(12, 12, 12, [](int, int, int) { return true; }));
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    const double phase = static_cast<double>(v);
    mesh.positions[v] += height * Vec3(std::sin(17 * phase), std::sin(23 * phase), std::sin(29 * phase));
  }
  return mesh;
}

}  // namespace

TEST_CASE("edges of parts are followed, bends of rough surfaces are not") {
  const TriangleMesh cube = cube_surface(2, false);
  CHECK(has_edges_to_follow(cube, 40, false));
  CHECK_FALSE(has_edges_to_follow(cube, std::nullopt, true));
  CHECK_FALSE(has_edges_to_follow(cube, 100, true));
  const TriangleMesh stone = rough_block(0.3);
  CHECK(has_edges_to_follow(stone, 40, true));
  CHECK_FALSE(has_edges_to_follow(stone, 40, false));
  CHECK(edge_crispness(cube, feature_curves(cube, 40)).crisp_share == Approx(1));
}
