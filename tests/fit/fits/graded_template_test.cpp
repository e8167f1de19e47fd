// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/fits/graded_template.h"

#include "subvol/fit/target/fit_target.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/mesh/validate.h"
#include "subvol/surface/boundary.h"
#include "subvol/surface/solid_topology.h"
#include "subvol/templates/auto_template.h"
#include "tests/support/surface_fixtures.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <chrono>
#include <span>
#include <thread>
#include <vector>

using namespace subvol;
using namespace subvol::internal;

TEST_CASE("Points that a fitted surface misses come farthest first", "[graded_template]") {
  const TriangleMesh cube = test::cube_surface(4, false);
  TriangleMesh moved = cube;
  for (Vec3& p : moved.positions)
    if (p.x() > 0.9) p.x() += p.y() > 0.4 ? 0.4 : 0.2;
  const TargetSurface target(cube);
  CHECK(missed_points(target, ClosestPoint(cube), 1e-9).empty());
  const std::vector<Vec3> missed = missed_points(target, ClosestPoint(moved), 0.1);
  REQUIRE(!missed.empty());
  CHECK(missed.front().y() > 0.4);
  for (const Vec3& p : missed) CHECK(p.x() > 0.5);
}

TEST_CASE("A graded template has small cells at the first places that there is room for", "[graded_template]") {
  const TriangleMesh ball = test::cube_surface(8, true);
  const AutoTemplateResult made = auto_templates(ball, {.cells = 400, .pillow = true});
  REQUIRE(made.templates.size() == 1);
  const AutoTemplate& base = made.templates.front();
  const TriangleMesh solid = solid_boundary(ball).surface;
  const std::vector<Vec3> places{ball.positions.front(), -ball.positions.front()};
  SearchStop never({});
  const auto make = [&](std::span<const Vec3> at, std::size_t most) {
    return graded_template(solid, base.grid, base.kept, at, most, never);
  };
  const auto both = make(places, 100000), first = make(std::span(places).first(1), 100000);
  REQUIRE(both);
  REQUIRE(first);
  CHECK(validate(both->mesh).empty());
  CHECK(both->sizes.size() == both->mesh.num_cells());
  CHECK(std::ranges::min(both->sizes) == Approx(1.0 / 3));
  CHECK(first->mesh.num_cells() < both->mesh.num_cells());
  const auto limited = make(places, both->mesh.num_cells() - 1);
  REQUIRE(limited);
  CHECK(limited->mesh.num_cells() == first->mesh.num_cells());
  CHECK(!make(places, base.mesh.num_cells()));
  CHECK(!make({}, 100000));
  const std::vector<Vec3> outside{Vec3::Constant(1e9)};
  CHECK(!make(outside, 100000));
  SearchStop now([] { return false; });
  std::this_thread::sleep_for(std::chrono::milliseconds(60));  // it is asked every 50 ms
  CHECK(!graded_template(solid, base.grid, base.kept, places, 100000, now));
}
