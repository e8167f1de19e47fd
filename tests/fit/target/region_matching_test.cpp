// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/target/region_matching.h"

#include "subvol/base/error.h"
#include "subvol/fit/high_order_fit.h"
#include "subvol/fit/subdivision_fit.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/surface/boundary.h"
#include "subvol/surface/solid_topology.h"
#include "tests/support/region_fixtures.h"
#include "tests/support/sample_meshes.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

using namespace subvol;
using namespace subvol::internal;
using test::ball_surface;
using test::box_surface;
using test::together;

namespace {

/// A cube of 4 x 4 x 6 hexes with three regions, 1 to 3, whose interfaces are at the given heights.
VolumeMesh layers(double first, double second) {
  VolumeMesh mesh = test::lattice(4, 4, 6);
  const std::array<double, 7> heights{0, first / 2, first, (first + second) / 2, second, (1 + second) / 2, 1};
  for (Vec3& p : mesh.positions) p = {p.x() / 4, p.y() / 4, heights[static_cast<std::size_t>(std::lround(p.z()))]};
  mesh.references.clear();
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    double height = 0;
    for (const Index v : mesh.cell(c)) height += mesh.positions[v].z() / 8;
    mesh.references.push_back(height < first ? 1 : height < second ? 2 : 3);
  }
  return mesh;
}

bool warns_of_outer_surface(const FitReport& report) {
  return std::ranges::any_of(report.warnings, [](const std::string& warning) {
    return warning.find("only the target's outer surface is reproduced") != std::string::npos;
  });
}

}  // namespace

TEST_CASE("Regions of a template find those of the target one to one", "[region_matching]") {
  const TriangleMesh target = surface_of_regions(layers(0.35, 0.8)).mesh;
  // Half of the cells of region 2 are in region 1 of the target, and half of those of region 3 in its region 2.
  const MatchedTarget matched = matched_target(target, layers(0.2, 0.5));
  REQUIRE(matched.regions);
  CHECK(matched.regions->volumes[0] == Approx(0.35));
  CHECK(matched.regions->volumes[2] == Approx(0.2));
  CHECK(matched.warning.empty());
  REQUIRE(matched.outer);
  CHECK(solid_boundary(*matched.outer).volume == Approx(1));
}

TEST_CASE("A target whose regions the template lacks counts as its outer surface, with a warning",
          "[slow][region_matching]") {
  const TriangleMesh target = surface_of_regions(layers(0.3, 0.6)).mesh;
  VolumeMesh start = layers(0.3, 0.6);
  start.references.assign(start.num_cells(), 1);
  const MatchedTarget matched = matched_target(target, start);
  CHECK(!matched.regions);
  REQUIRE(matched.outer);
  CHECK(solid_boundary(*matched.outer).volume == Approx(1));
  CHECK(!matched.warning.empty());

  const FitResult fit = fit_subdivision_volume(target, start, {.levels = 1, .crease_angle_degrees = 40});
  CHECK(warns_of_outer_surface(fit.report));
  CHECK(solid_boundary(triangulate(boundary_surface(fit.mesh, MeshTopology(fit.mesh)))).volume ==
        Approx(1).epsilon(1e-3));
  CHECK(warns_of_outer_surface(fit_high_order(target, start, {.order = 2}).report));
  start.cell_vertices.back() = 1000000;
  CHECK_THROWS_AS(fit_subdivision_volume(target, start, FitOptions{}), InputError);
}

TEST_CASE("Walls of cavities are targets of a template with a cavity, whatever their orientation",
          "[region_matching]") {
  const TriangleMesh target = together(box_surface({-1, -1, -1}, {1, 1, 1}), ball_surface({0, 0, 0}, 0.5, 12));
  VolumeMesh full = test::lattice(5, 5, 5);
  VolumeMesh hollow = test::voxels(5, 5, 5, [](int i, int j, int k) { return i != 2 || j != 2 || k != 2; });
  for (VolumeMesh* mesh : {&full, &hollow})
    for (Vec3& p : mesh->positions) p = 0.4 * p - Vec3::Ones();
  CHECK(!matched_target(target, hollow).outer);
  CHECK(matched_target(target, full).outer);
  CHECK(!matched_target(box_surface({-1, -1, -1}, {1, 1, 1}), full).outer);
}
